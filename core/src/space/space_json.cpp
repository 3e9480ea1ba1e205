#include "space/space_json.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

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

bool BoundsFromJson(const SpaceJson& json, std::size_t count, double unbounded, std::vector<double>* out) {
  if (json.is_number()) {
    out->assign(count, json.get<double>());
    return true;
  }
  if (json.is_null()) {
    out->assign(count, unbounded);
    return true;
  }
  if (!json.is_array()) return false;
  for (const SpaceJson& bound : json) {
    if (!bound.is_number() && !bound.is_null()) return false;
    out->push_back(bound.is_null() ? unbounded : bound.get<double>());
  }
  return true;
}

bool IntegersFromJson(const SpaceJson& json, std::vector<std::int64_t>* out) {
  if (!json.is_array()) return false;
  for (const SpaceJson& value : json) {
    if (!value.is_number_integer()) return false;
    out->push_back(value.get<std::int64_t>());
  }
  return true;
}

const SpaceJson& Field(const SpaceJson& json, const char* name) {
  static const SpaceJson kMissing;
  const auto found = json.find(name);
  return found == json.end() ? kMissing : *found;
}

Result<Space> FromJson(const SpaceJson& json, int depth, MemoryBudget& budget);

Result<Space> BoxFromJson(const SpaceJson& json, MemoryBudget& budget) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<std::int64_t> shape;
  std::vector<double> low, high;
  DType dtype = DType::kF32;
  const SpaceJson& type = Field(json, "dtype");
  if (!type.is_string() || !ParseDType(type.get_ref<const std::string&>(), &dtype))
    return BadSpace("has no known dtype");
  if (!IntegersFromJson(Field(json, "shape"), &shape)) return BadSpace("is a box without shape");
  std::int64_t elements = 1;
  for (const std::int64_t size : shape) {
    if (size < 1 || size > kMostElements / elements)
      return BadSpace("has a box with a side of " + std::to_string(size) + "; at most 2^24 elements are taken");
    elements *= size;
  }
  CONSAC_RETURN_IF_ERROR(budget.Take("a box", static_cast<std::uint64_t>(elements), kElementBytes));
  const auto count = static_cast<std::size_t>(elements);
  if (!BoundsFromJson(Field(json, "low"), count, -kInfinity, &low) ||
      !BoundsFromJson(Field(json, "high"), count, kInfinity, &high)) {
    return BadSpace("is a box without low or high");
  }
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
  if (!children.is_array()) return BadSpace("has no list of children");
  std::vector<std::pair<std::string, Space>> named_children;
  std::vector<Space> ordered;
  for (const SpaceJson& child : children) {
    if (!child.is_object()) return BadSpace("has a child that is no object");
    Result<Space> space = FromJson(Field(child, "space"), depth + 1, budget);
    if (!space.ok()) return space.status();
    const SpaceJson& name = Field(child, "name");
    if (named && !name.is_string()) return BadSpace("has a child without a name");
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
  if (!json.is_object() || !Field(json, "type").is_string()) return BadSpace("has no type");
  const std::string type = Field(json, "type").get<std::string>();
  const SpaceJson& n = Field(json, "n");
  if (type == "discrete") {
    const SpaceJson& start = Field(json, "start");
    if (!n.is_number_integer()) return BadSpace("is discrete without n");
    if (json.contains("start") && !start.is_number_integer()) return BadSpace("is discrete with a start that is none");
    return Within(Space::Discrete(n.get<std::int64_t>(), start.is_number_integer() ? start.get<std::int64_t>() : 0),
                  budget);
  }
  if (type == "multi_binary") {
    if (!n.is_number_integer()) return BadSpace("is multi_binary without n");
    return Within(Space::MultiBinary(n.get<std::int64_t>()), budget);
  }
  if (type == "multi_discrete") {
    std::vector<std::int64_t> nvec;
    if (!IntegersFromJson(Field(json, "nvec"), &nvec)) return BadSpace("is multi_discrete without nvec");
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
