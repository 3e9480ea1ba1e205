// What a RESET and a STEP ask for, judged and carried out. What comes of it: stepper_result.cpp.
#include "server/stepper.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "protocol/protocol2_json.h"

namespace consac {

using protocol2::Autoreset;
using protocol2::Fault;
using protocol2::WordAt;

Stepper::Group::Group(const BehaviourSpec& behaviour)
    : spec(&behaviour),
      agents(behaviour.agents.size()),
      row_bytes(behaviour.observation_layout.row_bytes),
      mask_bytes(behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0),
      action_bytes(behaviour.action_layout.row_bytes),
      whole_rows(behaviour),
      some_rows(behaviour),
      stashed(static_cast<std::size_t>(behaviour.slots) * row_bytes),
      active(static_cast<std::size_t>(behaviour.slots)),
      choices(mask_bytes > 0 ? MaskedChoices(behaviour.action_layout) : std::vector<std::int64_t>()) {
  some_slots.reserve(active.size());
}

namespace {

constexpr std::size_t kStatisticsRoom = std::size_t{32} << 10;  // bytes of a RESULT's

}  // namespace

Stepper::Stepper(VectorEnv& env) : env_(env), spec_(env.spec()), blocks_(env.spec()) {
  request_.Resize(blocks_.step_bytes + blocks_.parameter_bytes());
  pending_.resize(blocks_.environments);
  stepped_.resize(blocks_.environments);
  played_.resize(blocks_.environments);
  begins_.resize(blocks_.environments);
  outdated_.resize(blocks_.environments);
  const std::vector<double> defaults = DefaultsOf(spec_.parameters);
  for (std::size_t world = 0; world < blocks_.environments; ++world)
    parameters_.insert(parameters_.end(), defaults.begin(), defaults.end());
  std::size_t slots = 0;
  for (std::size_t b = 0; b < spec_.behaviours.size(); ++b) {
    Group& group = groups_.emplace_back(spec_.behaviours[b]);
    group.first_slot = slots;
    slots += group.active.size();
    whole_.push_back(group.whole_rows.batch());
    some_.push_back(group.some_rows.batch());
    agents_leave_ = agents_leave_ || !env.present(b).empty();
  }
  // Each value: its slot and itself as text.
  constexpr std::size_t kValueText = 48, kColumnText = 64;
  for (const InfoColumn& column : env.infos())
    info_room_ += 2 * (kColumnText + 6 * column.name.size()) + slots * kValueText;
  if (info_room_ > 0) info_room_ += kColumnText;
  if (env.tells_statistics()) statistics_room_ = kStatisticsRoom;
}

void Stepper::WriteTo(std::byte* payload) {
  payload_ = payload;
  for (std::size_t b = 0; b < whole_.size(); ++b) {
    whole_[b].next_observations = payload_ + blocks_.behaviours[b].observations;
    whole_[b].actions = request_.data() + blocks_.behaviours[b].actions;
    if (groups_[b].mask_bytes > 0)
      whole_[b].next_action_masks = reinterpret_cast<std::uint8_t*>(payload_ + blocks_.behaviours[b].masks);
  }
}

void Stepper::Forget() {
  // Whoever shared this memory may have written anywhere, between blocks and in rows of nobody too.
  std::fill_n(payload_, result_room(), std::byte{0});
  std::fill(pending_.begin(), pending_.end(), std::uint8_t{0});
  begins_next_ = false;
  std::fill(outdated_.begin(), outdated_.end(), std::uint8_t{0});
  SetDefaultParameters(env_);
  env_.TakeStatistics(&noted_);  // of the session before
  for (std::size_t i = 0; i < parameters_.size(); ++i)
    parameters_[i] = spec_.parameters[i % blocks_.parameters].default_value;
}

Status Stepper::SetAutoreset(Autoreset autoreset) {
  if (autoreset != Autoreset::kSameStep) {
    if (!env_.steps_some())
      return Fault("UNSUPPORTED", "this engine begins the next episode in the same step only; ask for same_step");
    for (const Group& group : groups_) {
      if (group.agents > 1 && !agents_leave_)
        return Fault("UNSUPPORTED", "agents of '" + group.spec->name +
                                        "' begin their next episodes each in the same step; no other way is known");
    }
  }
  autoreset_ = autoreset;
  return Status::Ok();
}

bool Stepper::Ended(std::size_t b, std::size_t slot) {
  constexpr std::byte kEnds{protocol2::kTerminated | protocol2::kTruncated};
  return (States(b)[slot] & kEnds) != std::byte{0};
}

bool Stepper::Present(std::size_t b, std::size_t slot) const {
  const std::span<const std::uint8_t> present = env_.present(b);
  return present.empty() || present[slot] != 0;
}

// ---- RESET

namespace {

Status WrongSize(const char* name, std::size_t bytes, std::size_t expected) {
  return Fault("WRONG_SIZE",
               std::string(name) + " has " + std::to_string(bytes) + " bytes, expected " + std::to_string(expected));
}

/// The two words that RESET and STEP begin with.
Status CheckWords(std::span<const std::byte> request, std::uint32_t flags, const char* name) {
  if (request.size() < protocol2::kActiveOffset) return WrongSize(name, request.size(), protocol2::kActiveOffset);
  const std::uint32_t said = WordAt(request, 0), zero = WordAt(request, sizeof(said));
  if ((said & ~flags) != 0 || zero != 0) {
    return Fault("MALFORMED", std::string(name) + " has flags " + std::to_string(said) + " and " +
                                  std::to_string(zero) + " behind them; what is not known must be 0");
  }
  return Status::Ok();
}

}  // namespace

/// A byte for each environment that is 0 or 1.
Status Stepper::CheckChosen(std::span<const std::byte> request, const char* name) {
  for (std::size_t world = 0; world < blocks_.environments; ++world) {
    const auto chosen = std::to_integer<int>(request[protocol2::kActiveOffset + world]);
    if (chosen <= 1) continue;
    blamed_ = static_cast<std::int64_t>(world);
    return Fault("OUT_OF_RANGE", std::string(name) + " says " + std::to_string(chosen) + " for environment " +
                                     std::to_string(world) + "; 0 or 1");
  }
  return Status::Ok();
}

/// In the order of R18.
Status Stepper::CheckReset(std::span<const std::byte> request) {
  CONSAC_RETURN_IF_ERROR(CheckWords(request, KnownFlags(protocol2::kWithSeeds | protocol2::kWithOptions), "RESET"));
  const std::uint32_t flags = WordAt(request, 0);
  std::size_t end = (flags & protocol2::kWithSeeds) != 0 ? blocks_.options : blocks_.seeds;
  const std::size_t options = end + sizeof(std::uint32_t);
  std::span<const std::byte> text;
  if ((flags & protocol2::kWithOptions) != 0) {
    if (request.size() < options) return WrongSize("RESET", request.size(), options);
    const std::size_t length = WordAt(request, end);
    end = protocol2::AlignBlock(options + length);
    if (request.size() >= end) text = request.subspan(options, length);
  }
  if ((flags & protocol2::kWithParameters) != 0) end += blocks_.parameter_bytes();
  if (request.size() != end) return WrongSize("RESET", request.size(), end);
  CONSAC_RETURN_IF_ERROR(CheckChosen(request, "RESET"));
  for (std::size_t world = 0; world < blocks_.environments && (flags & protocol2::kWithSeeds) != 0; ++world) {
    std::int64_t seed = 0;
    std::memcpy(&seed, request.data() + blocks_.seeds + world * sizeof(seed), sizeof(seed));
    if (seed >= 0 || request[protocol2::kActiveOffset + world] == std::byte{0}) continue;
    blamed_ = static_cast<std::int64_t>(world);
    return Fault("OUT_OF_RANGE",
                 "seed " + std::to_string(seed) + " of environment " + std::to_string(world) + "; seeds are 0 or more");
  }
  if ((flags & protocol2::kWithOptions) != 0) CONSAC_RETURN_IF_ERROR(protocol2::ParseObject(text).status());
  return CheckParameters(ParametersIn(request));
}

std::vector<double> Stepper::ParametersIn(std::span<const std::byte> request) const {
  if ((WordAt(request, 0) & protocol2::kWithParameters) == 0) return {};
  std::vector<double> values(blocks_.environments * blocks_.parameters);
  std::memcpy(values.data(), request.data() + request.size() - blocks_.parameter_bytes(), blocks_.parameter_bytes());
  return values;
}

Status Stepper::CheckParameters(std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    const Status legal = CheckValue(spec_.parameters[i % blocks_.parameters], values[i]);
    if (legal.ok()) continue;
    blamed_ = static_cast<std::int64_t>(i / blocks_.parameters);
    return Fault(legal.code() == StatusCode::kNonFinite ? "NON_FINITE" : "OUT_OF_RANGE",
                 "environment " + std::to_string(blamed_) + ": " + legal.message());
  }
  return Status::Ok();
}

