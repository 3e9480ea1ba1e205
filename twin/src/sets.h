#pragma once
// Sets that are joined. Private to twin.

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace consac::twin {

/// Of 0 to count - 1, each by itself at first. Source: union-find with path halving, Tarjan and van Leeuwen 1984.
class Sets {
 public:
  explicit Sets(std::size_t count) : above_(count) { std::iota(above_.begin(), above_.end(), 0); }
  /// Who stands for the set that `each` is in.
  std::int32_t Of(std::int32_t each) {
    while (above_[static_cast<std::size_t>(each)] != each) {
      std::int32_t& above = above_[static_cast<std::size_t>(each)];
      above = above_[static_cast<std::size_t>(above)];
      each = above;
    }
    return each;
  }
  /// False where they were one already. The smaller number stands for both.
  bool Join(std::int32_t a, std::int32_t b) {
    a = Of(a), b = Of(b);
    if (a != b) above_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    return a != b;
  }

 private:
  std::vector<std::int32_t> above_;
};

}  // namespace consac::twin
