#pragma once
// RESET, STEP and RELABEL as the conformance cases of a server want them, right ones and wrong ones, made from SPEC.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "cli/conformance_frames.h"
#include "cli/conformance_illegal.h"
#include "cli/conformance_setting.h"
#include "consac/base/rng.h"
#include "consac/protocol/protocol2.h"
#include "consac/protocol/relabel.h"
#include "consac/space/layout.h"

namespace consac::cli {

/// Payloads of RESET, STEP and RELABEL for what a SPEC offers, right ones and wrong ones.
class Payloads {
 public:
  Payloads() = default;
  explicit Payloads(const EnvSpec& env) : env_(&env), blocks_(env) {}

  /// What the cases call `kind`. `result`: the latest RESULT, whose masks say what is legal. `leaf`: of illegal
  /// actions.
  std::string Of(const std::string& kind, const std::string& result, const std::string& leaf = "") const {
    if (const std::size_t set = kind.find(kSet); set != std::string::npos)
      return WithParameters(Of(kind.substr(0, set), result, leaf), kind.substr(set + kSet.size()));
    if (kind == "empty") return "";
    if (kind == "none") return Reset(0, 0);
    if (kind == "all") return Reset(0, 1);
    if (kind == "two reset") return With(Reset(0, 1), protocol2::kActiveOffset, 2);
    if (kind == "first reset") return OnlyFirst(Reset(0, 0), 1);
    if (kind == "unknown flag") return With(Reset(0, 1), 0, 64);
    if (kind == "seeded") return Reset(protocol2::kWithSeeds, 1);
    if (kind == "seeds from 0") return Seeded(Reset(protocol2::kWithSeeds, 1), 0, 1);
    if (kind == "negative seed") return With(Reset(protocol2::kWithSeeds, 1), blocks_.seeds + 7, 0x80);
    if (kind == "negative last seed") return With(Reset(protocol2::kWithSeeds, 1), blocks_.options - 1, 0x80);
    if (kind == "first seeded") return FirstSeeded(Reset(protocol2::kWithSeeds, 0));
    if (kind == "all, padding") return WithPadding(Reset(0, 1), blocks_.seeds, 0);
    if (kind == "options, padding") return WithPadding(Options("{\"level\":1}"), blocks_.seeds, 4 + 11);
    if (kind == "legal, padding") return PaddedStep(Step(1, result));
    if (kind == "options") return Options("{\"difficulty\":1}");
    if (kind == "bad options") return Options("{\"difficulty\"");
    if (kind == "short reset") return Reset(0, 1).substr(0, blocks_.seeds - 8);
    if (kind == "long reset") return Reset(0, 1) + std::string(8, '\0');
    if (kind == "short") return Step(1, result).substr(0, blocks_.step_bytes - 1);
    if (kind == "long") return Step(1, result) + std::string(8, '\0');
    if (kind == "nonzero") return With(Step(1, result), 4, 1);
    if (kind == "two") return With(Step(1, result), protocol2::kActiveOffset, 2);
    if (kind == "nobody") return Step(0, result);
    if (kind == "unknown flag, long") return With(Reset(0, 1), 0, 64) + std::string(3, '\0');
    if (kind == "nonzero, short") return With(Step(1, result), 4, 1).substr(0, blocks_.step_bytes - 1);
    if (kind == "two, short")
      return With(Step(1, result), protocol2::kActiveOffset, 2).substr(0, blocks_.step_bytes - 1);
    if (kind == "four bytes") return std::string(4, '\0');
    if (kind == "no options") return Options("");
    if (kind == "first") return OnlyFirst(Step(0, result), 1);
    if (kind == "others") return OnlyFirst(Step(1, result), 0);
    if (IsSpoilt(kind)) return Spoilt(Step(1, result), result, blocks_.environments, kind, leaf).first;
    if (kind == "illegal but not stepped") return Spoilt(OnlyFirst(Step(1, result), 0), result, 1, kind, leaf).first;
    if (kind == "illegal of the absent") return IllegalOfAbsent(Step(1, result), result);
    if (kind == "largest seeds") return LargestSeeds(Reset(protocol2::kWithSeeds, 1));
    if (kind == "seeded options")
      return With(Reset(protocol2::kWithSeeds, 1), 0, protocol2::kWithSeeds | protocol2::kWithOptions) +
             Options("{\"difficulty\":1}").substr(blocks_.seeds);
    if (kind.starts_with("goals")) return Goals(kind);
    if (kind == "scattered seeds") return Seeded(Reset(protocol2::kWithSeeds, 1), 3 * last_world() + 100, -3);
    return Step(1, result);
  }

