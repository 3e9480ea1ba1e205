#include "consac/host/recorder.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "consac/model/model_file.h"
#include "consac/protocol/protocol2.h"
#include "tick_world_state.h"

namespace consac::host {
namespace {

constexpr std::size_t kMostRecordedBytes = std::size_t{1} << 30;  // then it is full
constexpr std::size_t kBytesBeside = 10;                          // reward, ends, slot

template <class T>
std::vector<std::byte> BytesOfAll(const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

/// One tensor for each leaf, [steps, the leaf's shape].
void PutRows(const std::string& what, const Layout& layout, const std::vector<std::byte>& rows, ModelFile* file) {
  const std::size_t steps = rows.size() / layout.row_bytes;
  for (const Leaf& leaf : layout.leaves) {
    Tensor tensor;
    tensor.dtype = leaf.dtype;
    tensor.shape = {static_cast<std::int64_t>(steps)};
    if (leaf.space.kind() == SpaceKind::kBox)
      tensor.shape.insert(tensor.shape.end(), leaf.space.shape().begin(), leaf.space.shape().end());
    else if (leaf.count > 1)
      tensor.shape.push_back(leaf.count);
    const std::size_t bytes = static_cast<std::size_t>(leaf.count) * SizeOf(leaf.dtype);
    tensor.bytes.resize(steps * bytes);
    for (std::size_t i = 0; i < steps; ++i)
      std::memcpy(tensor.bytes.data() + i * bytes, rows.data() + i * layout.row_bytes + leaf.offset, bytes);
    file->tensors[leaf.name.empty() ? what : what + "/" + leaf.name] = std::move(tensor);
  }
}

}  // namespace

/// Rows as they came, one after another.
struct Recorder::State {
  TickWorld& world;
  std::size_t b;
  std::vector<std::byte> seen;     // [places] what each agent acts upon
  std::vector<std::uint8_t> acts;  // [places] whether that is known
  std::vector<std::byte> observations, actions;
  std::vector<float> rewards;
  std::vector<std::uint8_t> terminated, truncated;
  std::vector<std::int32_t> slots;

  std::vector<std::int64_t> latest;  // [places] row of the episode under way, -1: none
  bool full = false;

  std::size_t bytes() const { return observations.size() + actions.size() + rewards.size() * kBytesBeside; }
  void Append(const Herd& herd, std::size_t i, float reward, Going going) {
    const auto append = [](std::vector<std::byte>* rows, const std::byte* row, std::size_t bytes) {
      rows->insert(rows->end(), row, row + bytes);
    };
    append(&observations, seen.data() + i * herd.observation_bytes, herd.observation_bytes);
    append(&actions, herd.done.data() + i * herd.action_bytes, herd.action_bytes);
    rewards.push_back(reward);
    terminated.push_back(going == Going::kTerminated ? 1 : 0);
    truncated.push_back(going == Going::kTruncated ? 1 : 0);
    slots.push_back(static_cast<std::int32_t>(i));
    latest[i] = going == Going::kOn ? static_cast<std::int64_t>(slots.size()) - 1 : -1;
  }

  /// What the episode under way would have come to is not known.
  void CutOff(std::size_t i) {
    if (latest[i] >= 0) truncated[static_cast<std::size_t>(latest[i])] = 1;
    latest[i] = -1;
  }
};

Recorder::Recorder(TickWorld& world, std::size_t b)
    : state_(new State{world, b, {}, {}, {}, {}, {}, {}, {}, {}, {}, false}) {
  const BehaviourSpec& behaviour = world.spec().behaviours[b];
  state_->seen.resize(static_cast<std::size_t>(behaviour.slots) * behaviour.observation_layout.row_bytes);
  state_->acts.resize(static_cast<std::size_t>(behaviour.slots));
  state_->latest.assign(state_->acts.size(), -1);
}

Recorder::~Recorder() = default;

void Recorder::Note() {
  State& state = *state_;
  const Herd& herd = state.world.state_->herds[state.b];
  const Cue cue = state.world.cue();
  if (cue == Cue::kWait || state.full) return;
  for (std::size_t i = 0; i < herd.places.size(); ++i) {
    const Place& place = herd.places[i];
    if (cue == Cue::kReset && !place.resets) continue;
    if (cue == Cue::kReset) state.CutOff(i);
    if (cue == Cue::kAct && place.takes_part && state.acts[i] != 0) {
      const AgentId agent = herd.first + static_cast<AgentId>(i);
      const bool out_of_time = state.world.Ending(agent) && place.going == Going::kOn;
      state.Append(herd, i, state.world.Reward(agent), out_of_time ? Going::kTruncated : place.going);
    }
    state.acts[i] = place.joined ? 1 : 0;
    std::memcpy(state.seen.data() + i * herd.observation_bytes, herd.seen.data() + i * herd.observation_bytes,
                herd.observation_bytes);
  }
  if (state.bytes() < kMostRecordedBytes) return;
  state.full = true;
  Log(LogLevel::kWarning, "the demonstration has " + std::to_string(steps()) + " steps and " +
                              std::to_string(kMostRecordedBytes >> 20) + " MiB; nothing is added to it from here on");
}

std::int64_t Recorder::steps() const {
  return static_cast<std::int64_t>(state_->slots.size());
}

Status Recorder::Save(const std::string& path) const {
  const State& state = *state_;
  const BehaviourSpec& behaviour = state.world.spec().behaviours[state.b];
  EnvSpec alone;
  alone.behaviours.push_back(behaviour);
  ModelFile file;
  file.spec_json = "{\"kind\":\"demonstration\",\"behaviours\":" + protocol2::BehavioursJson(alone) + "}";
  PutRows("observations", behaviour.observation_layout, state.observations, &file);
  PutRows("actions", behaviour.action_layout, state.actions, &file);
  const auto steps = this->steps();
  file.tensors["rewards"] = {DType::kF32, {steps}, BytesOfAll(state.rewards)};
  file.tensors["terminated"] = {DType::kU8, {steps}, BytesOfAll(state.terminated)};
  file.tensors["truncated"] = {DType::kU8, {steps}, BytesOfAll(state.truncated)};
  file.tensors["slots"] = {DType::kI32, {steps}, BytesOfAll(state.slots)};
  return file.Save(path);
}

}  // namespace consac::host
