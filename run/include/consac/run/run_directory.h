#pragma once
// A run's folder, runs/NAME: who may write to it, and its checkpoints. Layout: docs/runs.md.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/status.h"

namespace consac::run {

class RowSegments;

/// What to do with a run's name that exists.
enum class ExistingRun : std::uint8_t { kRefuse, kResume, kOverwrite };

/// What Open would say of the name and of what is there already, before anything is made or an engine is disturbed.
Status CheckRunName(const std::string& directory, const std::string& name, ExistingRun existing);

/// An opened run folder, locked against a second writer until destroyed.
class RunDirectory {
 public:
  /// Makes or opens directory/name. Of a run that is overwritten the models stay until this one has its own
  /// (RemoveOldModels), and all of it where the new one could not be written (kDataLoss, kResourceExhausted: a file or
  /// folder that cannot be replaced, a full disk, too few descriptors). kAlreadyExists names --resume and --force, or
  /// says that the folder is no run's and is left alone; kNotFound when there is nothing to resume; kFailedPrecondition
  /// when another process trains it.
  static Result<std::unique_ptr<RunDirectory>> Open(const std::string& directory, const std::string& name,
                                                    ExistingRun existing);
  ~RunDirectory();
  RunDirectory(const RunDirectory&) = delete;
  RunDirectory& operator=(const RunDirectory&) = delete;

  /// The folder.
  const std::string& path() const { return path_; }
  /// A file in it.
  std::string File(const std::string& name) const { return path_ + "/" + name; }
  /// Whether the folder is still the one that was opened: kDataLoss when it was deleted meanwhile, or is another run's
  /// now. Then nothing may be written to it any more.
  Status CheckOurs() const;
  /// Writes checkpoints/step_<steps>.consac and deletes all but the latest `keep`. `description` is JSON.
  Status SaveCheckpoint(std::int64_t steps, const StateMap& state, const std::string& description,
                        std::int64_t keep) const;
  /// Tells that the file at `path` is this run's model now.
  void KeepModel(const std::string& path);
  /// Deletes the models of the run that was overwritten, but for those that KeepModel named.
  void RemoveOldModels();
  /// Whether there are any of those.
  bool has_old_models() const { return !old_models_.empty(); }
  /// The segments that checkpoints name; what was written there belongs to the next SaveCheckpoint.
  RowSegments& segments() const { return *segments_; }
  /// The newest checkpoint that is whole, with its segments; damaged ones are passed over with a warning. kNotFound
  /// when there is none, kDataLoss when there are some and none is whole, or one cannot be read: it may well be whole.
  Result<StateMap> LoadCheckpoint() const;

 private:
  RunDirectory(std::string path, int lock);
  Status CheckCheckpointsReadable() const;
  std::vector<std::string> Checkpoints() const;

  std::string path_;
  int lock_;
  std::unique_ptr<RowSegments> segments_;
  std::vector<std::string> old_models_;  // paths, of the run that was overwritten
};

}  // namespace consac::run
