#include "consac/space/space.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "consac/base/names.h"
#include "consac/base/text.h"

namespace consac {
namespace {

// Larger spaces are mistakes, and would overflow offsets.
constexpr std::int64_t kLargestElementCount = std::int64_t{1} << 28;

Status SpaceError(std::string message) {
  return {StatusCode::kInvalidArgument, std::move(message)};
}

Result<std::int64_t> ElementCount(const std::vector<std::int64_t>& shape) {
  std::int64_t count = 1;
  for (const std::int64_t size : shape) {
    if (size < 1 || count > kLargestElementCount / size) {
      return SpaceError("a Box has a dimension of size " + std::to_string(size) +
                        "; sizes are at least 1 and their product at most 2^28");
    }
    count *= size;
  }
  return count;
}

bool IsInteger(DType dtype) {
  return dtype != DType::kF32 && dtype != DType::kF64;
}

std::string_view GymnasiumName(DType dtype) {
  switch (dtype) {
    case DType::kF32:
      return "float32";
    case DType::kF64:
      return "float64";
    case DType::kU8:
      return "uint8";
    case DType::kI8:
      return "int8";
    case DType::kI16:
      return "int16";
    case DType::kI32:
      return "int32";
    case DType::kI64:
      return "int64";
    case DType::kU16:
      return "uint16";
    case DType::kU32:
      return "uint32";
    case DType::kU64:
      return "uint64";
    case DType::kBool:
      return "bool";
  }
  return "?";
}

std::string BoundText(double bound, DType dtype) {
  if (dtype != DType::kF32) return NumberText(bound);
  char digits[32];
  return std::string(digits, FormatNumber(static_cast<float>(bound), std::span<char, 32>(digits)));
}

std::string BoundsText(const std::vector<double>& bounds, DType dtype) {
  const bool same = std::all_of(bounds.begin(), bounds.end(), [&](double bound) { return bound == bounds[0]; });
  if (same) return BoundText(bounds[0], dtype);
  std::string out = "[";
  for (std::size_t i = 0; i < bounds.size() && i < 8; ++i) out += (i > 0 ? ", " : "") + BoundText(bounds[i], dtype);
  return out + (bounds.size() > 8 ? ", ...]" : "]");
}

std::string ShapeText(const std::vector<std::int64_t>& shape) {
  std::string out = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) out += (i > 0 ? ", " : "") + std::to_string(shape[i]);
  return out + (shape.size() == 1 ? ",)" : ")");
}

void AppendLeafPaths(const Space& space, const std::string& path, std::vector<std::string>* paths) {
  if (space.children().empty()) paths->push_back(path);
  for (const auto& [name, child] : space.children()) AppendLeafPaths(child, path + "/" + name, paths);
}

}  // namespace

const std::vector<double> Space::kNoBounds;

bool operator==(const Space& a, const Space& b) {
  const bool alike = a.kind_ == b.kind_ && a.dtype_ == b.dtype_ && a.n_ == b.n_ && a.start_ == b.start_ &&
                     a.shape_ == b.shape_ && a.nvec_ == b.nvec_;
  return alike && (a.bounds_ == b.bounds_ || (a.low() == b.low() && a.high() == b.high())) &&
         a.children_ == b.children_;
}

Result<Space> Space::Discrete(std::int64_t n, std::int64_t start) {
  if (n < 1 || n > kLargestElementCount) {
    return SpaceError("a Discrete space has " + std::to_string(n) + " choices; it needs at least 1 and at most 2^28");
  }
  constexpr std::int64_t kFurthestStart = std::numeric_limits<std::int32_t>::max() / 2;
  if (start > kFurthestStart || start < -kFurthestStart) {
    return SpaceError("a Discrete space starts at " + std::to_string(start) + "; its choices must fit 32 bits");
  }
  Space space;
  space.n_ = n;
  space.start_ = start;
  return space;
}

Result<Space> Space::Box(std::vector<double> low, std::vector<double> high, std::vector<std::int64_t> shape,
                         DType dtype) {
  const Result<std::int64_t> count = ElementCount(shape);
  if (!count.ok()) return count.status();
  if (static_cast<std::int64_t>(low.size()) != *count || low.size() != high.size()) {
    return SpaceError("a Box of shape " + ShapeText(shape) + " needs " + std::to_string(*count) +
                      " bounds on each side, not " + std::to_string(low.size()) + " low and " +
                      std::to_string(high.size()) + " high");
  }
  for (std::size_t i = 0; i < low.size(); ++i) {
    if (std::isnan(low[i]) || std::isnan(high[i]) || low[i] > high[i]) {
      return SpaceError("a Box has low " + NumberText(low[i]) + " and high " + NumberText(high[i]) + " at element " +
                        std::to_string(i) + "; low must not be above high");
    }
    if (IsInteger(dtype) && (!std::isfinite(low[i]) || !std::isfinite(high[i]))) {
      return SpaceError("a Box of " + std::string(GymnasiumName(dtype)) + " must be bounded; element " +
                        std::to_string(i) + " is not");
    }
  }
  Space space;
  space.kind_ = SpaceKind::kBox;
  space.dtype_ = dtype;
  space.n_ = 0;
  space.shape_ = std::move(shape);
  // As Gymnasium does: bounds are numbers of the space's own type, so that a value clipped to them lies within.
  if (dtype == DType::kF32) {
    for (double& bound : low) bound = static_cast<float>(bound);
    for (double& bound : high) bound = static_cast<float>(bound);
  }
  space.bounds_ = std::make_shared<const BoxBounds>(BoxBounds{std::move(low), std::move(high)});
  return space;
}

