#pragma once
// What somebody else's words may make us allocate: one account per message or file, charged before the memory is
// taken. Used by the readers of SPEC and of model files; the amounts are in docs/faults.md, "Budgets".

#include <cstdint>
#include <string_view>

#include "consac/base/status.h"

namespace consac {

/// Bytes that may still be taken.
class MemoryBudget {
 public:
  /// An account of `bytes`.
  explicit MemoryBudget(std::uint64_t bytes) : whole_(bytes), left_(bytes) {}
  /// Takes `count` times `each` bytes; kResourceExhausted, and nothing is taken, where that is more than is left.
  /// `what` begins the error: "a box".
  Status Take(std::string_view what, std::uint64_t count, std::uint64_t each);
  /// Bytes that are left.
  std::uint64_t left() const { return left_; }

 private:
  std::uint64_t whole_, left_;
};

}  // namespace consac
