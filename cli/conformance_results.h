#pragma once
// RESULTs beside one another, as the conformance cases of a server compare them: all that is looked at, or what is said
// of one environment.

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "consac/protocol/protocol2.h"

namespace consac::cli {

/// The RESULTs of what a SPEC offers, which outlives this.
class Results {
 public:
  Results() = default;
  explicit Results(const EnvSpec& env) : env_(&env), blocks_(env) {}

  /// A RESULT without what is not looked at (rows of slots without 16, 1 and 2, mask rows of slots without 16), without
  /// infos, statistics and the time that the engine took.
  std::string LookedAt(std::string result) const {
    result = WithoutTexts(std::move(result));
    for (std::size_t b = 0; b < blocks_.behaviours.size() && result.size() >= blocks_.result_bytes; ++b) {
      const protocol2::BehaviourBlocks& at = blocks_.behaviours[b];
      for (std::size_t slot = 0; slot < static_cast<std::size_t>(env_->behaviours[b].slots); ++slot) {
        const int state = result[at.states + slot];
        if (!IsSeen(state)) std::memset(result.data() + at.observations + slot * RowBytes(b), 0, RowBytes(b));
        if ((state & protocol2::kActive) == 0)
          std::memset(result.data() + at.masks + slot * MaskBytes(b), 0, MaskBytes(b));
      }
    }
    return result;
  }

  /// What a RESULT says of one environment and is looked at, but for final rows and what groups are paid.
  std::string OfEnvironment(const std::string& result, std::size_t environment) const {
    std::string said;
    for (std::size_t b = 0; b < blocks_.behaviours.size() && result.size() >= blocks_.result_bytes; ++b) {
      const protocol2::BehaviourBlocks& at = blocks_.behaviours[b];
      const std::size_t agents = env_->behaviours[b].agents.size();
      for (std::size_t slot = environment * agents; slot < (environment + 1) * agents; ++slot) {
        const int state = result[at.states + slot];
        if (IsSeen(state)) said.append(result, at.observations + slot * RowBytes(b), RowBytes(b));
        if ((state & protocol2::kActive) != 0) said.append(result, at.masks + slot * MaskBytes(b), MaskBytes(b));
        said.append(result, at.rewards + slot * sizeof(double), sizeof(double));
        said.append(result, at.states + slot, 1);
      }
    }
    return said;
  }

  /// Whether some agent of the environment has ended with that RESULT.
  bool Ends(const std::string& result, std::size_t environment) const {
    bool ends = false;
    for (std::size_t b = 0; b < blocks_.behaviours.size() && result.size() >= blocks_.result_bytes; ++b) {
      const std::size_t agents = env_->behaviours[b].agents.size();
      for (std::size_t slot = environment * agents; slot < (environment + 1) * agents; ++slot)
        ends = ends || (result[blocks_.behaviours[b].states + slot] & kEnds) != 0;
    }
    return ends;
  }

  /// Whether some agent of the environment begins an episode with that RESULT.
  bool Begins(const std::string& result, std::size_t environment) const {
    bool begins = false;
    for (std::size_t b = 0; b < blocks_.behaviours.size() && result.size() >= blocks_.result_bytes; ++b) {
      const std::size_t agents = env_->behaviours[b].agents.size();
      for (std::size_t slot = environment * agents; slot < (environment + 1) * agents; ++slot)
        begins = begins || (result[blocks_.behaviours[b].states + slot] & protocol2::kFirst) != 0;
    }
    return begins;
  }

  /// Whether, with `same_step`, an episode of the environment is over with that RESULT (section 8): some agent has
  /// ended or vanished, and nobody goes on with it. Or that of an agent which has episodes of its own.
  bool IsOver(const std::string& result, std::size_t environment) const {
    bool goes_on = false, begins_anew = false;
    for (std::size_t b = 0; b < blocks_.behaviours.size() && result.size() >= blocks_.result_bytes; ++b) {
      const std::size_t agents = env_->behaviours[b].agents.size();
      for (std::size_t slot = environment * agents; slot < (environment + 1) * agents; ++slot) {
        const int state = result[blocks_.behaviours[b].states + slot];
        goes_on = goes_on || (state & (protocol2::kActive | protocol2::kFirst)) == protocol2::kActive;
        begins_anew = begins_anew || ((state & kEnds) != 0 && (state & protocol2::kFirst) != 0);
      }
    }
    return begins_anew || (Ends(result, environment) && !goes_on);
  }

  std::size_t environments() const { return blocks_.environments; }

 private:
  static constexpr int kEnds = protocol2::kTerminated | protocol2::kTruncated;

  static bool IsSeen(int state) { return (state & (protocol2::kActive | kEnds)) != 0; }
  std::size_t RowBytes(std::size_t b) const { return env_->behaviours[b].observation_layout.row_bytes; }
  std::size_t MaskBytes(std::size_t b) const {
    const BehaviourSpec& behaviour = env_->behaviours[b];
    return behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : std::size_t{0};
  }

  /// Without infos and statistics, and as if it had taken no time.
  std::string WithoutTexts(std::string result) const {
    if (result.size() < blocks_.result_bytes || result.size() < 2 * sizeof(std::uint32_t)) return result;
    protocol2::WriteEngineTime(0.0, reinterpret_cast<std::byte*>(result.data()));
    std::uint32_t parts = 0;
    std::memcpy(&parts, result.data(), sizeof(parts));
    std::size_t end = blocks_.result_bytes;
    for (std::size_t b = 0; b < blocks_.behaviours.size() && (parts & protocol2::kPartFinals) != 0; ++b) {
      const auto states = result.begin() + static_cast<std::ptrdiff_t>(blocks_.behaviours[b].states);
      const auto finals = std::count_if(states, states + env_->behaviours[b].slots,
                                        [](char state) { return (state & protocol2::kFinal) != 0; });
      end = protocol2::AlignBlock(end + static_cast<std::size_t>(finals) * RowBytes(b));
    }
    if ((parts & protocol2::kPartGroups) != 0) end += blocks_.group_bytes();
    parts &= ~(protocol2::kPartInfos | protocol2::kPartStatistics);
    std::memcpy(result.data(), &parts, sizeof(parts));
    result.resize(std::min(end, result.size()));
    return result;
  }

  const EnvSpec* env_ = nullptr;
  protocol2::Blocks blocks_;
};

}  // namespace consac::cli
