// The program `consac`: the table of verbs, and how a verb is found and run.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "cli/commit.h"
#include "cli/machine.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/nn/kernels.h"
#include "consac/run/output.h"
#include "consac/run/shortage.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

constexpr Verb kVerbs[] = {
    {"demo", "the whole story in seconds, on the built-in road world over TCP", "consac demo\nconsac demo yumi",
     AddDemo},
    {"serve", "be the engine: offer a built-in world on a port",
     "consac serve road-v0 --port 5005\nconsac serve cartpole-v1 --port 0 --port-file port.txt --rate 60", AddServe},
    {"train", "learn a built-in world, or the world of an engine",
     "consac train cartpole-v1 --envs 8 --steps 100000\nconsac train tcp://127.0.0.1:5005 --name walker --set "
     "learning_rate=1e-3\n"
     "consac train pendulum-v1 --algo sac --steps 5000\n"
     "consac train --resume --name walker",
     AddTrain},
    {"eval", "mean return of a model over episodes",
     "consac eval walker\nconsac eval runs/walker/model.consac road-v0 --episodes 20 --json", AddEval},
    {"play", "watch a model, step by step", "consac play walker road-v0 --steps 40", AddPlay},
    {"list", "worlds, algorithms, policies, hyperparameters",
     "consac list worlds\nconsac list hyperparameters ppo2 --json", AddList},
    {"inspect", "what is inside a model or checkpoint", "consac inspect runs/walker/model.consac", AddInspect},
    {"twin", "a robot's description made a digital twin for engines, and its kinematics",
     "consac twin import robot.urdf -o twin\nconsac twin fk twin --q 0.1,-0.4,0 --link tool\nconsac twin check twin\n"
     "consac twin view twin --open",
     AddTwin},
    {"bench", "speed on this machine, as a table", "consac bench\nconsac bench --only cartpole --json", AddBench},
    {"doctor", "what this machine can do, and what is wrong with an endpoint",
     "consac doctor\nconsac doctor tcp://127.0.0.1:5005", AddDoctor},
};

std::atomic<bool> stop_flag{false}, told_to_stop{false};
std::string program_path = "consac";

void EndWhereNothingIsLost() {
  if (run::NothingToLose()) EndAtOnce("consac: interrupted before the training began; nothing is lost\n", 130);
}

extern "C" void OnStopSignal(int) {
  stop_flag = true;
  EndWhereNothingIsLost();
  if (told_to_stop.exchange(true)) std::_Exit(130);
}

// A terminal that closes tells more than once, and a system that goes down sends SIGTERM as well: neither is
// impatience.
extern "C" void OnHangUp(int) {
  stop_flag = true;
  EndWhereNothingIsLost();
}

extern "C" void OnEndSignal(int) {
  std::_Exit(130);
}

/// The signals that ask a program to end; a hang-up that is ignored (nohup) stays so.
void Catch(void (*on_stop)(int), [[maybe_unused]] void (*on_hang_up)(int)) {
  std::signal(SIGINT, on_stop);
  std::signal(SIGTERM, on_stop);
#if defined(SIGHUP)
  if (std::signal(SIGHUP, on_hang_up) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
#endif
#if defined(SIGBREAK)
  std::signal(SIGBREAK, on_stop);  // Windows: Ctrl-Break
#endif
}

}  // namespace

int ExitCode(const Status& status) {
  switch (status.code()) {
    case StatusCode::kOk:
      return 0;
    case StatusCode::kInvalidArgument:
    case StatusCode::kNotFound:
    case StatusCode::kAlreadyExists:
    case StatusCode::kFailedPrecondition:
      return 2;
    case StatusCode::kProtocol:
    case StatusCode::kUnavailable:
    case StatusCode::kDeadlineExceeded:
      return 3;
    case StatusCode::kDataLoss:
    case StatusCode::kResourceExhausted:
      return 6;
    case StatusCode::kNonFinite:
      return 7;
    case StatusCode::kCancelled:
      return 130;
    case StatusCode::kInternal:
      return 1;
  }
  return 1;
}

int Fail(const char* verb, const Status& status) {
  PrintError("consac {}: {}\n", verb, status.message());
  return ExitCode(status);
}

const std::string& ProgramPath() {
  return program_path;
}

const std::atomic<bool>& StopSignal() {
  Catch(OnStopSignal, OnHangUp);
  return stop_flag;
}

void EndAtSignals() {
  Catch(OnEndSignal, OnEndSignal);
}

