#pragma once
// Means of the numbers that a game notes, from one telling to the next. Used by runs for their tables and by engines
// for lines in their logs.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace consac {

/// What a game has noted, by name.
class NotedMeans {
 public:
  static constexpr std::size_t kMostNames = 256;  ///< more are left out

  /// Adds a finite number; false where it is of a further name that there is no room for.
  bool Add(std::string_view name, double value) {
    auto found = sums_.find(name);
    if (found == sums_.end()) {
      if (sums_.size() >= kMostNames) return false;
      found = sums_.emplace(std::string(name), Sum()).first;
    }
    found->second.sum += value;
    ++found->second.count;
    return true;
  }
  /// Calls `tell(name, mean)` for each name of which anything was noted since the call before, in their order. A name
  /// lives as long as this does.
  template <class Tell>
  void TellEach(const Tell& tell) {
    for (auto& [name, sum] : sums_) {
      if (sum.count == 0) continue;
      tell(name, sum.sum / static_cast<double>(sum.count));
      sum = Sum();
    }
  }

 private:
  struct Sum {
    double sum = 0.0;
    std::int64_t count = 0;
  };
  std::map<std::string, Sum, std::less<>> sums_;
};

}  // namespace consac
