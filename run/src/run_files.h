#pragma once
// Which files in a run's folder are the run's, by name: whatever else somebody put there is theirs. Layout:
// docs/runs.md. Private to run.

#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"

namespace consac::run {

/// By which a folder is known for a run's.
inline constexpr std::string_view kConfigFile = "config.yaml";
/// Whoever writes to the folder holds it.
inline constexpr std::string_view kLockFile = ".lock";

/// Names in a folder; none where there is no such folder. An error where it cannot be looked into.
Result<std::vector<std::string>> NamesIn(const std::string& folder);
/// The same; none where it cannot be looked into either.
std::vector<std::string> FilesIn(const std::string& folder);

/// A table, a log or a picture of a run, or its configuration: "progress.csv", "hunter.monitor.csv".
bool IsRunsFile(std::string_view name);
/// "step_000000000100.consac".
bool IsCheckpoint(std::string_view name);
/// "learner.replay.rows_000000000000_000000004096.rows".
bool IsSegment(std::string_view name);
/// What a process that was killed while it wrote a run's file has left: WriteFileAtomically's name.
bool IsHalfWritten(std::string_view name);
/// All of those in the folder go; only under the run's lock.
void RemoveHalfWritten(const std::string& folder);

/// Paths, relative to the folder, of all that a run has written there: "monitor.csv", "checkpoints/step_....consac",
/// "best/model.consac", "tensorboard/PPO2_1/events.out.tfevents...". What is behind a `best` that is a link is not the
/// run's. An error where a folder or a model cannot be looked into.
Result<std::vector<std::string>> FilesOfRun(const std::string& path);

/// Whether there is a run's config.yaml in a folder; an error where nobody may look.
Result<bool> IsRun(const std::string& path);
/// Whether something is there, be it a link to nothing.
bool IsThere(const std::string& path);
/// Whether it is a folder, or a link to one.
bool IsFolder(const std::string& path);
/// Whether it is a link.
bool IsLink(const std::string& path);
/// Removes a file or an empty folder, if that can be done.
void Remove(const std::string& path);

/// Refuses what is there in the place of a file of the run and is no regular file: whoever opens a pipe waits for ever,
/// a device keeps nothing. kDataLoss.
Status CheckRegular(const std::string& file);
/// The same, and what is somebody else's too: a link, and a file that has another name. kDataLoss.
Status CheckOwnFile(const std::string& file);
/// CheckOwnFile of all that a run goes on with: tables, logs, pictures, its configuration, its lock and its models.
Status CheckFilesToGoOnWith(const std::string& path);

}  // namespace consac::run
