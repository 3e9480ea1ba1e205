// consac doctor: what this machine can do, and what is wrong with an endpoint.
#include <algorithm>
#include <thread>

#include "bench/peak.h"
#include "cli/conformance.h"
#include "cli/flags.h"
#include "cli/machine.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/file.h"
#include "consac/base/version.h"
#include "consac/env/buffer.h"
#include "consac/nn/kernels.h"
#include "consac/run/path.h"
#include "consac/server/env_client.h"

namespace consac::cli {
namespace {

struct DoctorFlags {
  std::string url, conformance, token, directory = "runs";
  double timeout = 3.0;
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
  std::filesystem::create_directories(run::ToPath(directory), error);
  if (error) return {StatusCode::kDataLoss, "cannot make folder '" + directory + "': " + error.message()};
  const std::string path = directory + "/.doctor";
  const std::vector<std::byte> bytes(1 << 16);
  const Status status = WriteFileAtomically(path, bytes);
  std::filesystem::remove(run::ToPath(path), error);
  return status;
}

int ExamineEndpoint(const DoctorFlags& flags) {
  const Result<Endpoint> endpoint = Endpoint::Parse(flags.url);
  if (!endpoint.ok()) return Fail("doctor", endpoint.status());
  Result<std::unique_ptr<Transport>> transport = ConnectTcp(*endpoint, flags.timeout);
  if (!transport.ok()) return Fail("doctor", transport.status());
  EnvClientOptions options;
  options.setup_timeout_s = options.deadline_s = flags.timeout;
  options.token = flags.token;
  Result<std::unique_ptr<EnvClient>> client = EnvClient::Open(std::move(*transport), options);
  if (!client.ok()) return Fail("doctor", client.status());
  const BehaviourSpec& behaviour = (*client)->spec().behaviours[0];
  const SessionRequest& request = (*client)->request();
  Print(
      "endpoint             {}\nobservation          {}\naction               {}\ntraining length      {}\nmodel name  "
      "         {}\n",
      (*client)->description(), behaviour.observation_space.ToString(), behaviour.action_space.ToString(),
      request.training_length, request.model_name.empty() ? "none given" : request.model_name);
  BatchBuffer buffer(behaviour);
  Status status = (*client)->Reset(0, {&buffer.batch(), 1});
  if (!status.ok()) return Fail("doctor", status);
  Rng rng(1, StreamId("doctor"));
  constexpr std::int64_t kMostSteps = 50;
  const std::int64_t steps = request.training_length > 0 ? std::min(request.training_length, kMostSteps) : kMostSteps;
  const double start = Now();
  for (std::int64_t i = 1; i <= steps && status.ok(); ++i) {
    buffer.Advance();
    SampleRow(behaviour.action_layout, rng, buffer.batch().actions);
    status = (*client)->Step({&buffer.batch(), 1}, i == steps ? MoreSteps::kLast : MoreSteps::kYes);
  }
  (*client)->Close();
  if (!status.ok()) return Fail("doctor", status);
  Print("step                 {:.1f} us with random actions over {} steps\nthe engine is fine\n",
        (Now() - start) / static_cast<double>(steps) * 1e6, steps);
  return 0;
}

/// Puts a server through the conformance cases of protocol 2.
int ExamineConformance(const DoctorFlags& flags) {
  const Result<Endpoint> endpoint = Endpoint::Parse(flags.conformance);
  if (!endpoint.ok()) return Fail("doctor", endpoint.status());
  int count = 0;
  const Result<int> failed = RunConformance(*endpoint, flags.token, [&](const ConformanceVerdict& verdict) {
    ++count;
    Print("{:<8} {}{}\n", verdict.status.ok() ? "holds" : "FAILS", verdict.name,
          verdict.status.ok() ? "" : "\n         " + verdict.status.message());
    std::fflush(stdout);
  });
  if (!failed.ok()) return Fail("doctor", failed.status());
  Print("{} of {} cases of protocol 2 hold\n", count - *failed, count);
  return *failed == 0 ? 0 : 3;
}

int Doctor(const DoctorFlags& flags) {
  if (!flags.conformance.empty()) return ExamineConformance(flags);
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
  app.add_option("--conformance", flags->conformance,
                 "put the server at tcp://host:port through the cases of spec/conformance/protocol2");
  app.add_option("--token", flags->token, "access token that the server asks for");
  app.add_option("--dir", flags->directory, "folder of the runs, for the writing test");
  AddNumber(app, "--timeout", &flags->timeout, 0.001, kMostSeconds, "seconds to wait for the endpoint");
  return [flags] { return Doctor(*flags); };
}

}  // namespace consac::cli
