#include "space/space_json.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/text.h"

namespace consac {
namespace {

using SpaceJson = nlohmann::json;

constexpr int kDeepestSpace = 16;
constexpr std::int64_t kMostElements = std::int64_t{1} << 24;  // of one box, or choices of one leaf
// What is charged for what somebody else's JSON makes: both bounds of an element of a box, which all copies of
// the space share; a choice, in a row's one-hot features and masks; a space itself and its leaf.
constexpr std::uint64_t kElementBytes = 2 * sizeof(double), kChoiceBytes = 8, kSpaceBytes = 1024;

Status BadSpace(const std::string& what) {
  return {StatusCode::kDataLoss, "a space " + what};
}

// One number holds for all elements: the bounds of an image are not 28,000 times 0.
SpaceJson BoundsToJson(const std::vector<double>& bounds) {
  const bool same = bounds.size() > 1 && std::isfinite(bounds[0]) &&
                    std::all_of(bounds.begin(), bounds.end(), [&](double bound) { return bound == bounds[0]; });
  if (same) return bounds[0];
  SpaceJson out = SpaceJson::array();
  for (const double bound : bounds) out.push_back(std::isfinite(bound) ? SpaceJson(bound) : SpaceJson(nullptr));
  return out;
}

/// The member `name` of a space is missing, or is not what it should be.
Status WrongMember(const SpaceJson& json, const char* name, const std::string& expected) {
  const auto found = json.find(name);
  if (found == json.end()) return BadSpace("has no " + std::string(name) + "; it is " + expected);
  return BadSpace("has " + std::string(name) + " " + Quote(JsonText(*found)) + ", expected " + expected);
}

const SpaceJson& Field(const SpaceJson& json, const char* name) {
  static const SpaceJson kMissing;
  const auto found = json.find(name);
  return found == json.end() ? kMissing : *found;
}

bool IsFloat(DType dtype) {
  return dtype == DType::kF32 || dtype == DType::kF64;
}

/// A bound as its member may say it: whole, and within what f64 has exactly, in a whole type; null where none is meant.
bool IsBound(const SpaceJson& json, DType dtype) {
  constexpr double kLargestWhole = 9007199254740991.0;  // 2^53 - 1
  if (json.is_null()) return IsFloat(dtype);
  if (!json.is_number()) return false;
  const double bound = json.get<double>();
  return IsFloat(dtype) || (std::fabs(bound) <= kLargestWhole && bound == std::floor(bound));
}

/// The nearest number of the type; a bound beyond what it holds counts as its end.
double WithinType(double bound, DType dtype) {
  constexpr double kLargestFloat = std::numeric_limits<float>::max();
  if (dtype == DType::kF32) return static_cast<float>(std::clamp(bound, -kLargestFloat, kLargestFloat));
  if (dtype == DType::kF64) return bound;
  if (dtype == DType::kBool) return std::clamp(bound, 0.0, 1.0);
  const bool with_sign = dtype == DType::kI8 || dtype == DType::kI16 || dtype == DType::kI32 || dtype == DType::kI64;
  const double half = std::ldexp(1.0, static_cast<int>(8 * SizeOf(dtype)) - 1);
  return with_sign ? std::clamp(bound, -half, half - 1.0) : std::clamp(bound, 0.0, 2.0 * half - 1.0);
}

/// The member `name` of a box with `count` elements; a side without bound is `unbounded`.
Status BoundsFromJson(const SpaceJson& json, const char* name, std::size_t count, DType dtype, double unbounded,
                      std::vector<double>* out) {
  const SpaceJson& bounds = Field(json, name);
  const bool one = json.contains(name) && IsBound(bounds, dtype);
  const bool list = bounds.is_array() && bounds.size() == count &&
                    std::all_of(bounds.begin(), bounds.end(), [&](const auto& bound) { return IsBound(bound, dtype); });
  if (!one && !list) {
    const std::string number = IsFloat(dtype) ? "number or null" : "whole number within 2^53 - 1";
    return WrongMember(json, name, "a " + number + ", or a list of " + std::to_string(count) + " such");
  }
  const auto value = [&](const SpaceJson& bound) {
    return bound.is_null() ? unbounded : WithinType(bound.get<double>(), dtype);
  };
  if (one) out->assign(count, value(bounds));
  for (std::size_t i = 0; list && i < count; ++i) out->push_back(value(bounds[i]));
  return Status::Ok();
}

/// A whole number that every language has: within 2^53 - 1.
bool IsWhole(const SpaceJson& value) {
  constexpr std::int64_t kMost = (std::int64_t{1} << 53) - 1;
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= static_cast<std::uint64_t>(kMost);
  return value.is_number_integer() && value.get<std::int64_t>() >= -kMost;
}

Status IntegersFromJson(const SpaceJson& json, const char* name, std::vector<std::int64_t>* out) {
  const SpaceJson& list = Field(json, name);
  if (!list.is_array() || !std::all_of(list.begin(), list.end(), IsWhole))
    return WrongMember(json, name, "a list of whole numbers below 2^53");
  for (const SpaceJson& value : list) out->push_back(value.get<std::int64_t>());
  return Status::Ok();
}

/// The whole number `name`; `otherwise` where it may be missing.
Result<std::int64_t> WholeFromJson(const SpaceJson& json, const char* name, const std::int64_t* otherwise = nullptr) {
  if (otherwise != nullptr && !json.contains(name)) return *otherwise;
  const SpaceJson& value = Field(json, name);
  if (!IsWhole(value)) return WrongMember(json, name, "a whole number below 2^53");
  return value.get<std::int64_t>();
}

/// The optional `shape` of what is flat in a row, which must have `count` elements.
Status CheckShape(const SpaceJson& json, std::int64_t count) {
  if (!json.contains("shape")) return Status::Ok();
  std::vector<std::int64_t> shape;
  CONSAC_RETURN_IF_ERROR(IntegersFromJson(json, "shape", &shape));
  std::int64_t elements = 1;
  bool fits = true;
  for (const std::int64_t size : shape) {
    fits = fits && size >= 1 && size <= count / elements;
    if (fits) elements *= size;
  }
  if (fits && elements == count) return Status::Ok();
  return WrongMember(json, "shape", "sizes from 1 that make " + std::to_string(count) + " elements");
}

Result<Space> FromJson(const SpaceJson& json, int depth, MemoryBudget& budget);

Result<Space> BoxFromJson(const SpaceJson& json, MemoryBudget& budget) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<std::int64_t> shape;
  std::vector<double> low, high;
  DType dtype = DType::kF32;
  const SpaceJson& type = Field(json, "dtype");
  if (!type.is_string() || !ParseDType(type.get_ref<const std::string&>(), &dtype))
    return WrongMember(json, "dtype", "one of BOOL, U8 to U64, I8 to I64, F32 and F64");
  CONSAC_RETURN_IF_ERROR(IntegersFromJson(json, "shape", &shape));
  std::int64_t elements = 1;
  for (const std::int64_t size : shape) {
    if (size < 1 || size > kMostElements / elements)
      return BadSpace("has a box with a side of " + std::to_string(size) + "; at most 2^24 elements are taken");
    elements *= size;
  }
  CONSAC_RETURN_IF_ERROR(budget.Take("a box", static_cast<std::uint64_t>(elements), kElementBytes));
  const auto count = static_cast<std::size_t>(elements);
  CONSAC_RETURN_IF_ERROR(BoundsFromJson(json, "low", count, dtype, -kInfinity, &low));
  CONSAC_RETURN_IF_ERROR(BoundsFromJson(json, "high", count, dtype, kInfinity, &high));
  return Space::Box(std::move(low), std::move(high), std::move(shape), dtype);
}

/// The same space, if its one-hot numbers or bits are still within what is taken.
Result<Space> Within(Result<Space> space, MemoryBudget& budget) {
  if (!space.ok()) return space;
  const std::int64_t choices = space->flat_size();
  if (choices > kMostElements) return BadSpace("has " + std::to_string(choices) + " choices; at most 2^24 are taken");
  CONSAC_RETURN_IF_ERROR(budget.Take("choices", static_cast<std::uint64_t>(choices), kChoiceBytes));
  return space;
}

Result<Space> ChildrenFromJson(const SpaceJson& json, bool named, int depth, MemoryBudget& budget) {
  const SpaceJson& children = Field(json, "spaces");
  if (!children.is_array()) return WrongMember(json, "spaces", "a list of children");
  std::vector<std::pair<std::string, Space>> named_children;
  std::vector<Space> ordered;
  for (const SpaceJson& child : children) {
    if (!child.is_object()) return BadSpace("has a child that is no object");
    Result<Space> space = FromJson(Field(child, "space"), depth + 1, budget);
    if (!space.ok()) return space.status();
    const SpaceJson& name = Field(child, "name");
    if (!name.is_string()) return WrongMember(child, "name", "a text");
    if (!named && name != std::to_string(ordered.size()))
      return BadSpace("has a child named " + Quote(JsonText(name)) +
                      "; those of a tuple are \"0\", \"1\", ... in order");
    if (named)
      named_children.emplace_back(name.get<std::string>(), std::move(*space));
    else
      ordered.push_back(std::move(*space));
  }
  for (std::size_t i = 1; i < named_children.size(); ++i) {
    if (named_children[i].first < named_children[i - 1].first)
      return BadSpace("has " + Quote(named_children[i].first) + " behind " + Quote(named_children[i - 1].first) +
                      "; the children of a dict are sorted by name");
  }
  return named ? Space::Dict(std::move(named_children)) : Space::Tuple(std::move(ordered));
}

}  // namespace

