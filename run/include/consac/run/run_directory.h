#pragma once
// A run's folder, runs/NAME: who may write to it, and its checkpoints. Layout: docs/runs.md.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/status.h"

namespace consac::run {

class RowSegments;

/// What to do with a run's name that exists.
enum class ExistingRun : std::uint8_t { kRefuse, kResume, kOverwrite };

/// Ends what a process has left that was killed while it overwrote the run: the old one is put back, or goes. To be
/// called where a run begins, before anything of it is looked at. kFailedPrecondition when another process trains it.
Status FinishOverwriting(const std::string& directory, const std::string& name);
/// What Open would say of the name and of what is there already, before anything is made or an engine is disturbed.
/// Touches nothing.
Status CheckRunName(const std::string& directory, const std::string& name, ExistingRun existing);

/// An opened run folder, locked against a second writer until destroyed.
class RunDirectory {
 public:
  /// Makes or opens directory/name. A run that is overwritten is set aside: RemoveReplaced removes it, and without that
  /// it is put back. kAlreadyExists names --resume and --force, or says that the folder is no run's and is left alone;
  /// kNotFound when there is nothing to resume; kFailedPrecondition when another process trains it; kDataLoss and
  /// kResourceExhausted where a file cannot be set aside, which leaves all of them as they were.
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
  /// Writes a file of the run as WriteFileAtomically: into the folder that was opened, wherever it is moved meanwhile.
  /// Errors of CheckOurs too, with nothing written.
  Status Write(const std::string& file, std::span<const std::byte> bytes) const;
  /// Writes checkpoints/step_<steps>.consac and deletes all but the latest `keep`. `description` is JSON.
  Status SaveCheckpoint(std::int64_t steps, const StateMap& state, const std::string& description,
                        std::int64_t keep) const;
  /// Whether an overwritten run is set aside.
  bool replaces() const { return replaces_; }
  /// Leaves the overwritten run's model of that file name where it was, until this run's next one is saved.
  void KeepReplacedModel(const std::string& name) const;
  /// This run is saved: the overwritten one goes. An error where that cannot be said on disk.
  Status RemoveReplaced();
  /// This run cannot be: its files go and the overwritten one's are put back. No file of it may be open. An error says
  /// where they are; the next Open tries again.
  Status PutBack();
  /// The segments that checkpoints name; what was written there belongs to the next SaveCheckpoint.
  RowSegments& segments() const { return *segments_; }
  /// The newest checkpoint that is whole, with its segments; damaged ones are passed over with a warning. kNotFound
  /// when there is none, kDataLoss when there are some and none is whole, or one cannot be read: it may well be whole.
  /// One of more than `most_bytes`, or than there is memory for, is not read: kResourceExhausted.
  Result<StateMap> LoadCheckpoint(std::size_t most_bytes = std::size_t{1} << 31) const;

 private:
  RunDirectory(std::string path, int lock);
  Status CheckCheckpointsReadable() const;
  std::vector<std::string> Checkpoints() const;  // names, by steps
  void RemoveCheckpoints(const std::string& name, std::int64_t keep) const;

  std::string path_;
  int lock_;
  std::unique_ptr<RowSegments> segments_;
  bool replaces_ = false;
};

}  // namespace consac::run