bool Stopped() {
  return stop_flag.load(std::memory_order_relaxed);
}

namespace {

/// CLI11's message without its help text, on one line.
int UsageError(const std::string& verb, const CLI::ParseError& error) {
  std::string line = error.what();
  const std::size_t twice = line.find(": At Most 1 required but received");  // CLI11's words
  if (twice != std::string::npos) line = line.substr(0, twice) + " is given more than once";
  for (char& c : line) c = c == '\n' ? ' ' : c;
  PrintError("consac{}: {} (consac{} --help lists what there is)\n", verb, line, verb);
  return 2;
}

int UnknownVerb(std::string_view name) {
  std::vector<std::string_view> known;
  for (const Verb& verb : kVerbs) known.emplace_back(verb.name);
  PrintError("consac: unknown verb {}{}\n", Quote(name), Suggestion(name, known));
  return 2;
}

/// Libraries throw where memory runs out; nothing else is expected to.
int Perform(const std::string& verb, const Action& action) {
  const Result<int> code = run::Guarded([&]() -> Result<int> { return action(); });
  return code.ok() ? *code : Fail(verb.c_str(), code.status());
}

/// The exit code once everything is written: a disk that was full is an error, a reader that left is not.
int AfterOutput(const std::string& verb, int code) {
  const bool written = FlushOutput();
  if (!written && Stopped()) std::_Exit(code);  // exit() would wait for the reader
  if (written || OutputMayBeLost() || code != 0) return code;
  const Status why(StatusCode::kResourceExhausted, std::string("standard output could not be written: ") +
                                                       std::strerror(run::OutputError()) +
                                                       "; let it go where there is room");
  PrintError("consac{}: {}\n", verb, why.message());
  return ExitCode(why);
}

/// What `--version` says, for a report of a fault: also the commit, and what the processor can do.
std::string VersionText() {
  std::string text = std::string("consac ") + kVersion + "\ncommit " + Commit() + "\ninstruction sets";
  for (const std::string_view name : nn::InstructionSets()) text.append(" ").append(name);
  return text + " (the first is used)";
}

/// " train", for the beginning of a message; "" where no verb was given.
std::string VerbOf(int argc, char** argv) {
  return argc > 1 && argv[1][0] != '-' ? " " + std::string(argv[1]) : "";
}

int Main(int argc, char** argv) {
  CLI::App app("Reinforcement learning for Unreal Engine, and any other engine.", "consac");
  app.set_version_flag("--version", VersionText());
  app.require_subcommand(1);
  app.allow_windows_style_options(false);  // a path may begin with a slash there too
  std::vector<std::pair<CLI::App*, Action>> actions;
  for (const Verb& verb : kVerbs) {
    CLI::App* sub = app.add_subcommand(verb.name, verb.summary);
    sub->footer(std::string("Examples:\n") + verb.examples + "\n\nExit codes: " + kExitCodes);
    actions.emplace_back(sub, verb.add(*sub));
  }
  const auto is_verb = [&](const auto& entry) { return entry.first->get_name() == argv[1]; };
  if (argc > 1 && argv[1][0] != '-' && std::none_of(actions.begin(), actions.end(), is_verb))
    return UnknownVerb(argv[1]);
  const std::string verb = VerbOf(argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& done) {
    std::ostringstream help;
    const int code = app.exit(done, help, help);
    Write(stdout, help.str());
    return code;
  } catch (const CLI::ParseError& error) {
    return UsageError(verb, error);
  }
  for (const auto& [sub, action] : actions) {
    if (sub->parsed()) return Perform(sub->get_name(), action);
  }
  return 2;
}

}  // namespace
}  // namespace consac::cli

int main(int argc, char** argv) {
  const bool stack = consac::cli::TakeStack();
  consac::cli::PrepareOutput();
  if (!stack) {
    consac::cli::PrintError("consac: the stack may have less than {} KiB; allow it more (ulimit -s)\n",
                            consac::cli::kLeastStack >> 10);
    return consac::cli::ExitCode({consac::StatusCode::kResourceExhausted, "stack"});
  }
  consac::cli::LogToStandardError();
  consac::cli::LimitMemory();
  consac::cli::AllowManyFiles();
  consac::cli::program_path = argc > 0 ? argv[0] : "consac";
  const int code = consac::cli::Main(argc, argv);
  return consac::cli::AfterOutput(consac::cli::VerbOf(argc, argv), code);
}
