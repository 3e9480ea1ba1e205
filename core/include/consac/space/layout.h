#pragma once
// Where each number of a space lies in a row of a batch: named leaves with offset, shape and type, never an anonymous
// float array. Used by worlds (to write), learners (to read), the protocols and the model file (to describe).

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/space/space.h"

namespace consac {

/// One leaf of a space tree.
struct Leaf {
  std::string name;                 ///< path in the tree, "arm/joints"; "" when the space itself is the leaf
  Space space;                      ///< the leaf's own space (never Dict or Tuple)
  DType dtype = DType::kF32;        ///< type in the row: Box's own, Discrete and MultiDiscrete kI32, MultiBinary kU8
  std::int64_t count = 0;           ///< elements in the row: Discrete 1, MultiDiscrete nvec.size(), ...
  std::size_t offset = 0;           ///< bytes from the row's start, aligned to the type
  std::int64_t feature_offset = 0;  ///< where the flattened form begins in a row of features
  std::int64_t feature_count = 0;   ///< numbers in the flattened form: one-hot for discrete leaves
  std::int64_t mask_offset = 0;     ///< where the leaf's legal-action mask begins, in bytes
  std::int64_t mask_count = 0;      ///< mask bytes: n for Discrete, sum(nvec), 2 per bit for MultiBinary, 0 for Box
};

/// The memory form of a space. Row types: Discrete values are stored as int32 *including* `start`.
struct Layout {
  std::vector<Leaf> leaves;        ///< in flattening order
  std::size_t row_bytes = 0;       ///< bytes of one row, padded so that rows stay aligned
  std::int64_t feature_count = 0;  ///< network inputs of one row (flat_size of the space)
  std::int64_t mask_bytes = 0;     ///< bytes of one row of legal-action masks; 0 when nothing can be masked
  bool plain_floats = false;       ///< every leaf is a float32 Box: a row *is* its features

  /// The layout of `space`.
  static Layout Of(const Space& space);
};

/// Where observations of a world with goals say which was reached and which is wanted, as Gymnasium's do.
inline constexpr std::string_view kAchievedGoal = "achieved_goal", kDesiredGoal = "desired_goal";
/// Where `leaf` lies below `part` of its tree: "/x" of "part/x", "" of `part` itself; null: elsewhere. A view of its
/// name.
std::optional<std::string_view> PathBelow(std::string_view part, const Leaf& leaf);
/// The leaf that lies at `rest` below `part`, in PathBelow's words; null: there is none. Cost: all leaves.
const Leaf* FindLeafBelow(const Layout& layout, std::string_view part, std::string_view rest);
/// Writes the flattened, one-hot form of `rows` rows as network input, in Gymnasium's order.
/// `data` is [rows, row_bytes], `features` is [rows, feature_count].
void EncodeFeatures(const Layout& layout, const std::byte* data, std::int64_t rows, float* features);
/// Writes one uniformly drawn legal value (unbounded Box sides as Gymnasium: normal or exponential) into a row.
void SampleRow(const Layout& layout, Rng& rng, std::byte* row);
/// Ok when the row lies in the space; otherwise names the leaf, the value and the bound.
Status CheckRow(const Layout& layout, const std::byte* row);
/// Bytes of the mask of each choice that an action makes, in the order of the mask: n of a Discrete, one of `nvec`, 2
/// of a bit. Empty where nothing can be masked.
std::vector<std::int64_t> MaskedChoices(const Layout& action);
/// The first choice, of those that MaskedChoices lists, for which `mask` (one row) leaves nothing legal; -1: each has
/// something.
std::int64_t ChoiceWithNothingLegal(std::span<const std::int64_t> choices, const std::uint8_t* mask);
/// Moves every Box element into its bounds.
void ClipRow(const Layout& layout, std::byte* row);
/// Smallest and largest legal value of an element; infinite where a box is open.
std::pair<double, double> ElementBounds(const Leaf& leaf, std::int64_t index);
/// Element `index` of a leaf in a row, as a double.
double ReadElement(const Leaf& leaf, const std::byte* row, std::int64_t index);
/// Writes element `index` of a leaf in a row. An integer type takes the nearest value that it has, for NaN its lowest.
void WriteElement(const Leaf& leaf, std::byte* row, std::int64_t index, double value);

}  // namespace consac