void Stepper::SetParameters(std::span<const double> values) {
  if (values.empty()) return;
  for (std::size_t world = 0; world < blocks_.environments; ++world) {
    const std::span<const double> own = values.subspan(world * blocks_.parameters, blocks_.parameters);
    bool changes = false;
    for (std::size_t i = 0; i < own.size(); ++i) {
      double& now = parameters_[world * blocks_.parameters + i];
      if (std::isnan(own[i]) || own[i] == now) continue;
      now = own[i];
      changes = true;
    }
    if (!changes) continue;
    env_.SetParameters(static_cast<std::int32_t>(world), own);
    outdated_[world] = pending_[world];
  }
}

Status Stepper::Reset(std::span<const std::byte> shared, bool first, std::uint64_t seed) {
  // Copied, since in shared memory it might change while it is looked at.
  const std::vector<std::byte> request(shared.begin(), shared.end());
  CONSAC_RETURN_IF_ERROR(CheckReset(request));
  std::vector<std::uint64_t> seeds;
  if ((WordAt(request, 0) & protocol2::kWithSeeds) != 0) {
    seeds.resize(blocks_.environments);
    std::memcpy(seeds.data(), request.data() + blocks_.seeds, seeds.size() * sizeof(seeds[0]));
  }
  bool all = true;
  for (std::size_t world = 0; world < blocks_.environments; ++world) {
    stepped_[world] = std::to_integer<std::uint8_t>(request[protocol2::kActiveOffset + world]);
    all = all && stepped_[world] != 0;
  }
  if (first && !all) return Fault("BAD_STATE", "the first RESET is of every environment");
  const std::vector<double> before = parameters_;
  SetParameters(ParametersIn(request));
  const Status begun = Begin(seeds, first, all, seed);
  if (!begun.ok()) SetParameters(before);
  return begun;
}

