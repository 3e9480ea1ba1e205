#pragma once
// What the rows of `consac bench` are made of; those that train are in bench_training.cpp.

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "consac/run/training.h"

namespace consac::cli {

/// One figure.
struct Figure {
  double value = 0.0;
  std::string unit;
  std::string note;  ///< what it means beside the limit
};

/// What rows share.
struct BenchContext {
  double peak = 0.0;  ///< FLOP/s of one core
  int repeats = 3;    ///< of a training; the median counts
};

/// The median of so many calls of `measure`.
template <class Measure>
double Median(int repeats, Measure&& measure) {
  std::vector<double> values;
  for (int i = 0; i < repeats; ++i) values.push_back(measure());
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// A whole training.
struct BenchJob {
  const char* world;
  const char* algorithm;
  std::int32_t envs;
  std::int64_t steps;
  std::vector<std::pair<std::string, std::string>> settings;  ///< hyperparameters
};

/// It as a run that says and keeps nothing.
run::RunConfig ConfigOf(const BenchJob& job);
/// Wall seconds of its steps and learning; NaN where it failed.
double TrainSeconds(const run::RunConfig& config);

Figure CartPoleDefaults(const BenchContext& context);
Figure CartPoleEight(const BenchContext& context);
Figure CartPoleA2c(const BenchContext& context);
Figure CartPoleA2cEight(const BenchContext& context);
Figure CartPoleDqn(const BenchContext& context);
Figure CartPoleDqnWide(const BenchContext& context);
Figure PendulumPpo(const BenchContext& context);
Figure PendulumSac(const BenchContext& context);
Figure PendulumTd3(const BenchContext& context);
Figure PendulumSacWide(const BenchContext& context);

}  // namespace consac::cli