  /// Whether a STEP of that kind has one action that must be refused.
  static bool IsSpoilt(const std::string& kind) {
    return kind == "illegal" || kind == kIllegalOfLast || kind == "NaN" || kind == "infinity";
  }
  /// The world of that action; -1 where nobody takes part whose action can be so.
  std::int64_t WorldAtFault(const std::string& kind, const std::string& result, const std::string& leaf) const {
    return Spoilt(Step(1, result), result, blocks_.environments, kind, leaf).second;
  }

  std::int64_t last_world() const { return static_cast<std::int64_t>(blocks_.environments) - 1; }

  /// Whether a RELABEL can be so: where no observation has such a number, or every behaviour has goals, it cannot.
  bool CanBeAsked(const std::string& kind) const {
    if (kind == "goals of others") return Goalless() < env_->behaviours.size();
    if (kind == "goals of the last") return LastGoal() != Goal();
    std::vector<std::byte> row(Pursuing().observation_layout.row_bytes);
    return SpoilGoals(kind, row.data());
  }
  /// Rows of the first behaviour with goals that the steps of `result` led to, and what they paid: to `rows`, one
  /// behind the other, and `rewards`.
  void AddPaid(const std::string& result, std::string* rows, std::vector<double>* rewards) const {
    const BehaviourSpec& behaviour = Pursuing();
    const protocol2::BehaviourBlocks& at = blocks_.behaviours[Goal()];
    const std::size_t row_bytes = behaviour.observation_layout.row_bytes;
    for (std::size_t slot = 0; slot < static_cast<std::size_t>(behaviour.slots); ++slot) {
      if (result[at.states + slot] != protocol2::kActive) continue;  // R67; who ended has a final row
      rows->append(result, at.observations + slot * row_bytes, row_bytes);
      double reward = 0.0;
      std::memcpy(&reward, result.data() + at.rewards + slot * sizeof(reward), sizeof(reward));
      rewards->push_back(reward);
    }
  }
  /// A RELABEL of such rows.
  std::string GoalsAsTheyWere(const std::string& rows) const {
    const auto count = static_cast<std::int64_t>(rows.size() / Pursuing().observation_layout.row_bytes);
    std::string payload(protocol2::RelabelBytes(Pursuing(), count), '\0');
    protocol2::WriteRelabel(*env_, {Goal(), count, reinterpret_cast<const std::byte*>(rows.data())},
                            reinterpret_cast<std::byte*>(payload.data()));
    return payload;
  }
  /// Rows of a RELABEL, as it says.
  static std::int64_t RowsOf(const std::string& relabel) {
    std::uint32_t rows = 0;
    if (relabel.size() >= 2 * sizeof(rows)) std::memcpy(&rows, relabel.data() + sizeof(rows), sizeof(rows));
    return rows;
  }

  /// Whether some action can be outside its space by a leaf of a kind (a space's type or BOOL; "" is any).
  bool CanBeIllegal(const std::string& kind) const {
    for (std::size_t b = 0; b < blocks_.behaviours.size(); ++b) {
      std::vector<std::byte> row(env_->behaviours[b].action_layout.row_bytes);
      if (MakeIllegal(env_->behaviours[b].action_layout, kind, row.data())) return true;
    }
    return false;
  }

  /// The longest of the frames that have one length each, or a longest: STEP, RESET with seeds, RESULT without infos.
  std::size_t longest() const {
    return std::max({blocks_.step_bytes + blocks_.parameter_bytes(), blocks_.options + blocks_.parameter_bytes(),
                     blocks_.largest_result});
  }

  /// RESET of the environments for which `chosen` is true.
  template <class Chosen>
  std::string ResetWhere(Chosen chosen) const {
    std::string payload = Reset(0, 0);
    for (std::size_t i = 0; i < blocks_.environments; ++i)
      payload[protocol2::kActiveOffset + i] = static_cast<char>(chosen(i));
    return payload;
  }

