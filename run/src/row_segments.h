#pragma once
// State too large to copy (a replay) on disk: rows in segments that are appended to and never change, beside the
// checkpoints that name them. A checkpoint writes what has come since the last one, straight from where it lies; no
// copy of the whole is ever made. Layout: docs/runs.md. Private to run.

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/file.h"

namespace consac::run {

/// Ends the names of segments.
inline constexpr std::string_view kSegmentEnd = ".rows";

/// One file of rows [begin, end).
struct Segment {
  std::int64_t begin = 0, end = 0;
  std::uint64_t digest = 0;  ///< of its contents: a file of another time does not pass for it
  friend bool operator==(const Segment&, const Segment&) = default;
};

/// The segments of a run. A checkpoint names those that it needs; a file that none of the latest checkpoints needs
/// goes.
class RowSegments {
 public:
  /// In the folder of the checkpoints, which is written to as long as `check` says so. What is there already is kept
  /// until `keep` checkpoints have followed.
  RowSegments(std::string folder, FolderCheck check) : folder_(std::move(folder)), check_(std::move(check)) {}

  /// Writes what of `rows` is new since the last time and lists all segments that hold some of it.
  Status Write(const std::string& path, StateRows& rows, std::vector<Segment>* all);
  /// Reads [rows.first_row(), end) back, after BeginRows.
  Status Read(const std::string& path, std::int64_t end, StateRows& rows, const std::vector<Segment>& all);
  /// Ok when every segment that `state` names is there and whole.
  Status Check(const StateMap& state) const;
  /// A checkpoint that names what was written or read since the last call is on disk. RemoveUnneeded is to follow.
  void Committed();
  /// Deletes what none of the latest `keep` checkpoints, 1 or more, needs; the last is `checkpoint`, a file's name,
  /// which may take the place of the one before it.
  void RemoveUnneeded(const std::string& checkpoint, std::int64_t keep);
  /// No checkpoint names what was written since the last one, nor will: deletes it, and the next one writes it anew.
  /// Nothing where all that was written is committed.
  void Abandon();

 private:
  using SegmentsByPath = std::map<std::string, std::vector<Segment>>;
  std::string FileOf(const std::string& path, const Segment& segment) const;
  std::set<std::string> FilesOf(const SegmentsByPath& segments) const;
  std::set<std::string> FilesOfHeld() const;
  void Remove(const std::set<std::string>& files) const;

  std::string folder_;
  FolderCheck check_;
  SegmentsByPath segments_;        // what the next checkpoint names
  SegmentsByPath committed_;       // what the latest one on disk names
  std::set<std::string> written_;  // since then
  struct Held {
    std::string checkpoint;
    std::set<std::string> files;
  };
  std::deque<Held> held_;          // what each of the latest checkpoints of this session needs
  std::set<std::string> earlier_;  // what was there already, until no earlier checkpoint is left
  std::int64_t checkpoints_ = 0;   // of this session
  bool looked_ = false;            // at what was there already
};

/// Collects a state for a checkpoint; rows go into segments, and away again if there is no SaveCheckpoint before this
/// ends, or it fails.
class CheckpointWriter final : public StateWriter {
 public:
  /// Into `segments`.
  explicit CheckpointWriter(RowSegments& segments) : segments_(segments) {}
  ~CheckpointWriter() override;
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

 protected:
  void OnRows(const std::string& path, StateRows& rows) override;

 private:
  RowSegments& segments_;
};

/// Reads a checkpoint back.
class CheckpointReader final : public StateReader {
 public:
  /// From `fields` and `segments`.
  CheckpointReader(const StateMap& fields, RowSegments& segments) : StateReader(fields), segments_(segments) {}

 protected:
  void OnRows(const std::string& path, StateRows& rows) override;

 private:
  RowSegments& segments_;
};

}  // namespace consac::run
