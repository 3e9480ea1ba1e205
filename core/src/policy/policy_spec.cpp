#include "policy/policy_spec.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "consac/base/hash.h"
#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/nn/ops.h"
#include "space/space_json.h"

namespace consac {
namespace {

using SpecJson = nlohmann::json;

// Of both spaces: more than any that is trained here, less than a machine has.
constexpr std::uint64_t kMostInterfaceBytes = std::uint64_t{256} << 20;
// What a block says itself; everything else in its entry is an attribute.
constexpr std::string_view kBlockFields[] = {"op", "in", "out", "name", "in_size", "out_size", "act", "shares"};
constexpr std::string_view kSharedParameters = "shared_parameters";

Status BadSpec(const std::string& what) {
  return {StatusCode::kDataLoss, "the model's specification " + what};
}

const SpecJson& SpecField(const SpecJson& json, const char* name) {
  static const SpecJson kMissing;
  if (!json.is_object()) return kMissing;
  const auto found = json.find(name);
  return found == json.end() ? kMissing : *found;
}

std::string TextOf(const SpecJson& json, const char* name) {
  const SpecJson& value = SpecField(json, name);
  return value.is_string() ? value.get<std::string>() : std::string();
}

/// A member that must be a list, or is not there where that is `optional`; a text or an object could be iterated too.
Status CheckList(const SpecJson& json, const char* name, bool optional = false) {
  const SpecJson& value = SpecField(json, name);
  if (value.is_array() || (optional && value.is_null())) return Status::Ok();
  return BadSpec("has " + Quote(name) + " that are no list");
}

SpecJson HeadsJson(const std::vector<HeadSpec>& specs) {
  SpecJson heads = SpecJson::array();
  for (const HeadSpec& spec : specs) {
    SpecJson head = {{"leaf", spec.leaf}, {"type", spec.type}};
    const Distribution& distribution = *FindDistribution(spec.type);
    if (distribution.log_std_size != nullptr) head["std"] = "pi/log_std";
    if (distribution.follows_state) {
      head["features"] = spec.noise.features;
      head["full_std"] = spec.noise.full_std;
      head["use_expln"] = spec.noise.use_expln;
      head["clip_mean"] = spec.noise.clip_mean;
      head["sample_freq"] = spec.noise.sample_freq;
    }
    heads.push_back(std::move(head));
  }
  return heads;
}

/// How a head follows the state: a member that is not there is as StateNoise begins.
Result<StateNoise> ReadStateNoise(const SpecJson& head) {
  StateNoise noise;
  const SpecJson &features = SpecField(head, "features"), &freq = SpecField(head, "sample_freq"),
                 &clip = SpecField(head, "clip_mean");
  const auto whole = [](const SpecJson& json) { return json.is_number_integer(); };
  const auto truth = [](const SpecJson& json) { return json.is_boolean() || json.is_null(); };
  const SpecJson &full = SpecField(head, "full_std"), &expln = SpecField(head, "use_expln");
  if (!whole(features) || !(freq.is_null() || whole(freq)) || !(clip.is_null() || clip.is_number()) || !truth(full) ||
      !truth(expln))
    return BadSpec("has a head of the type " + Quote(TextOf(head, "type")) +
                   " without usable features, full_std, use_expln, clip_mean and sample_freq");
  noise.features = features.get<std::int64_t>();
  if (!freq.is_null()) noise.sample_freq = freq.get<std::int64_t>();
  if (!clip.is_null()) noise.clip_mean = clip.get<float>();
  if (!full.is_null()) noise.full_std = full.get<bool>();
  if (!expln.is_null()) noise.use_expln = expln.get<bool>();
  return noise;
}

/// Files that name no heads have the default ones.
Result<std::vector<HeadSpec>> ReadHeads(const SpecJson& json) {
  std::vector<HeadSpec> heads;
  if (json.is_null()) return heads;
  if (!json.is_array()) return BadSpec("has heads that are no list");
  for (const SpecJson& head : json) {
    if (!SpecField(head, "leaf").is_string() || !SpecField(head, "type").is_string())
      return BadSpec("has a head without leaf and type");
    heads.push_back({TextOf(head, "leaf"), TextOf(head, "type")});
    const Distribution* distribution = FindDistribution(heads.back().type);
    if (distribution == nullptr || !distribution->follows_state) continue;
    const Result<StateNoise> noise = ReadStateNoise(head);
    if (!noise.ok()) return noise.status();
    heads.back().noise = *noise;
  }
  return heads;
}

SpecJson BlockJson(const nn::Block& block) {
  SpecJson json = SpecJson::object();
  for (const auto& [name, value] : block.attributes.json()) {
    const Result<SpecJson> read = ReadJson<SpecJson>(value);
    if (read.ok()) json[name] = *read;
  }
  json["op"] = block.op;
  json["in"] = block.inputs.size() == 1 ? SpecJson(block.inputs[0]) : SpecJson(block.inputs);
  json["out"] = block.output;
  json["name"] = block.name;
  json["in_size"] = block.in_size;
  json["out_size"] = block.out_size;
  json["act"] = nn::NameOf(block.activation);
  if (!block.shares.empty()) json["shares"] = block.shares;
  return json;
}

SpecJson GraphJson(const nn::NetworkSpec& network) {
  SpecJson blocks = SpecJson::array();
  for (const nn::Block& block : network.blocks) blocks.push_back(BlockJson(block));
  SpecJson inputs = SpecJson::array();
  for (const nn::Port& input : network.inputs) {
    SpecJson json = {{"name", input.name}, {"size", input.size}};
    if (input.shape.size() > 1) json["shape"] = input.shape;
    inputs.push_back(std::move(json));
  }
  return {{"inputs", inputs}, {"blocks", blocks}, {"outputs", network.outputs}};
}

Result<nn::Port> ReadPort(const SpecJson& json) {
  const SpecJson &size = SpecField(json, "size"), &shape = SpecField(json, "shape");
  if (!size.is_number_integer()) return BadSpec("has a network input without a size");
  nn::Port port{TextOf(json, "name"), size.get<std::int64_t>(), {}};
  CONSAC_RETURN_IF_ERROR(CheckList(json, "shape", true));
  for (const SpecJson& dimension : shape) {
    if (!dimension.is_number_integer()) return BadSpec("has a network input of no usable shape");
    port.shape.push_back(dimension.get<std::int64_t>());
  }
  return port;
}

/// The names of a block's inputs: one text, or a list of texts.
Status ReadBlockInputs(const SpecJson& json, nn::Block* block) {
  if (json.is_string()) {
    block->inputs = {json.get<std::string>()};
    return {};
  }
  for (const SpecJson& input : json) {
    if (!input.is_string()) return BadSpec("has a block " + Quote(block->name) + " with an input that is no name");
    block->inputs.push_back(input.get<std::string>());
  }
  return {};
}

Result<nn::Block> ReadBlock(const SpecJson& entry) {
  const SpecJson &in_size = SpecField(entry, "in_size"), &out_size = SpecField(entry, "out_size");
  if (!in_size.is_number_integer() || !out_size.is_number_integer()) return BadSpec("has a block without sizes");
  nn::Block block;
  block.op = TextOf(entry, "op");
  block.output = TextOf(entry, "out");
  block.name = TextOf(entry, "name");
  block.shares = TextOf(entry, "shares");
  CONSAC_RETURN_IF_ERROR(ReadBlockInputs(SpecField(entry, "in"), &block));
  block.in_size = in_size.get<std::int64_t>();
  block.out_size = out_size.get<std::int64_t>();
  constexpr std::int64_t kWidest = 1 << 20;
  if (block.in_size < 1 || block.out_size < 1 || block.in_size > kWidest || block.out_size > kWidest) {
    return BadSpec("has a block " + Quote(block.name) + " of impossible size");
  }
  const Result<nn::Activation> activation = nn::ParseActivation(TextOf(entry, "act"));
  if (!activation.ok())
    return BadSpec("has a block " + Quote(block.name) + " with an " + activation.status().message());
  block.activation = *activation;
  for (const auto& [name, value] : entry.items()) {
    if (std::find(std::begin(kBlockFields), std::end(kBlockFields), name) == std::end(kBlockFields))
      block.attributes.SetJson(name, JsonText(value));
  }
  return block;
}

Result<nn::NetworkSpec> GraphFromJson(const SpecJson& json) {
  for (const char* list : {"inputs", "blocks", "outputs"}) CONSAC_RETURN_IF_ERROR(CheckList(json, list));
  nn::NetworkSpec network;
  for (const SpecJson& input : SpecField(json, "inputs")) {
    Result<nn::Port> port = ReadPort(input);
    if (!port.ok()) return port.status();
    network.inputs.push_back(std::move(*port));
  }
  for (const SpecJson& entry : SpecField(json, "blocks")) {
    Result<nn::Block> block = ReadBlock(entry);
    if (!block.ok()) return block.status();
    network.blocks.push_back(std::move(*block));
  }
  for (const SpecJson& output : SpecField(json, "outputs")) {
    if (!output.is_string()) return BadSpec("has a network output that is no name");
    network.outputs.push_back(output.get<std::string>());
  }
  return network;
}

/// Copies a float32 tensor of exactly `count` elements; takes no memory for one of another size.
Status ReadFloats(const ModelFile& file, const std::string& name, std::size_t count, std::vector<float>* out) {
  const auto found = file.tensors.find(name);
  if (found == file.tensors.end()) return {StatusCode::kDataLoss, "the model lacks the tensor " + Quote(name)};
  const std::span<const float> values = found->second.floats();
  if (found->second.dtype != DType::kF32 || values.size() != count) {
    return {StatusCode::kDataLoss, "the model's tensor " + Quote(name) + " has " + std::to_string(values.size()) +
                                       " float32 elements, expected " + std::to_string(count)};
  }
  out->insert(out->end(), values.begin(), values.end());
  return Status::Ok();
}

Status ReadNormaliser(const ModelFile& file, const SpecJson& json, std::size_t features, ObservationNormaliser* out) {
  if (json.is_null()) return Status::Ok();
  const SpecJson& clip = SpecField(json, "clip");
  if (!clip.is_number()) return BadSpec("has a normaliser without clip");
  out->clip = clip.get<float>();
  const std::string mean = TextOf(json, "mean"), scale = TextOf(json, "scale");
  if (mean.empty() || scale.empty()) return BadSpec("has a normaliser that does not name its mean and its scale");
  CONSAC_RETURN_IF_ERROR(ReadFloats(file, mean, features, &out->mean));
  return ReadFloats(file, scale, features, &out->scale);
}

Status ReadSelfTest(const SpecJson& json, std::vector<SelfTestPair>* selftest) {
  for (const SpecJson& pair : json) {
    const SpecJson& tolerance = SpecField(pair, "tol");
    if (!tolerance.is_number()) return BadSpec("has a self-test without tolerance");
    selftest->push_back({TextOf(pair, "in"), TextOf(pair, "out"), tolerance.get<double>()});
  }
  if (selftest->empty()) return BadSpec("has no self-test");
  return Status::Ok();
}

Status CheckRequires(const SpecJson& json) {
  for (const SpecJson& feature : json) {
    const std::string name = feature.is_string() ? feature.get<std::string>() : JsonText(feature);
    const bool known = nn::FindOp(name) != nullptr || FindDistribution(name) != nullptr || name == kSharedParameters;
    if (!known) return BadSpec("requires " + Quote(name) + ", which this program does not know; use a newer CONSAC");
  }
  return Status::Ok();
}

SpecJson RequiredFeatures(const PolicyData& data) {
  std::vector<std::string> features;
  for (const nn::Block& block : data.network.blocks) {
    features.push_back(block.op);
    if (!block.shares.empty()) features.emplace_back(kSharedParameters);
  }
  for (const HeadSpec& head : data.heads) features.push_back(head.type);
  std::sort(features.begin(), features.end());
  features.erase(std::unique(features.begin(), features.end()), features.end());
  return features;
}

SpecJson InterfaceJson(const PolicyData& data) {
  return {{"behaviour", data.behaviour},
          {"observation", SpaceToJson(data.observation_space)},
          {"action", SpaceToJson(data.action_space)}};
}

}  // namespace

Status CheckActivations(const nn::Network& network) {
  constexpr std::int64_t kMostFeatures = std::int64_t{1} << 20;  // 256 MiB for the 64 rows that go through at once
  std::int64_t features = 0;
  for (const nn::Block& block : network.spec().blocks) {
    features += block.out_size;
    if (features <= kMostFeatures) continue;
    return {StatusCode::kResourceExhausted, "the network's layers up to " + Quote(block.name) + " put out " +
                                                std::to_string(features) + " features together, and at most " +
                                                std::to_string(kMostFeatures) + " can act; choose smaller layers"};
  }
  return Status::Ok();
}

void WritePolicy(const PolicyData& data, const std::vector<SelfTestPair>& selftest, ModelFile* file) {
  SpecJson interface_json = InterfaceJson(data);
  const std::string canonical = JsonText(interface_json);
  const std::span<const std::byte> pieces[] = {std::as_bytes(std::span(canonical))};
  interface_json["hash"] = Sha256Hex(pieces);
  interface_json["heads"] = HeadsJson(data.heads);
  if (data.normaliser.active()) {
    const auto size = static_cast<std::int64_t>(data.normaliser.mean.size());
    interface_json["normalise"] = {
        {"mean", "norm/obs/mean"}, {"scale", "norm/obs/scale"}, {"clip", data.normaliser.clip}};
    file->tensors.insert_or_assign("norm/obs/mean", Tensor::OfFloats(data.normaliser.mean, {size}));
    file->tensors.insert_or_assign("norm/obs/scale", Tensor::OfFloats(data.normaliser.scale, {size}));
  }
  SpecJson tests = SpecJson::array();
  for (const SelfTestPair& pair : selftest)
    tests.push_back({{"in", pair.in}, {"out", pair.out}, {"tol", pair.tolerance}});
  const Result<SpecJson> training = ReadJson<SpecJson>(data.training_json);
  const SpecJson spec = {{"kind", "policy"},
                         {"requires", RequiredFeatures(data)},
                         {"producer", {{"name", "consac"}, {"version", kVersion}}},
                         {"interface", interface_json},
                         {"graph", GraphJson(data.network)},
                         {"selftest", tests},
                         {"training", training.ok() && training->is_object() ? *training : SpecJson::object()}};
  file->spec_json = JsonText(spec);

  const Result<nn::Network> network = nn::Network::Create(data.network);
  CONSAC_ASSERT(network.ok());
  for (const nn::Parameter& parameter : network->parameters()) {
    const std::span<const float> values(data.parameters.data() + parameter.offset,
                                        static_cast<std::size_t>(parameter.count));
    file->tensors.insert_or_assign(parameter.name, Tensor::OfFloats(values, parameter.shape));
  }
  if (!data.log_std.empty()) {
    file->tensors.insert_or_assign("pi/log_std",
                                   Tensor::OfFloats(data.log_std, {static_cast<std::int64_t>(data.log_std.size())}));
  }
}

Result<PolicyData> ReadPolicy(const ModelFile& file, std::vector<SelfTestPair>* selftest) {
  const Result<SpecJson> read = ReadJson<SpecJson>(file.spec_json);
  if (!read.ok()) return BadSpec("is " + read.status().message());
  const SpecJson& spec = *read;
  if (!spec.is_object()) return BadSpec("is no JSON object");
  if (TextOf(spec, "kind") != "policy") return BadSpec("is of kind " + Quote(TextOf(spec, "kind")) + ", not 'policy'");
  CONSAC_RETURN_IF_ERROR(CheckList(spec, "requires", true));
  CONSAC_RETURN_IF_ERROR(CheckRequires(SpecField(spec, "requires")));
  const SpecJson& interface_json = SpecField(spec, "interface");
  PolicyData data;
  data.behaviour = TextOf(interface_json, "behaviour");
  if (const Status named = CheckName("behaviour", data.behaviour); !named.ok())
    return BadSpec("has a " + named.message());
  MemoryBudget budget(kMostInterfaceBytes);
  Result<Space> observation = SpaceFromJson(SpecField(interface_json, "observation"), budget);
  if (!observation.ok()) return observation.status();
  data.observation_space = std::move(*observation);
  Result<Space> action = SpaceFromJson(SpecField(interface_json, "action"), budget);
  if (!action.ok()) return action.status();
  data.action_space = std::move(*action);
  Result<nn::NetworkSpec> graph = GraphFromJson(SpecField(spec, "graph"));
  if (!graph.ok()) return graph.status();
  data.network = std::move(*graph);
  const Result<nn::Network> network = nn::Network::Create(data.network);
  if (!network.ok()) return BadSpec("has an unusable graph: " + network.status().message());
  CONSAC_RETURN_IF_ERROR(CheckActivations(*network));

  // In arena order, one behind the other.
  for (const nn::Parameter& parameter : network->parameters()) {
    CONSAC_ASSERT(parameter.offset == static_cast<std::int64_t>(data.parameters.size()));
    CONSAC_RETURN_IF_ERROR(
        ReadFloats(file, parameter.name, static_cast<std::size_t>(parameter.count), &data.parameters));
  }
  Result<std::vector<HeadSpec>> heads = ReadHeads(SpecField(interface_json, "heads"));
  if (!heads.ok()) return heads.status();
  data.heads = std::move(*heads);
  const Result<ActionHead> head = ActionHead::Create(Layout::Of(data.action_space), data.heads);
  if (!head.ok()) return BadSpec("does not fit: " + head.status().message());
  const auto log_std_size = static_cast<std::size_t>(head->log_std_size());
  if (log_std_size > 0) CONSAC_RETURN_IF_ERROR(ReadFloats(file, "pi/log_std", log_std_size, &data.log_std));
  const auto features = static_cast<std::size_t>(data.observation_space.flat_size());
  CONSAC_RETURN_IF_ERROR(ReadNormaliser(file, SpecField(interface_json, "normalise"), features, &data.normaliser));
  CONSAC_RETURN_IF_ERROR(CheckList(spec, "selftest"));
  CONSAC_RETURN_IF_ERROR(ReadSelfTest(SpecField(spec, "selftest"), selftest));
  const SpecJson& training = SpecField(spec, "training");
  if (training.is_object()) data.training_json = JsonText(training);
  return data;
}

}  // namespace consac
