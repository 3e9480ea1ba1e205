// consac doctor: what this machine can do, and what is wrong with an endpoint.
#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "bench/peak.h"
#include "cli/conformance.h"
#include "cli/conformance_frames.h"
#include "cli/flags.h"
#include "cli/machine.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/file.h"
#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/env/buffer.h"
#include "consac/nn/kernels.h"
#include "consac/server/env_client.h"

namespace consac::cli {
namespace {

constexpr double kEndpointPatience = 3.0;  // s for an engine's answer, and between a trainer's connections

struct DoctorFlags {
  std::string url, conformance, trainer, token, directory = "runs";
  double timeout = 0.0;  // 0: not given

  double Patience(double otherwise) const { return timeout > 0.0 ? timeout : otherwise; }
};

void Check(const char* what, const Status& status) {
  Print("{:<20} {}\n", what, status.ok() ? "ok" : "FAILED: " + status.message());
}

/// A round trip over a loopback port of our own.
Status TestLoopback() {
  Result<std::unique_ptr<Listener>> listener = ListenTcp({"127.0.0.1", 0});
  if (!listener.ok()) return listener.status();
  Result<std::unique_ptr<Transport>> near_end = ConnectTcp({"127.0.0.1", (*listener)->port()}, 1.0);
  if (!near_end.ok()) return near_end.status();
  Result<std::unique_ptr<Transport>> far_end = (*listener)->Accept(1.0);
  if (!far_end.ok()) return far_end.status();
  if (*far_end == nullptr)
    return {StatusCode::kUnavailable, "a connection to this machine's own port was not accepted within 1 s"};
  const std::byte sent{42};
  std::byte got{0};
  CONSAC_RETURN_IF_ERROR((*near_end)->Write({&sent, 1}, 1.0));
  const Result<std::size_t> count = (*far_end)->Read({&got, 1}, 1.0);
  if (!count.ok()) return count.status();
  return *count == 1 && got == sent ? Status::Ok()
                                    : Status{StatusCode::kUnavailable, "a byte sent over loopback did not arrive"};
}

Status TestDisk(const std::string& directory) {
  std::error_code error;
  std::filesystem::create_directories(ToPath(directory), error);
  if (error) return {StatusCode::kDataLoss, "cannot make folder '" + directory + "': " + error.message()};
  const std::string path = directory + "/.doctor";
  const std::vector<std::byte> bytes(1 << 16);
  const Status status = WriteFileAtomically(path, bytes);
  std::filesystem::remove(ToPath(path), error);
  return status;
}

/// An engine whose slots are all empty may have forgotten to say who takes part.
Status CheckSomebody(const EnvClient& client) {
  for (std::size_t b = 0; b < client.spec().behaviours.size(); ++b) {
    const std::span<const std::uint8_t> present = client.present(b);
    if (present.empty() || std::find(present.begin(), present.end(), 1) != present.end()) return Status::Ok();
  }
  return {StatusCode::kProtocol,
          "no agent takes part: RESULT's state 16 is set for no slot; the engine sets it for every agent whose action "
          "counts next time (R77)"};
}

/// What an EnvClient says is for those who train; the flag is another here.
int FailAtEndpoint(const Status& status) {
  constexpr std::string_view kFlag = "--deadline";
  std::string message = status.message();
  const std::size_t at = message.find(kFlag);
  if (status.code() == StatusCode::kDeadlineExceeded && at != std::string::npos)
    message.replace(at, kFlag.size(), "--timeout");
  return Fail("doctor", {status.code(), message});
}

/// What may be set, and who is rewarded together.
void PrintExtras(const EnvSpec& spec) {
  for (const ParameterSpec& parameter : spec.parameters) {
    Print("parameter            {}: {}, {} to {}{}\n", parameter.name, NumberText(parameter.default_value),
          NumberText(parameter.low), NumberText(parameter.high),
          parameter.description.empty() ? "" : " (" + PrintableLine(parameter.description) + ")");
  }
  for (const GroupSpec& group : spec.groups) {
    std::string agents;
    for (const GroupSpec::Member& member : group.members) {
      const BehaviourSpec& behaviour = spec.behaviours[member.behaviour];
      agents += (agents.empty() ? "" : ", ") + behaviour.agents[member.agent];
      if (spec.behaviours.size() > 1) agents += " of " + behaviour.name;
    }
    Print("group                {}: {}\n", group.name, agents);
  }
}

int ExamineEndpoint(const DoctorFlags& flags) {
  const double timeout = flags.Patience(kEndpointPatience);
  const Result<Endpoint> endpoint = Endpoint::Parse(flags.url);
  if (!endpoint.ok()) return Fail("doctor", endpoint.status());
  Result<std::unique_ptr<Transport>> transport = ConnectTcp(*endpoint, timeout);
  if (!transport.ok()) return Fail("doctor", transport.status());
  EnvClientOptions options;
  options.setup_timeout_s = options.deadline_s = timeout;
  options.waits_while_paused = false;  // an answer is wanted, and within that time
  options.token = flags.token;
  Result<std::unique_ptr<EnvClient>> client = EnvClient::Open(std::move(*transport), options);
  if (!client.ok()) return FailAtEndpoint(client.status());
  const std::vector<BehaviourSpec>& behaviours = (*client)->spec().behaviours;
  const SessionRequest& request = (*client)->request();
  Print("endpoint             {}\n", (*client)->description());
  std::vector<BatchBuffer> buffers;
  std::vector<Batch> batches;
  for (const BehaviourSpec& behaviour : behaviours) {
    const std::string of = behaviours.size() > 1 ? " of '" + behaviour.name + "'" : "";
    Print("observation          {}{}\naction               {}{}\n", behaviour.observation_space.ToString(), of,
          behaviour.action_space.ToString(), of);
    batches.push_back(buffers.emplace_back(behaviour).batch());
  }
  Print("training length      {}\nmodel name           {}\n", request.training_length,
        request.model_name.empty() ? "none given" : request.model_name);
  PrintExtras((*client)->spec());
  Status status = (*client)->Reset(0, batches);
  if (!status.ok()) return FailAtEndpoint(status);
  std::map<std::string, std::pair<double, std::int64_t>> noted;  // sum and count
  Rng rng(1, StreamId("doctor"));
  constexpr std::int64_t kMostSteps = 50;
  const std::int64_t steps = request.training_length > 0 ? std::min(request.training_length, kMostSteps) : kMostSteps;
  const double start = Now();
  for (std::int64_t i = 1; i <= steps && status.ok(); ++i) {
    for (std::size_t b = 0; b < behaviours.size(); ++b) {
      buffers[b].Advance();
      batches[b] = buffers[b].batch();
      for (std::int64_t row = 0; row < batches[b].rows(); ++row) {
        const Layout& layout = behaviours[b].action_layout;
        std::byte* actions = batches[b].actions + static_cast<std::size_t>(row) * layout.row_bytes;
        SampleRow(layout, rng, actions);
        if (batches[b].action_masks != nullptr)
          MakeLegal(layout, batches[b].action_masks + row * layout.mask_bytes, actions);
      }
    }
    status = (*client)->Step(batches, i == steps ? MoreSteps::kLast : MoreSteps::kYes);
    for (const Statistic& statistic : (*client)->statistics()) {
      noted[statistic.name].first += statistic.value;
      ++noted[statistic.name].second;
    }
  }
  if (status.ok()) status = CheckSomebody(**client);
  (*client)->Close();
  if (!status.ok()) return FailAtEndpoint(status);
  for (const auto& [name, sum] : noted)
    Print("statistic            {}: {:.4g} over {} numbers\n", name, sum.first / static_cast<double>(sum.second),
          sum.second);
  Print("step                 {:.1f} us with random actions over {} steps\nthe engine is fine\n",
        (Now() - start) / static_cast<double>(steps) * 1e6, steps);
  return 0;
}

/// What came, what the case's step wants, and what was sent before it.
void PrintFault(const ConformanceVerdict& verdict) {
  Print("{:<12} {}\n", "", verdict.status.message());
  if (verdict.step > 0) Print("{:<12} at step {}: {}\n", "", verdict.step, Shortened(verdict.asked));
  if (!verdict.sent.empty()) Print("{:<12} after {}\n", "", Shortened(verdict.sent));
}

/// Puts a server, or a trainer, through the conformance cases of protocol 2.
int ExamineConformance(const DoctorFlags& flags) {
  const bool of_trainer = !flags.trainer.empty();
  const Result<Endpoint> endpoint = Endpoint::Parse(of_trainer ? flags.trainer : flags.conformance);
  if (!endpoint.ok()) return Fail("doctor", endpoint.status());
  const auto say = [&](const ConformanceVerdict& verdict) {
    const char* holds = verdict.offered ? "holds" : "not offered";
    const std::string why_not = verdict.offered ? "" : ": " + Shortened(verdict.why_not, 200);
    Print("{:<12} {} ({}){}\n", verdict.status.ok() ? holds : "FAILS", verdict.name, verdict.rules, why_not);
    if (!verdict.status.ok()) PrintFault(verdict);
    FlushOutput();
  };
  Result<std::unique_ptr<Listener>> listener(nullptr);
  if (of_trainer) {
    listener = ListenTcp(*endpoint);
    if (!listener.ok()) return Fail("doctor", listener.status());
    Print(
        "listening on tcp://{}:{}; let the trainer connect, reset all and step all, again and again, within {} s each "
        "time\n",
        endpoint->host, (*listener)->port(), flags.Patience(kEndpointPatience));
    FlushOutput();
  }
  const Result<ConformanceCount> count =
      of_trainer ? RunTrainerConformance(**listener, flags.Patience(kEndpointPatience), say)
                 : RunConformance(*endpoint, flags.token, flags.Patience(kConformancePatience), say);
  if (!count.ok()) return Fail("doctor", count.status());
  const int run = count->held + count->failed;
  if (run + count->not_offered > 0) Print("{} of {} cases of protocol 2 hold", count->held, run);
  if (count->not_offered > 0) {
    Print("; {} more are of what this {}", count->not_offered,
          of_trainer ? "trainer does not do, which is its right (each line says what; one more run with another "
                       "autoreset asked for first, or another order of steps, reaches more)"
                     : "engine does not offer, which is its right (each line says why)");
  }
  if (run + count->not_offered > 0) Print("\n");
  if (count->failed > 0)
    Print("rules (R...): spec/protocol2.md; what the steps of a case mean: spec/conformance/protocol2/README.md\n");
  if (!count->ended.ok()) return Fail("doctor", count->ended);
  return count->failed == 0 ? 0 : 3;
}

int Doctor(const DoctorFlags& flags) {
  EndAtSignals();
  const std::pair<const char*, const std::string&> asked[] = {
      {"an engine", flags.url}, {"--conformance", flags.conformance}, {"--conformance-trainer", flags.trainer}};
  std::string all;
  int count = 0;
  for (const auto& [what, url] : asked) {
    if (url.empty()) continue;
    all += fmt::format("{}{} {}", count++ == 0 ? "" : " and ", what, Quote(url));
  }
  if (count > 1) return Fail("doctor", {StatusCode::kInvalidArgument, "one examination at a time, got " + all});
  if (!flags.conformance.empty() || !flags.trainer.empty()) return ExamineConformance(flags);
  if (!flags.url.empty()) return ExamineEndpoint(flags);
  Print(
      "consac               {}\nprocessor            {}\ncores                {}\ncompiler             {}\nkernels     "
      "         {} ({} floats a register)\n",
      kVersion, bench::CpuName(), std::thread::hardware_concurrency(), CompilerName(), nn::InstructionSet(),
      nn::VectorLanes());
  const double peak = nn::MeasurePeakFlops(0.3), reached = MeasureDenseFlops(0.3);
  Print(
      "peak, one core       {:.1f} GFLOP/s (fused multiply-add in these registers)\ndense layer 64x64    {:.1f} "
      "GFLOP/s, {:.0f}% of the peak\n",
      peak / 1e9, reached / 1e9, 100.0 * reached / peak);
  const Status loopback = TestLoopback(), disk = TestDisk(flags.directory);
  Check("loopback TCP", loopback);
  Check("writing runs", disk);
  if (!loopback.ok()) return ExitCode(loopback);
  return ExitCode(disk);
}

}  // namespace

Action AddDoctor(CLI::App& app) {
  const auto flags = std::make_shared<DoctorFlags>();
  app.add_option("url", flags->url,
                 "an engine to examine, tcp://host:port; takes one session of it and up to 50 steps");
  app.add_option(
      "--conformance", flags->conformance,
      "test the engine at tcp://host:port against spec/protocol2.md: a connection and a line for each case of "
      "spec/conformance/protocol2/server.json, with the numbers of its rules on that page. Exit code 0: all "
      "that the engine offers holds; 3: a case FAILS, and three lines say what came, what the case wants at "
      "that step, and what was sent before it");
  app.add_option(
      "--conformance-trainer", flags->trainer,
      "test a trainer: be the engine at tcp://host:port (port 0: a free one, which is said). A connection is a case of "
      "spec/conformance/protocol2/trainer.json or results.json: the trainer connects, resets all environments and "
      "steps all of them with random legal actions until the engine ends the session or is wrong, then connects anew, "
      "each time within --timeout s. It must be able to do same_step; run it again asking for next_step, and for "
      "disabled, first: then their cases come too. Cases of some of the two environments alone come to a trainer that, "
      "behind the first RESET, steps all, then the second alone; or steps the second alone, then the first; or steps "
      "the first alone; or steps all, then resets the first alone; with disabled also steps all, then the second "
      "alone, then resets the first alone: a run each. It must wait for an answer for more than 10 s, as it does in "
      "games: one that gives up before seems to refuse what it has overlooked. With --timeout above that time it is "
      "also judged by when it leaves an engine in which nobody takes part");
  AddToken(app, &flags->token, "access token that the server asks for");
  app.add_option("--dir", flags->directory, "folder of the runs, for the writing test");
  AddNumber(app, "--timeout", &flags->timeout, 0.001, kMostSeconds,
            "seconds to wait for each answer (3 unless given, of --conformance 10)");
  return [flags] { return Doctor(*flags); };
}

}  // namespace consac::cli
