// The RESULT of a step, written where it is sent from: rewards, states, final rows, arrivals, infos; and the episodes
// that wait until they are asked for.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "consac/base/json.h"
#include "server/stepper.h"

namespace consac {

/// Rows and firsts of before stay; everything else is 0 until a slot is stepped or reset.
void Stepper::BeginResult() {
  std::memset(payload_, 0, 8);
  for (std::size_t b = 0; b < groups_.size(); ++b) {
    const std::size_t slots = groups_[b].active.size();
    std::memset(payload_ + blocks_.behaviours[b].rewards, 0, slots * sizeof(double));
    for (std::size_t i = 0; i < slots; ++i) {
      States(b)[i] = (States(b)[i] & std::byte{protocol2::kFirst}) |
                     (groups_[b].active[i] != 0 ? std::byte{protocol2::kActive} : std::byte{0});
    }
  }
  std::fill(played_.begin(), played_.end(), std::uint8_t{0});
  has_finals_ = false;
  result_bytes_ = blocks_.result_bytes;
}

void Stepper::FinishResult(Infos infos) {
  std::uint32_t parts = has_finals_ ? protocol2::kPartFinals : 0;
  if (infos == Infos::kWith && agreed_.groups && WriteGroups()) parts |= protocol2::kPartGroups;
  if (statistics_room_ > 0 && WriteStatistics()) parts |= protocol2::kPartStatistics;
  if (infos == Infos::kWith && info_room_ > 0 && WriteInfos()) parts |= protocol2::kPartInfos;
  std::memcpy(payload_, &parts, sizeof(parts));
}

/// Every present agent of the world stands at the beginning of an episode.
void Stepper::MarkFirst(std::size_t world) {
  pending_[world] = outdated_[world] = 0;
  for (std::size_t b = 0; b < groups_.size(); ++b) {
    Group& group = groups_[b];
    for (std::size_t slot = world * group.agents; slot < (world + 1) * group.agents; ++slot) {
      group.active[slot] = Present(b, slot) ? 1 : 0;
      States(b)[slot] = group.active[slot] != 0 ? std::byte{protocol2::kFirst | protocol2::kActive} : std::byte{0};
    }
  }
}

/// The episode that the world has begun already becomes visible; another begins in its place where parameters have been
/// set since.
void Stepper::BeginNext(std::size_t world) {
  if (outdated_[world] != 0) {
    begins_[world] = env_.ResetWorld(static_cast<std::int32_t>(world), std::nullopt, whole_) ? 1 : 0;
    if (begins_[world] != 0) return;
  }
  for (std::size_t b = 0; b < groups_.size(); ++b) {
    const Group& group = groups_[b];
    const std::size_t at = world * group.agents * group.row_bytes;
    std::memcpy(whole_[b].next_observations + at, group.stashed.data() + at, group.agents * group.row_bytes);
  }
  MarkFirst(world);
}

/// Whether the last agents that took part have ended with this step.
bool Stepper::EpisodeOver(std::size_t world) {
  bool ended = false;
  for (std::size_t b = 0; b < groups_.size(); ++b) {
    const Group& group = groups_[b];
    for (std::size_t slot = world * group.agents; slot < (world + 1) * group.agents; ++slot) {
      if (group.active[slot] != 0) return false;
      ended = ended || Ended(b, slot);
    }
  }
  return ended;
}

/// What the world has begun waits until it is asked for; the rows show the last of the old episode.
void Stepper::HideNextEpisode(std::size_t world) {
  pending_[world] = 1;
  for (std::size_t b = 0; b < groups_.size(); ++b) {
    Group& group = groups_[b];
    for (std::size_t slot = world * group.agents; slot < (world + 1) * group.agents; ++slot) {
      std::byte* row = whole_[b].next_observations + slot * group.row_bytes;
      std::byte* stash = group.stashed.data() + slot * group.row_bytes;
      std::swap_ranges(row, row + group.row_bytes, stash);
    }
  }
}

/// Rewards, states and, for episodes that ended, where both observations go. `batch` holds the slots that were
/// stepped.
void Stepper::WriteOutcomes(std::size_t b, const Batch& batch) {
  Group& group = groups_[b];
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const auto slot = static_cast<std::size_t>(batch.slots[i]);
    if (group.active[slot] == 0) continue;
    ++agents_stepped_;
    played_[group.WorldOf(static_cast<std::int32_t>(slot))] = 1;
    const auto reward = static_cast<double>(batch.rewards[i]);
    std::memcpy(payload_ + blocks_.behaviours[b].rewards + slot * sizeof(reward), &reward, sizeof(reward));
    unsigned state = protocol2::kActive;
    const bool left = agents_leave_ && !Present(b, slot);
    if ((batch.terminated[i] | batch.truncated[i]) != 0) {
      state = WriteEnd(b, batch, i);
    } else if (left) {
      state = protocol2::kTruncated;  // it vanished: its episode was cut where it was last seen
      group.active[slot] = 0;
    }
    States(b)[slot] = static_cast<std::byte>(state);
    if (group.mask_bytes > 0 && group.active[slot] != 0 && !said_no_choice_) CheckMask(b, slot);
  }
  const std::size_t padded = protocol2::AlignBlock(result_bytes_);
  std::memset(payload_ + result_bytes_, 0, padded - result_bytes_);
  result_bytes_ = padded;
}

