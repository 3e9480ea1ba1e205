#pragma once
// What the verbs of the program share: the table's row, exit codes, how a failure is told, the stop signal.

#include <CLI/CLI.hpp>
#include <atomic>
#include <functional>
#include <string>

#include "consac/base/status.h"

namespace consac::cli {

/// A verb's work, run once its options are parsed; returns the exit code.
using Action = std::function<int()>;

/// One row of the table of verbs (main.cpp).
struct Verb {
  const char* name;              ///< "train"
  const char* summary;           ///< one line for the overview
  const char* examples;          ///< lines for --help
  Action (*add)(CLI::App& app);  ///< declares the options
};

// One file per verb.
Action AddDemo(CLI::App& app);
Action AddServe(CLI::App& app);
Action AddTrain(CLI::App& app);
Action AddEval(CLI::App& app);
Action AddPlay(CLI::App& app);
Action AddList(CLI::App& app);
Action AddInspect(CLI::App& app);
Action AddTwin(CLI::App& app);
Action AddBench(CLI::App& app);
Action AddDoctor(CLI::App& app);

/// For --help; docs/program.md says more.
inline constexpr const char* kExitCodes =
    "0 ok, 1 internal, 2 usage, 3 peer, 6 file, disk or memory, 7 not a finite number, 130 interrupted";
/// What becomes of a failure; kExitCodes says it in words.
int ExitCode(const Status& status);
/// Prints "consac VERB: message" on stderr and returns the exit code.
int Fail(const char* verb, const Status& status);
/// The program as it was called, for advice that can be typed again: "build/release/cli/consac".
const std::string& ProgramPath();
/// Catches Ctrl-C, SIGTERM and the end of the terminal: any of them sets the flag; Ctrl-C or SIGTERM once more ends the
/// program at once.
const std::atomic<bool>& StopSignal();
/// For verbs that leave nothing half done: Ctrl-C, SIGTERM and the end of the terminal end the program at once, with
/// exit code 130.
void EndAtSignals();
/// Whether that flag is set.
bool Stopped();

}  // namespace consac::cli