 private:
  static constexpr const char* kIllegalOfLast = "illegal of the last";

  /// With flag 4 and parameters behind.
  std::string WithParameters(std::string payload, const std::string& how) const {
    payload[0] = static_cast<char>(payload[0] | static_cast<char>(protocol2::kWithParameters));
    return payload + SettingBlock(env_->parameters, blocks_.environments, how);
  }

  static std::string With(std::string payload, std::size_t at, int value) {
    payload[at] = static_cast<char>(value);
    return payload;
  }
  static std::string OnlyFirst(std::string payload, int value) {
    return With(std::move(payload), protocol2::kActiveOffset, value);
  }

  std::string Reset(std::uint32_t flags, int chosen) const {
    const bool seeded = (flags & protocol2::kWithSeeds) != 0;
    std::string payload(seeded ? blocks_.options : blocks_.seeds, '\0');
    std::memcpy(payload.data(), &flags, sizeof(flags));
    std::memset(payload.data() + protocol2::kActiveOffset, chosen, blocks_.environments);
    for (std::size_t i = 0; seeded && i < blocks_.environments; ++i) {
      const std::uint64_t seed = 11 + i;
      std::memcpy(payload.data() + blocks_.seeds + i * sizeof(seed), &seed, sizeof(seed));
    }
    return payload;
  }

  /// The first environment alone is reset; seeds of the others are negative, and not looked at.
  std::string FirstSeeded(std::string payload) const {
    for (std::size_t i = 1; i < blocks_.environments; ++i)
      payload[blocks_.seeds + i * sizeof(std::uint64_t) + 7] = static_cast<char>(0x80);
    return OnlyFirst(std::move(payload), 1);
  }

  /// Every byte of padding is 255: behind the bytes of the environments, and behind the `used` bytes of the block at
  /// `from`.
  std::string WithPadding(std::string payload, std::size_t from, std::size_t used) const {
    for (std::size_t at = protocol2::kActiveOffset + blocks_.environments; at < blocks_.seeds; ++at)
      payload[at] = '\xff';
    for (std::size_t at = from + used; at < payload.size(); ++at) payload[at] = '\xff';
    return payload;
  }
  /// The same of a STEP, whose action rows have padding of their own.
  std::string PaddedStep(const std::string& payload) const {
    std::string padded = payload.substr(0, protocol2::kActiveOffset + blocks_.environments);
    padded.resize(payload.size(), '\xff');
    for (std::size_t b = 0; b < blocks_.behaviours.size(); ++b)
      CopyRows(env_->behaviours[b].action_layout, static_cast<std::size_t>(env_->behaviours[b].slots), payload,
               blocks_.behaviours[b].actions, &padded);
    return padded;
  }
  /// What has a name in `count` rows at `at`.
  static void CopyRows(const Layout& layout, std::size_t count, const std::string& from, std::size_t at,
                       std::string* to) {
    for (std::size_t row = at; row < at + count * layout.row_bytes; row += layout.row_bytes) {
      for (const Leaf& leaf : layout.leaves) {
        const std::size_t place = row + static_cast<std::size_t>(leaf.offset);
        std::memcpy(&(*to)[place], &from[place], static_cast<std::size_t>(leaf.count) * SizeOf(leaf.dtype));
      }
    }
  }

