#pragma once
// What is learned for one behaviour, and what is known of it besides. Private to run.

#include <memory>

#include "consac/learn/algo/learner.h"
#include "data_watch.h"
#include "episode_sums.h"

namespace consac::run {

/// One behaviour's learner. Slots are counted over all worlds of the run.
struct Trainee {
  std::unique_ptr<learn::Learner> learner;  // or a player that does not learn
  EpisodeSums episodes;
  DataWatch watch;
  bool frozen = false;                              // it does not learn
  std::int64_t reports = 0;                         // the learner's, when it was last looked at
  std::int64_t saved_updates = 0, saved_steps = 0;  // and when it was last saved
};

}  // namespace consac::run