Result<Space> Space::Box(double low, double high, std::vector<std::int64_t> shape, DType dtype) {
  const Result<std::int64_t> count = ElementCount(shape);
  if (!count.ok()) return count.status();
  const auto size = static_cast<std::size_t>(*count);
  return Box(std::vector<double>(size, low), std::vector<double>(size, high), std::move(shape), dtype);
}

Result<Space> Space::MultiDiscrete(std::vector<std::int64_t> nvec) {
  if (nvec.empty()) return SpaceError("a MultiDiscrete space has no elements; give at least one");
  std::int64_t sum = 0;
  for (const std::int64_t n : nvec) {
    if (n < 1 || n > kLargestElementCount - sum) {
      return SpaceError("a MultiDiscrete space has an element with " + std::to_string(n) +
                        " choices; each needs at least 1, and all together at most 2^28");
    }
    sum += n;
  }
  Space space;
  space.kind_ = SpaceKind::kMultiDiscrete;
  space.n_ = 0;
  space.shape_ = {static_cast<std::int64_t>(nvec.size())};
  space.nvec_ = std::move(nvec);
  return space;
}

Result<Space> Space::MultiBinary(std::int64_t n) {
  if (n < 1 || n > kLargestElementCount) {
    return SpaceError("a MultiBinary space has " + std::to_string(n) + " bits; it needs at least 1 and at most 2^28");
  }
  Space space;
  space.kind_ = SpaceKind::kMultiBinary;
  space.dtype_ = DType::kI8;
  space.n_ = n;
  space.shape_ = {n};
  return space;
}

Result<Space> Space::Dict(std::vector<std::pair<std::string, Space>> children) {
  if (children.empty()) return SpaceError("a Dict space has no children; give at least one");
  std::stable_sort(children.begin(), children.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < children.size(); ++i) {
    const std::string& name = children[i].first;
    if (name.empty() || (i > 0 && name == children[i - 1].first)) {
      return SpaceError("a Dict space has a child named " + Quote(name) +
                        " that is empty or twice there; give each its own name");
    }
    if (const Status named = CheckName("a child's", name); !named.ok())
      return SpaceError("a Dict space cannot be made: " + named.message());
  }
  // "a/b" beside "a" with a "b" below it: leaves are told apart by their paths.
  std::vector<std::string> paths;
  for (const auto& [name, child] : children) AppendLeafPaths(child, name, &paths);
  std::sort(paths.begin(), paths.end());
  const auto twice = std::adjacent_find(paths.begin(), paths.end());
  if (twice != paths.end())
    return SpaceError("a Dict space has two leaves at " + Quote(*twice) + "; name them differently");
  Space space;
  space.kind_ = SpaceKind::kDict;
  space.n_ = 0;
  space.children_ = std::move(children);
  return space;
}

Result<Space> Space::Tuple(std::vector<Space> children) {
  if (children.empty()) return SpaceError("a Tuple space has no children; give at least one");
  Space space;
  space.kind_ = SpaceKind::kTuple;
  space.n_ = 0;
  for (std::size_t i = 0; i < children.size(); ++i)
    space.children_.emplace_back(std::to_string(i), std::move(children[i]));
  return space;
}

std::int64_t Space::flat_size() const {
  std::int64_t size = 0;
  switch (kind_) {
    case SpaceKind::kDiscrete:
    case SpaceKind::kMultiBinary:
      return n_;
    case SpaceKind::kBox:
      return static_cast<std::int64_t>(low().size());
    case SpaceKind::kMultiDiscrete:
      for (const std::int64_t n : nvec_) size += n;
      return size;
    case SpaceKind::kDict:
    case SpaceKind::kTuple:
      for (const auto& child : children_) size += child.second.flat_size();
      return size;
  }
  return size;
}

std::string Space::ToString() const {
  std::string out;
  switch (kind_) {
    case SpaceKind::kDiscrete:
      return "Discrete(" + std::to_string(n_) + (start_ != 0 ? ", start=" + std::to_string(start_) : "") + ")";
    case SpaceKind::kBox:
      return "Box(" + BoundsText(low(), dtype_) + ", " + BoundsText(high(), dtype_) + ", " + ShapeText(shape_) + ", " +
             std::string(GymnasiumName(dtype_)) + ")";
    case SpaceKind::kMultiDiscrete:
      for (const std::int64_t n : nvec_) out += (out.empty() ? "" : " ") + std::to_string(n);
      return "MultiDiscrete([" + out + "])";
    case SpaceKind::kMultiBinary:
      return "MultiBinary(" + std::to_string(n_) + ")";
    case SpaceKind::kDict:
    case SpaceKind::kTuple:
      for (const auto& [name, child] : children_) {
        out += (out.empty() ? "" : ", ") + (kind_ == SpaceKind::kDict ? "'" + name + "': " : "") + child.ToString();
      }
      return (kind_ == SpaceKind::kDict ? "Dict(" : "Tuple(") + out + ")";
  }
  return out;
}

}  // namespace consac
