#include "consac/policy/demonstration.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "space/space_json.h"

namespace consac {
namespace {

constexpr std::size_t kMostDemonstrationSpaceBytes = std::size_t{64} << 20;  // that reading its spaces may take
constexpr std::int32_t kMostDemonstrators = 1 << 20;

Status NoDemonstration(const std::string& what) {
  return {StatusCode::kDataLoss, "not a usable demonstration: it " + what};
}

/// The member, or null.
const nlohmann::json& DemonstrationField(const nlohmann::json& object, const char* name) {
  static const nlohmann::json kNothing;
  const auto at = object.is_object() ? object.find(name) : object.end();
  return object.is_object() && at != object.end() ? *at : kNothing;
}

Result<BehaviourSpec> ReadBehaviour(const std::string& spec_json) {
  const Result<nlohmann::json> spec = ReadJson<nlohmann::json>(spec_json);
  if (!spec.ok()) return NoDemonstration("has a specification that is " + spec.status().message());
  if (DemonstrationField(*spec, "kind") != "demonstration") return NoDemonstration("is not of kind 'demonstration'");
  const nlohmann::json& behaviours = DemonstrationField(*spec, "behaviours");
  if (!behaviours.is_array() || behaviours.size() != 1) return NoDemonstration("is not of one behaviour");
  const nlohmann::json& name = DemonstrationField(behaviours[0], "name");
  if (!name.is_string()) return NoDemonstration("has a behaviour without a name");
  if (const Status named = CheckName("behaviour", name.get_ref<const std::string&>()); !named.ok())
    return NoDemonstration("has a " + named.message());
  MemoryBudget budget(kMostDemonstrationSpaceBytes);
  Result<Space> seen = SpaceFromJson(DemonstrationField(behaviours[0], "observation"), budget);
  if (!seen.ok()) return NoDemonstration("has an observation space that " + seen.status().message());
  Result<Space> done = SpaceFromJson(DemonstrationField(behaviours[0], "action"), budget);
  if (!done.ok()) return NoDemonstration("has an action space that " + done.status().message());
  return BehaviourSpec::Of(name.get<std::string>(), std::move(*seen), std::move(*done), 1);
}

/// The tensor of that name, whose first dimension are the steps (-1: any) and whose rows have `count` elements.
Result<const Tensor*> TensorOfSteps(const ModelFile& file, const std::string& name, DType dtype, std::int64_t steps,
                                    std::int64_t count) {
  const auto at = file.tensors.find(name);
  if (at == file.tensors.end()) return NoDemonstration("lacks the tensor " + Quote(name));
  const Tensor& tensor = at->second;
  const bool fits = tensor.dtype == dtype && !tensor.shape.empty() && (steps < 0 || tensor.shape[0] == steps) &&
                    tensor.bytes.size() == static_cast<std::size_t>(tensor.shape[0] * count) * SizeOf(dtype);
  if (!fits) return NoDemonstration("has a tensor " + Quote(name) + " of another type or size than its spaces say");
  return &tensor;
}

template <class T>
Status ReadStepColumn(const ModelFile& file, const char* name, std::int64_t steps, std::vector<T>* values) {
  const Result<const Tensor*> tensor = TensorOfSteps(file, name, DTypeOf<T>::value, steps, 1);
  if (!tensor.ok()) return tensor.status();
  values->resize((*tensor)->bytes.size() / sizeof(T));
  if (!values->empty()) std::memcpy(values->data(), (*tensor)->bytes.data(), (*tensor)->bytes.size());
  return Status::Ok();
}

/// Whether a learner can have it: numbers are finite, be they beyond their bounds, and choices are among what there is.
Status CheckStepRow(const Layout& layout, const std::byte* row) {
  for (const Leaf& leaf : layout.leaves) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const double value = ReadElement(leaf, row, i);
      const auto [low, high] = ElementBounds(leaf, i);
      const bool number = leaf.space.kind() == SpaceKind::kBox;
      if (number ? std::isfinite(value) : value >= low && value <= high) continue;
      return {StatusCode::kDataLoss, NumberText(value) + " where " + leaf.space.ToString() + " is expected"};
    }
  }
  return Status::Ok();
}

/// One tensor for each leaf becomes rows.
Status ReadStepRows(const ModelFile& file, const std::string& what, const Layout& layout, std::int64_t steps,
                    std::vector<std::byte>* rows) {
  rows->resize(static_cast<std::size_t>(steps) * layout.row_bytes);
  for (const Leaf& leaf : layout.leaves) {
    const std::string name = leaf.name.empty() ? what : what + "/" + leaf.name;
    const Result<const Tensor*> tensor = TensorOfSteps(file, name, leaf.dtype, steps, leaf.count);
    if (!tensor.ok()) return tensor.status();
    const std::size_t bytes = static_cast<std::size_t>(leaf.count) * SizeOf(leaf.dtype);
    for (std::size_t i = 0; i < static_cast<std::size_t>(steps); ++i)
      std::memcpy(rows->data() + i * layout.row_bytes + leaf.offset, (*tensor)->bytes.data() + i * bytes, bytes);
  }
  for (std::int64_t i = 0; i < steps; ++i) {
    const Status fits = CheckStepRow(layout, rows->data() + static_cast<std::size_t>(i) * layout.row_bytes);
    if (!fits.ok()) return NoDemonstration("has, in " + what + " of step " + std::to_string(i) + ", " + fits.message());
  }
  return Status::Ok();
}

}  // namespace

Result<Demonstration> Demonstration::FromFile(const ModelFile& file) {
  Demonstration result;
  Result<BehaviourSpec> behaviour = ReadBehaviour(file.spec_json);
  if (!behaviour.ok()) return behaviour.status();
  result.behaviour = std::move(*behaviour);
  CONSAC_RETURN_IF_ERROR(ReadStepColumn(file, "rewards", -1, &result.rewards));
  CONSAC_RETURN_IF_ERROR(ReadStepColumn(file, "terminated", result.steps(), &result.terminated));
  CONSAC_RETURN_IF_ERROR(ReadStepColumn(file, "truncated", result.steps(), &result.truncated));
  CONSAC_RETURN_IF_ERROR(ReadStepColumn(file, "slots", result.steps(), &result.slots));
  for (std::size_t i = 0; i < result.slots.size(); ++i) {
    const bool sane = std::isfinite(result.rewards[i]) && result.terminated[i] <= 1 && result.truncated[i] <= 1 &&
                      result.slots[i] >= 0 && result.slots[i] < kMostDemonstrators;
    if (!sane)
      return NoDemonstration("has a reward, an end or a slot of step " + std::to_string(i) + " that no step can have");
    result.behaviour.slots = std::max(result.behaviour.slots, result.slots[i] + 1);
  }
  CONSAC_RETURN_IF_ERROR(
      ReadStepRows(file, "observations", result.behaviour.observation_layout, result.steps(), &result.observations));
  CONSAC_RETURN_IF_ERROR(
      ReadStepRows(file, "actions", result.behaviour.action_layout, result.steps(), &result.actions));
  return result;
}

Result<Demonstration> Demonstration::Load(const std::string& path) {
  const Result<ModelFile> file = ModelFile::Load(path);
  if (!file.ok()) return file.status();
  Result<Demonstration> result = FromFile(*file);
  if (!result.ok()) return Status{result.status().code(), "'" + path + "': " + result.status().message()};
  return result;
}

}  // namespace consac