Status Stepper::Begin(const std::vector<std::uint64_t>& seeds, bool first, bool all, std::uint64_t seed) {
  BeginResult();
  std::fill(begins_.begin(), begins_.end(), std::uint8_t{0});
  own_seed_ = first ? seed : own_seed_ + blocks_.environments;
  if (!first || !seeds.empty()) return ResetChosen(seeds, all);
  BeginAll(own_seed_);
  return Status::Ok();
}

void Stepper::BeginAll(std::uint64_t seed) {
  env_.Reset(seed, whole_);
  std::fill(begins_.begin(), begins_.end(), std::uint8_t{1});
}

void Stepper::FinishReset() {
  for (std::size_t world = 0; world < blocks_.environments; ++world) {
    if (begins_[world] != 0) MarkFirst(world);
  }
  FinishResult(Infos::kWithout);  // of no step
}

/// The environments that stepped_ names; `seeds` may be empty. An engine that can only begin all of them together
/// takes seeds that follow one another, and where it is given none those that its session has not given yet.
Status Stepper::ResetChosen(const std::vector<std::uint64_t>& seeds, bool all) {
  for (std::size_t world = 0; world < blocks_.environments; ++world) {
    if (stepped_[world] == 0) continue;
    const Status reset = ResetOne(world, seeds.empty() ? std::nullopt : std::optional<std::uint64_t>(seeds[world]));
    if (reset.ok()) continue;
    bool follow = all && world == 0;
    for (std::size_t i = 1; i < seeds.size(); ++i) follow = follow && seeds[i] == seeds[0] + i;
    if (!follow) return reset;
    BeginAll(seeds.empty() ? own_seed_ : seeds[0]);
    return Status::Ok();
  }
  return Status::Ok();
}