  /// The first behaviour with goals; the last of these; the first without, and how many there are where all have.
  std::size_t Goal() const {
    for (std::size_t b = 0; b < env_->behaviours.size(); ++b)
      if (protocol2::HasGoals(env_->behaviours[b].observation_layout)) return b;
    return 0;
  }
  std::size_t LastGoal() const {
    std::size_t b = env_->behaviours.size() - 1;
    while (b > 0 && !protocol2::HasGoals(env_->behaviours[b].observation_layout)) --b;
    return b;
  }
  std::size_t Goalless() const {
    std::size_t b = 0;
    while (b < env_->behaviours.size() && protocol2::HasGoals(env_->behaviours[b].observation_layout)) ++b;
    return b;
  }
  const BehaviourSpec& Pursuing() const { return env_->behaviours[Goal()]; }
  /// The same rows, of which only what lies in the goals, or only the rest, has a name.
  static Layout Part(Layout layout, bool of_goals) {
    std::erase_if(layout.leaves, [&](const Leaf& leaf) {
      return (PathBelow(kAchievedGoal, leaf) || PathBelow(kDesiredGoal, leaf)) != of_goals;
    });
    return layout;
  }
  bool SpoilGoals(const std::string& kind, std::byte* row) const {
    const Layout goals = Part(Pursuing().observation_layout, true), rest = Part(Pursuing().observation_layout, false);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (kind == "goals, NaN") return MakeNonFinite(goals, nan, row);
    if (kind == "goals, infinity") return MakeNonFinite(goals, std::numeric_limits<double>::infinity(), row);
    if (kind == "goals, far") return MakeFar(goals, row);
    if (kind == "goals, beyond") return MakeIllegal(goals, "box", row);
    if (kind == "goals, rest illegal") return MakeNonFinite(rest, nan, row) || MakeIllegal(rest, "", row);
    if (kind != "goals, illegal") return true;
    return MakeIllegal(goals, "discrete", row) || MakeIllegal(goals, "multi_discrete", row) ||
           MakeIllegal(goals, "multi_binary", row);
  }
  /// What was wanted is as far away as its numbers can be.
  static bool MakeFar(Layout goals, std::byte* row) {
    std::erase_if(goals.leaves, [](const Leaf& leaf) { return !PathBelow(kDesiredGoal, leaf); });
    const auto far = static_cast<double>(std::numeric_limits<float>::max());
    return MakeNonFinite(goals, far, row);
  }
  /// A RELABEL of one row of its space again and again: twice, or as often as `kind` says.
  std::string Goals(const std::string& kind) const {
    const std::size_t goal = kind == "goals of the last" ? LastGoal() : Goal();
    const BehaviourSpec& behaviour = env_->behaviours[goal];
    const Layout& layout = behaviour.observation_layout;
    const std::int64_t most = protocol2::MostRelabelledRows(behaviour, protocol2::kLargestFrame);
    const std::int64_t rows = kind == "goals, none" ? 0 : kind == "goals, 1 MiB" ? most : 2;
    std::vector<std::byte> seen(static_cast<std::size_t>(std::max<std::int64_t>(rows, 1)) * layout.row_bytes);
    Rng rng(1, StreamId("conformance"));
    SampleRow(layout, rng, seen.data());
    for (std::size_t at = layout.row_bytes; at < seen.size(); at += layout.row_bytes)
      std::memcpy(seen.data() + at, seen.data(), layout.row_bytes);
    (void)SpoilGoals(kind, seen.data() + seen.size() - layout.row_bytes);
    std::string payload(protocol2::RelabelBytes(behaviour, rows), '\0');
    protocol2::WriteRelabel(*env_, {goal, rows, seen.data()}, reinterpret_cast<std::byte*>(payload.data()));
    if (kind == "goals, padding") {
      std::string padded = payload.substr(0, 8);
      padded.resize(payload.size(), '\xff');
      CopyRows(layout, static_cast<std::size_t>(rows), payload, 8, &padded);
      return padded;
    }
    if (kind == "goals, short") payload.resize(payload.size() - 8);
    if (kind == "goals, long") payload.resize(payload.size() + 8);
    if (kind == "goals of nobody") std::memset(payload.data(), 0xff, 4);
    if (kind == "goals of others") {
      const auto place = static_cast<std::uint32_t>(Goalless());
      std::memcpy(payload.data(), &place, sizeof(place));
    }
    if (kind == "goals, without end") std::memset(payload.data() + 4, 0xff, 4);
    return payload;
  }

  std::string Options(const std::string& text) const {
    std::string payload = With(Reset(0, 1), 0, protocol2::kWithOptions);
    const auto length = static_cast<std::uint32_t>(text.size());
    payload.append(reinterpret_cast<const char*>(&length), sizeof(length)).append(text);
    payload.resize(protocol2::AlignBlock(payload.size()));
    return payload;
  }

