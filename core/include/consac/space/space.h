#pragma once
// What can be observed or done: Gymnasium's spaces as values. A Space says what is legal; a Layout (layout.h) says
// where each number lies in memory. Checked at creation, so that nothing later has to.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/base/dtype.h"
#include "consac/base/rng.h"
#include "consac/base/status.h"

namespace consac {

/// Which kind of space.
enum class SpaceKind : std::uint8_t { kDiscrete, kBox, kMultiDiscrete, kMultiBinary, kDict, kTuple };

/// A set of legal values. A value type; Dict and Tuple hold their children. Copies share a Box's bounds: those of an
/// image are large, and a space is kept in many places. Source: Gymnasium's `spaces`.
class Space {
 public:
  /// {start, ..., start + n - 1}; n >= 1.
  static Result<Space> Discrete(std::int64_t n, std::int64_t start = 0);
  /// Numbers between `low` and `high` ([product(shape)] each, row-major; -inf and inf mean unbounded), low <= high.
  static Result<Space> Box(std::vector<double> low, std::vector<double> high, std::vector<std::int64_t> shape,
                           DType dtype = DType::kF32);
  /// The same bounds for every element.
  static Result<Space> Box(double low, double high, std::vector<std::int64_t> shape, DType dtype = DType::kF32);
  /// One Discrete(nvec[i]) per element; every nvec[i] >= 1.
  static Result<Space> MultiDiscrete(std::vector<std::int64_t> nvec);
  /// n bits; n >= 1.
  static Result<Space> MultiBinary(std::int64_t n);
  /// Named children; stored and flattened sorted by name, as Gymnasium does. Names are unique and not empty.
  static Result<Space> Dict(std::vector<std::pair<std::string, Space>> children);
  /// Children in order, named "0", "1", ...
  static Result<Space> Tuple(std::vector<Space> children);

  /// Discrete(1); a placeholder until assigned.
  Space() = default;

  /// Which kind.
  SpaceKind kind() const { return kind_; }
  /// Discrete: number of choices.
  std::int64_t n() const { return n_; }
  /// Discrete: the first choice.
  std::int64_t start() const { return start_; }
  /// Box: the array's shape; MultiDiscrete and MultiBinary: [count]; Discrete: [].
  const std::vector<std::int64_t>& shape() const { return shape_; }
  /// Element type of a leaf: Box's own, Discrete and MultiDiscrete kI64, MultiBinary kI8 (Gymnasium's).
  DType dtype() const { return dtype_; }
  /// Box: lower bounds, [count].
  const std::vector<double>& low() const { return bounds_ != nullptr ? bounds_->low : kNoBounds; }
  /// Box: upper bounds, [count].
  const std::vector<double>& high() const { return bounds_ != nullptr ? bounds_->high : kNoBounds; }
  /// MultiDiscrete: choices of each element.
  const std::vector<std::int64_t>& nvec() const { return nvec_; }
  /// Dict and Tuple: the children with their names, in flattening order.
  const std::vector<std::pair<std::string, Space>>& children() const { return children_; }

  /// Numbers in the flattened form: one-hot for Discrete and MultiDiscrete, elements for Box, bits for MultiBinary,
  /// the sum of children otherwise. Source: gymnasium.spaces.utils.flatdim.
  std::int64_t flat_size() const;
  /// "Box([0, 0], [40, 40], (2,), float32)", for messages.
  std::string ToString() const;
  /// Same kind, shape, type and bounds throughout.
  friend bool operator==(const Space& a, const Space& b);

 private:
  /// Of every element, [count] each.
  struct BoxBounds {
    std::vector<double> low, high;
  };
  static const std::vector<double> kNoBounds;  ///< of everything that is no Box

  SpaceKind kind_ = SpaceKind::kDiscrete;
  DType dtype_ = DType::kI64;
  std::int64_t n_ = 1;
  std::int64_t start_ = 0;
  std::vector<std::int64_t> shape_;
  std::shared_ptr<const BoxBounds> bounds_;  // of a Box
  std::vector<std::int64_t> nvec_;
  std::vector<std::pair<std::string, Space>> children_;
};

}  // namespace consac