Status Stepper::ResetOne(std::size_t world, std::optional<std::uint64_t> seed) {
  if (!seed.has_value() && pending_[world] != 0 && outdated_[world] == 0) {
    BeginNext(world);
    return Status::Ok();
  }
  if (!env_.ResetWorld(static_cast<std::int32_t>(world), seed, whole_))
    return Fault("UNSUPPORTED", "this engine cannot reset single environments or take seeds");
  begins_[world] = 1;
  return Status::Ok();
}

// ---- STEP

Status Stepper::ReadStep(std::span<const std::byte> request) {
  // Copied, since in shared memory it might change while it is looked at.
  const std::size_t taken = std::min(request.size(), blocks_.step_bytes + blocks_.parameter_bytes());
  std::memcpy(request_.data(), request.data(), taken);
  CONSAC_RETURN_IF_ERROR(CheckWords({request_.data(), taken}, KnownFlags(0), "STEP"));
  const bool sets = (WordAt({request_.data(), taken}, 0) & protocol2::kWithParameters) != 0;
  const std::size_t expected = blocks_.step_bytes + (sets ? blocks_.parameter_bytes() : 0);
  if (request.size() != expected) return WrongSize("STEP", request.size(), expected);
  CONSAC_RETURN_IF_ERROR(CheckChosen({request_.data(), taken}, "STEP"));
  step_parameters_ = ParametersIn({request_.data(), taken});
  CONSAC_RETURN_IF_ERROR(CheckParameters(step_parameters_));
  const std::byte* wanted = request_.data() + protocol2::kActiveOffset;
  stepped_count_ = 0;
  begins_next_ = false;
  for (std::size_t world = 0; world < blocks_.environments; ++world) {
    const bool chosen = wanted[world] != std::byte{0};
    if (chosen && pending_[world] != 0 && autoreset_ == Autoreset::kDisabled) {
      blamed_ = static_cast<std::int64_t>(world);
      return Fault("RESET_REQUIRED", "environment " + std::to_string(world) + " has ended; reset it first");
    }
    stepped_[world] = chosen && pending_[world] == 0 ? 1 : 0;
    begins_next_ = begins_next_ || (chosen && pending_[world] != 0);
    stepped_count_ += stepped_[world];
  }
  if (stepped_count_ < blocks_.environments && !env_.steps_some())
    return Fault("UNSUPPORTED", "this engine steps all of its environments together");
  return CheckActions();
}

namespace {

/// What an agent of which the trainer does not know yet does: 0, or what is next to it in the space.
void RestAction(const Layout& layout, std::byte* row) {
  for (const Leaf& leaf : layout.leaves) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const auto [low, high] = ElementBounds(leaf, i);
      WriteElement(leaf, row, i, std::clamp(0.0, low, high));
    }
  }
}

}  // namespace