nlohmann::json SpaceToJson(const Space& space) {
  switch (space.kind()) {
    case SpaceKind::kDiscrete:
      return {{"type", "discrete"}, {"n", space.n()}, {"start", space.start()}};
    case SpaceKind::kMultiDiscrete:
      return {{"type", "multi_discrete"}, {"nvec", space.nvec()}};
    case SpaceKind::kMultiBinary:
      return {{"type", "multi_binary"}, {"n", space.n()}};
    case SpaceKind::kBox:
      return {{"type", "box"},
              {"shape", space.shape()},
              {"dtype", NameOf(space.dtype())},
              {"low", BoundsToJson(space.low())},
              {"high", BoundsToJson(space.high())}};
    case SpaceKind::kDict:
    case SpaceKind::kTuple:
      break;
  }
  SpaceJson children = SpaceJson::array();
  for (const auto& [name, child] : space.children())
    children.push_back({{"name", name}, {"space", SpaceToJson(child)}});
  return {{"type", space.kind() == SpaceKind::kDict ? "dict" : "tuple"}, {"spaces", children}};
}

namespace {

Result<Space> FromJson(const SpaceJson& json, int depth, MemoryBudget& budget) {
  if (depth > kDeepestSpace) return BadSpace("is nested more than 16 deep");
  CONSAC_RETURN_IF_ERROR(budget.Take("a space", 1, kSpaceBytes));
  if (!json.is_object()) return BadSpace("is " + Quote(JsonText(json)) + ", expected an object");
  if (!Field(json, "type").is_string()) return WrongMember(json, "type", "a text");
  const std::string type = Field(json, "type").get<std::string>();
  if (type == "discrete") {
    constexpr std::int64_t kFromZero = 0;
    const Result<std::int64_t> n = WholeFromJson(json, "n"), start = WholeFromJson(json, "start", &kFromZero);
    if (!n.ok() || !start.ok()) return n.ok() ? start.status() : n.status();
    return Within(Space::Discrete(*n, *start), budget);
  }
  if (type == "multi_binary") {
    const Result<std::int64_t> n = WholeFromJson(json, "n");
    if (!n.ok()) return n.status();
    Result<Space> space = Within(Space::MultiBinary(*n), budget);
    if (space.ok()) CONSAC_RETURN_IF_ERROR(CheckShape(json, *n));
    return space;
  }
  if (type == "multi_discrete") {
    std::vector<std::int64_t> nvec;
    CONSAC_RETURN_IF_ERROR(IntegersFromJson(json, "nvec", &nvec));
    CONSAC_RETURN_IF_ERROR(CheckShape(json, static_cast<std::int64_t>(nvec.size())));
    return Within(Space::MultiDiscrete(std::move(nvec)), budget);
  }
  if (type == "box") return BoxFromJson(json, budget);
  if (type == "dict" || type == "tuple") return ChildrenFromJson(json, type == "dict", depth, budget);
  return BadSpace("has the unknown type " + Quote(type) + "; use a newer CONSAC");
}

}  // namespace

Result<Space> SpaceFromJson(const nlohmann::json& json, MemoryBudget& budget) {
  return FromJson(json, 0, budget);
}

}  // namespace consac
