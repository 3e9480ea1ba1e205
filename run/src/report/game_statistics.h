#pragma once
// Means of the numbers that a game notes, from one update to the next.

#include <algorithm>
#include <map>
#include <span>
#include <string>

#include "consac/env/vector_env.h"
#include "report/row.h"

namespace consac::run {

/// What a game has noted, by name.
class GameStatistics {
 public:
  static constexpr std::size_t kMostNames = 256;

  /// Adds numbers. The first name that there is no room for; "" where all were taken.
  std::string Add(std::span<const Statistic> noted) {
    std::string left_out;
    for (const Statistic& statistic : noted) {
      auto found = sums_.find(statistic.name);
      if (found == sums_.end()) {
        if (sums_.size() >= kMostNames) {
          if (left_out.empty()) left_out = statistic.name;
          continue;
        }
        std::string key = "game/" + statistic.name;
        std::replace(key.begin(), key.end(), ',', ';');  // of a CSV file
        found = sums_.emplace(statistic.name, Sum{std::move(key)}).first;
      }
      found->second.sum += statistic.value;
      ++found->second.count;
    }
    return left_out;
  }
  /// The mean of each of which anything was noted since the call before; those that were told then and are silent now
  /// stand no more in row().
  void Tell() {
    row_.clear();
    for (auto& [name, sum] : sums_) {
      if (sum.count == 0) continue;
      row_.push_back({sum.key, sum.sum / static_cast<double>(sum.count), CellKind::kDouble});
      sum.sum = 0.0;
      sum.count = 0;
    }
  }
  /// As of the latest Tell.
  const Row& row() const { return row_; }

 private:
  struct Sum {
    std::string key;
    double sum = 0.0;
    std::int64_t count = 0;
  };
  std::map<std::string, Sum, std::less<>> sums_;
  Row row_;
};

}  // namespace consac::run
