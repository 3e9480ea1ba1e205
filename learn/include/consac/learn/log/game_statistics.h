#pragma once
// Means of the numbers that a game notes, from one update to the next, as cells of a training's log.

#include <algorithm>
#include <map>
#include <span>
#include <string>

#include "consac/env/noted_means.h"
#include "consac/env/vector_env.h"
#include "consac/learn/log/row.h"

namespace consac::learn {

/// What a game has noted, by name.
class GameStatistics {
 public:
  static constexpr std::size_t kMostNames = NotedMeans::kMostNames;

  /// Adds numbers. The first name that there is no room for; "" where all were taken.
  std::string Add(std::span<const Statistic> noted) {
    std::string left_out;
    for (const Statistic& statistic : noted) {
      if (!means_.Add(statistic.name, statistic.value) && left_out.empty()) left_out = statistic.name;
    }
    return left_out;
  }
  /// The mean of each of which anything was noted since the call before; those that were told then and are silent now
  /// stand no more in row().
  void Tell() {
    row_.clear();
    means_.TellEach([this](const std::string& name, double mean) {
      std::string& key = keys_[name];
      if (key.empty()) {
        key = "game/" + name;
        std::replace(key.begin(), key.end(), ',', ';');  // of a CSV file
      }
      row_.push_back({key, mean, CellKind::kDouble});
    });
  }
  /// As of the latest Tell.
  const Row& row() const { return row_; }

 private:
  NotedMeans means_;
  std::map<std::string, std::string> keys_;  // by name
  Row row_;
};

}  // namespace consac::learn
