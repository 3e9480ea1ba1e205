#pragma once
// What the rows of `consac bench` are made of, for the table in bench.cpp and those of its rows that train
// (bench_training.cpp).

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "consac/run/training.h"

namespace consac::cli {

/// One figure.
struct Figure {
  double value = 0.0;
  std::string unit;
  std::string note;      ///< what it means beside the limit
  double seconds = 0.0;  ///< of a whole training; 0: the row is none
};

/// What rows share.
struct BenchContext {
  double peak = 0.0;            ///< FLOP/s of one core
  int repeats = 3;              ///< of a training; the median counts
  bool processor_time = false;  ///< trainings by this process's CPU seconds, so that other jobs do not count
};

/// One row of the table.
struct BenchRow {
  const char* name;
  const char* what;
  Figure (*measure)(const BenchContext& context);
};

/// The rows that train.
std::span<const BenchRow> TrainingRows();

/// The median of so many calls of `measure`; the first NaN, where one fails.
template <class Measure>
double Median(int repeats, Measure&& measure) {
  std::vector<double> values;
  for (int i = 0; i < repeats; ++i) {
    values.push_back(measure());
    if (std::isnan(values.back())) return values.back();
  }
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

/// It as a run that says and keeps nothing, in a folder of this process.
run::RunConfig ConfigOf(const BenchJob& job);
/// Seconds from its first step to its last, whose folder it removes; NaN where it failed, of which it says why.
double TrainSeconds(const BenchContext& context, const run::RunConfig& config);

}  // namespace consac::cli