  /// Legal actions, the same each time.
  std::string Step(int chosen, const std::string& result) const {
    std::string payload(blocks_.step_bytes, '\0');
    std::memset(payload.data() + protocol2::kActiveOffset, chosen, blocks_.environments);
    Rng rng(1, StreamId("conformance"));
    for (std::size_t b = 0; b < blocks_.behaviours.size(); ++b) {
      const BehaviourSpec& behaviour = env_->behaviours[b];
      const Layout& layout = behaviour.action_layout;
      auto* row = reinterpret_cast<std::byte*>(payload.data()) + blocks_.behaviours[b].actions;
      const auto* mask = reinterpret_cast<const std::uint8_t*>(result.data()) + blocks_.behaviours[b].masks;
      for (std::int32_t slot = 0; slot < behaviour.slots; ++slot, row += layout.row_bytes, mask += layout.mask_bytes) {
        SampleRow(layout, rng, row);
        if (behaviour.masks_actions && result.size() >= blocks_.result_bytes) MakeLegal(layout, mask, row);
      }
    }
    return payload;
  }

  /// The behaviour's first slot that takes part, within the first `worlds`, or its last; -1 where there is none.
  std::int64_t SpoiltSlot(std::size_t b, const std::string& result, std::size_t worlds, bool last) const {
    std::int64_t found = -1;
    for (std::size_t slot = 0; slot < worlds * env_->behaviours[b].agents.size() && (last || found < 0); ++slot) {
      if ((result[blocks_.behaviours[b].states + slot] & protocol2::kActive) != 0)
        found = static_cast<std::int64_t>(slot);
    }
    return found;
  }
  std::byte* ActionOf(std::string& payload, std::size_t b, std::int64_t slot) const {
    return reinterpret_cast<std::byte*>(payload.data()) + blocks_.behaviours[b].actions +
           static_cast<std::size_t>(slot) * env_->behaviours[b].action_layout.row_bytes;
  }

  /// The first agent that takes part, of the first `worlds`, and whose action can be so, does what cannot be done, or
  /// the last of its behaviour; with its world, -1 where there is none.
  std::pair<std::string, std::int64_t> Spoilt(std::string payload, const std::string& result, std::size_t worlds,
                                              const std::string& kind, const std::string& leaf) const {
    for (std::size_t b = 0; b < blocks_.behaviours.size() && result.size() >= blocks_.result_bytes; ++b) {
      const BehaviourSpec& behaviour = env_->behaviours[b];
      const std::int64_t slot = SpoiltSlot(b, result, worlds, kind == kIllegalOfLast);
      if (slot >= 0 && Spoil(behaviour.action_layout, kind, leaf, ActionOf(payload, b, slot)))
        return {std::move(payload), slot / static_cast<std::int64_t>(behaviour.agents.size())};
    }
    return {std::move(payload), -1};
  }
  static bool Spoil(const Layout& layout, const std::string& kind, const std::string& leaf, std::byte* row) {
    if (kind == "NaN") return MakeNonFinite(layout, std::numeric_limits<double>::quiet_NaN(), row);
    if (kind == "infinity") return MakeNonFinite(layout, std::numeric_limits<double>::infinity(), row);
    return MakeIllegal(layout, leaf, row);
  }

  /// Nobody who takes no part does what can be done.
  std::string IllegalOfAbsent(std::string payload, const std::string& result) const {
    for (std::size_t b = 0; b < blocks_.behaviours.size() && result.size() >= blocks_.result_bytes; ++b) {
      for (std::int64_t slot = 0; slot < env_->behaviours[b].slots; ++slot) {
        const char state = result[blocks_.behaviours[b].states + static_cast<std::size_t>(slot)];
        if ((state & protocol2::kActive) == 0)
          MakeIllegal(env_->behaviours[b].action_layout, "", ActionOf(payload, b, slot));
      }
    }
    return payload;
  }

  /// Seeds from `first` on, of which each is `apart` more than the one before.
  std::string Seeded(std::string payload, std::int64_t first, std::int64_t apart) const {
    for (std::size_t i = 0; i < blocks_.environments; ++i, first += apart)
      std::memcpy(payload.data() + blocks_.seeds + i * sizeof(first), &first, sizeof(first));
    return payload;
  }

  std::string LargestSeeds(std::string payload) const {
    for (std::size_t i = 0; i < blocks_.environments; ++i) {
      const std::int64_t seed = std::numeric_limits<std::int64_t>::max();
      std::memcpy(payload.data() + blocks_.seeds + i * sizeof(seed), &seed, sizeof(seed));
    }
    return payload;
  }

  const EnvSpec* env_ = nullptr;
  protocol2::Blocks blocks_;
};

}  // namespace consac::cli