/// The designer reads this engine's log: a world must leave a legal action. Said once.
void Stepper::CheckMask(std::size_t b, std::size_t slot) {
  const Group& group = groups_[b];
  const std::int64_t choice =
      ChoiceWithNothingLegal(group.choices, whole_[b].next_action_masks + slot * group.mask_bytes);
  if (choice < 0) return;
  said_no_choice_ = true;
  Log(LogLevel::kError, "environment " + std::to_string(slot / group.agents) + " of '" + group.spec->name +
                            "' leaves no legal action in choice " + std::to_string(choice) + "; leave at least one");
}

unsigned Stepper::WriteEnd(std::size_t b, const Batch& batch, std::size_t row) {
  Group& group = groups_[b];
  const auto slot = static_cast<std::size_t>(batch.slots[row]);
  const std::byte* last = batch.final_observations + row * group.row_bytes;
  unsigned state = 0;
  if (batch.terminated[row] != 0) state |= protocol2::kTerminated;
  if (batch.truncated[row] != 0) state |= protocol2::kTruncated;
  if (autoreset_ == protocol2::Autoreset::kSameStep) {
    std::memcpy(payload_ + result_bytes_, last, group.row_bytes);
    result_bytes_ += group.row_bytes;
    has_finals_ = true;
    state |= protocol2::kFinal;
    group.active[slot] = Present(b, slot) ? 1 : 0;
    if (group.active[slot] != 0) state |= protocol2::kFirst | protocol2::kActive;
  } else {
    group.active[slot] = 0;
    std::memcpy(group.stashed.data() + slot * group.row_bytes, last, group.row_bytes);  // see HideNextEpisode
  }
  if (agents_leave_ && !Present(b, slot))
    std::memcpy(whole_[b].next_observations + slot * group.row_bytes, last, group.row_bytes);
  return state;
}

/// Agents that were not there before this step.
void Stepper::WriteArrivals(std::size_t b) {
  Group& group = groups_[b];
  for (std::size_t slot = 0; slot < group.active.size(); ++slot) {
    const std::size_t world = slot / group.agents;
    if (stepped_[world] == 0 || pending_[world] != 0 || group.active[slot] != 0) continue;
    if (Ended(b, slot) || !Present(b, slot)) continue;
    group.active[slot] = 1;
    States(b)[slot] = std::byte{protocol2::kFirst | protocol2::kActive};
  }
}

/// Values by column of the slots whose step ended an episode that is no longer visible, or of all others.
nlohmann::json Stepper::InfoColumns(bool final) {
  nlohmann::json columns = nlohmann::json::object();
  for (const InfoColumn& column : env_.infos()) {
    nlohmann::json slots = nlohmann::json::array(), values = nlohmann::json::array();
    for (std::size_t b = 0; b < groups_.size(); ++b) {
      const Group& group = groups_[b];
      for (std::size_t i = 0; i < group.active.size(); ++i) {
        const bool ended = (States(b)[i] & std::byte{protocol2::kFinal}) != std::byte{0};
        const float value = column.values[group.first_slot + i];
        if (stepped_[i / group.agents] == 0 || ended != final || !std::isfinite(value)) continue;
        slots.push_back(group.first_slot + i);
        values.push_back(value);
      }
    }
    if (!slots.empty()) columns[column.name] = {{"slots", slots}, {"values", values}};
  }
  return columns;
}

/// What the groups of worlds in which somebody took part were paid; left out where it is nothing.
bool Stepper::WriteGroups() {
  const std::span<const float> paid = env_.group_rewards();
  bool any = false;
  for (std::size_t i = 0; i < paid.size(); ++i) any = any || (played_[i / blocks_.groups] != 0 && paid[i] != 0.0f);
  if (!any) return false;
  for (std::size_t i = 0; i < paid.size(); ++i) {
    const double reward = played_[i / blocks_.groups] != 0 ? static_cast<double>(paid[i]) : 0.0;
    std::memcpy(payload_ + result_bytes_ + i * sizeof(reward), &reward, sizeof(reward));
  }
  result_bytes_ += blocks_.group_bytes();
  return true;
}

bool Stepper::WriteStatistics() {
  noted_.clear();
  env_.TakeStatistics(&noted_);
  if (!agreed_.statistics || noted_.empty()) return false;
  const std::string text = protocol2::EncodeStatistics(noted_);
  if (text.size() + 2 * sizeof(std::uint64_t) <= statistics_room_ && WriteText(text)) return true;
  if (!std::exchange(said_statistics_are_long_, true))
    Log(LogLevel::kWarning, "statistics of " + std::to_string(text.size()) +
                                " bytes in one step are left out; note fewer numbers in a step");
  return false;
}

/// The last block: length, then JSON; left out where it would not fit.
bool Stepper::WriteInfos() {
  const nlohmann::json all = {{"infos", InfoColumns(false)}, {"final_infos", InfoColumns(true)}};
  return WriteText(JsonText(all));
}

bool Stepper::WriteText(const std::string& text) {
  const auto length = static_cast<std::uint32_t>(text.size());
  const std::size_t end = result_bytes_ + sizeof(length) + text.size();
  if (protocol2::AlignBlock(end) > std::min(result_room(), most_with_infos_)) return false;
  std::memcpy(payload_ + result_bytes_, &length, sizeof(length));
  std::memcpy(payload_ + result_bytes_ + sizeof(length), text.data(), text.size());
  result_bytes_ = protocol2::AlignBlock(end);
  std::memset(payload_ + end, 0, result_bytes_ - end);
  return true;
}

}  // namespace consac
