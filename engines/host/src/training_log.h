#pragma once
// What a training inside writes down: progress.csv and TensorBoard's events, with the keys and tags of a run of the
// program (docs/logs.md). Private to host.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "consac/env/vector_env.h"
#include "consac/learn/log/game_statistics.h"
#include "consac/learn/log/progress_csv.h"
#include "consac/learn/log/tensorboard.h"
#include "consac/learn/log/update_row.h"

namespace consac::host {

/// Both files of one training, in a folder of their own. A failed write is a warning in the log, once; what is written
/// later is there. One thread.
class TrainingLog {
 public:
  /// Makes the folder `folder`/PPO2_1, or the next number that is free: no training is written over.
  /// `algorithm` names it.
  static Result<std::unique_ptr<TrainingLog>> Open(const std::string& folder, std::string algorithm,
                                                   learn::LogStyle style, const EnvSpec& spec);

  ~TrainingLog();
  TrainingLog(const TrainingLog&) = delete;
  TrainingLog& operator=(const TrainingLog&) = delete;
  /// What the game has noted: the mean since the report before stands in each as "game/NAME".
  void Note(std::span<const Statistic> noted);
  /// What came of a step of agents of behaviour `b`, `steps` steps of single agents into the training.
  void Add(std::size_t b, const Batch& outcome, std::int64_t steps);
  /// What the learner of behaviour `b` has reported since it was looked at last, if anything.
  void Look(std::size_t b, const learn::Learner& learner, std::int64_t steps);
  /// Puts what was seen so into the files, as one row, if anything was.
  void Write();

 private:
  /// What is told of one behaviour.
  struct Told {
    learn::UpdateRow numbers;
    learn::EpisodeMeans episodes;
    std::vector<double> rewards;        // [slots] of the episode under way
    std::vector<std::int64_t> lengths;  // [slots] likewise
    std::int64_t reports = 0;           // of the learner, that were looked at
  };
  TrainingLog(learn::LogStyle style, const EnvSpec& spec);
  void SayFailure();

  learn::LogStyle style_;
  double began_;
  std::vector<Told> behaviours_;
  learn::GameStatistics game_;
  std::unique_ptr<learn::ProgressCsv> csv_;
  std::unique_ptr<learn::EventWriter> events_;
  learn::Row row_;  // what is to be written; empty between
  bool said_ = false, said_names_ = false;
};

}  // namespace consac::host