Status Stepper::CheckActions() {
  for (std::size_t b = 0; b < groups_.size(); ++b) {
    const Group& group = groups_[b];
    for (std::int32_t slot = 0; slot < group.spec->slots; ++slot) {
      const auto row = static_cast<std::size_t>(slot);
      if (stepped_[group.WorldOf(slot)] == 0) continue;
      std::byte* action = whole_[b].actions + row * group.action_bytes;
      if (group.active[row] == 0) {
        if (Present(b, row)) RestAction(group.spec->action_layout, action);
        continue;
      }
      const Status legal = CheckRow(group.spec->action_layout, action);
      if (legal.ok()) continue;
      blamed_ = static_cast<std::int64_t>(group.WorldOf(slot));
      return Fault(legal.code() == StatusCode::kNonFinite ? "NON_FINITE" : "OUT_OF_RANGE",
                   "the action of slot " + std::to_string(slot) + " of '" + group.spec->name + "': " + legal.message());
    }
  }
  return Status::Ok();
}

void Stepper::Step() {
  BeginResult();
  agents_stepped_ = 0;
  SetParameters(step_parameters_);
  std::fill(begins_.begin(), begins_.end(), std::uint8_t{0});
  if (begins_next_) {
    const std::byte* wanted = request_.data() + protocol2::kActiveOffset;
    for (std::size_t world = 0; world < blocks_.environments; ++world) {
      if (wanted[world] != std::byte{0} && pending_[world] != 0) BeginNext(world);
    }
  }
  if (stepped_count_ == blocks_.environments) {
    env_.Step(whole_);
  } else if (stepped_count_ > 0) {
    StepSome();
  }
}

void Stepper::FinishStep() {
  for (std::size_t world = 0; world < blocks_.environments && begins_next_; ++world) {
    if (begins_[world] != 0) MarkFirst(world);
  }
  for (std::size_t b = 0; b < groups_.size() && stepped_count_ > 0; ++b) {
    const bool all = stepped_count_ == blocks_.environments;
    if (!all) Scatter(b);
    WriteOutcomes(b, all ? whole_[b] : some_[b]);
  }
  if (autoreset_ != Autoreset::kSameStep) {
    for (std::size_t world = 0; world < blocks_.environments; ++world) {
      if (stepped_[world] != 0 && EpisodeOver(world)) HideNextEpisode(world);
    }
  }
  if (agents_leave_) {
    for (std::size_t b = 0; b < groups_.size(); ++b) WriteArrivals(b);
  }
  FinishResult(Infos::kWith);
}

/// Some environments only: their rows lie together for the world, and are put in their places afterwards.
void Stepper::StepSome() {
  for (std::size_t b = 0; b < groups_.size(); ++b) {
    Group& group = groups_[b];
    group.some_slots.clear();
    for (std::int32_t slot = 0; slot < group.spec->slots; ++slot) {
      if (stepped_[group.WorldOf(slot)] == 0) continue;
      std::memcpy(some_[b].actions + group.some_slots.size() * group.action_bytes,
                  whole_[b].actions + static_cast<std::size_t>(slot) * group.action_bytes, group.action_bytes);
      group.some_slots.push_back(slot);
    }
    some_[b].slots = group.some_slots;
  }
  env_.Step(some_);
}

void Stepper::Scatter(std::size_t b) {
  const Group& group = groups_[b];
  for (std::size_t i = 0; i < group.some_slots.size(); ++i) {
    const auto slot = static_cast<std::size_t>(group.some_slots[i]);
    if (agents_leave_ && !Present(b, slot)) continue;
    std::memcpy(whole_[b].next_observations + slot * group.row_bytes, some_[b].next_observations + i * group.row_bytes,
                group.row_bytes);
    if (group.mask_bytes == 0) continue;
    std::memcpy(whole_[b].next_action_masks + slot * group.mask_bytes,
                some_[b].next_action_masks + i * group.mask_bytes, group.mask_bytes);
  }
}

}  // namespace consac
