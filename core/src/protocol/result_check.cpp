#include "consac/protocol/result_check.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "consac/base/json.h"
#include "consac/base/text.h"
#include "protocol/protocol2_json.h"
#include "protocol/row_fault.h"

namespace consac::protocol2 {

/// One slot of a RESULT: where it is, what it was and what is said of it now.
struct ResultCheck::Site {
  const BehaviourSpec& spec;
  const BehaviourBlocks& at;
  std::span<const std::byte> payload, before;
  std::size_t b, slot, environment;
  std::uint8_t was, state;
  bool chosen;  // its environment was stepped or reset

  bool Has(unsigned bits) const { return (state & bits) != 0; }
  std::string Name() const { return "slot " + std::to_string(slot) + " of '" + spec.name + "'"; }
  std::size_t row_bytes() const { return spec.observation_layout.row_bytes; }
  std::size_t mask_bytes() const {
    return spec.masks_actions ? static_cast<std::size_t>(spec.action_layout.mask_bytes) : 0;
  }
  const std::byte* row() const { return payload.data() + at.observations + slot * row_bytes(); }
  const std::byte* mask() const { return payload.data() + at.masks + slot * mask_bytes(); }
};

namespace {

constexpr unsigned kEnds = kTerminated | kTruncated;
constexpr unsigned kBegins = kFirst | kActive;
constexpr unsigned kStateBits = kTerminated | kTruncated | kFinal | kFirst | kActive;

Status Breaks(const char* rule, const std::string& what, StatusCode code = StatusCode::kProtocol) {
  return {code, "a RESULT breaks protocol 2: " + what + " (" + rule + ")"};
}

/// "first observation (8) + takes part (16)".
std::string StateText(unsigned state) {
  constexpr std::pair<unsigned, const char*> kNames[] = {{kTerminated, "terminated"},
                                                         {kTruncated, "truncated"},
                                                         {kFinal, "final row"},
                                                         {kFirst, "first"},
                                                         {kActive, "takes part"}};
  std::string text = "state " + std::to_string(state);
  const char* separator = " (";
  for (const auto& [bit, name] : kNames) {
    if ((state & bit) == 0) continue;
    text += separator + std::string(name);
    separator = ", ";
  }
  return separator[0] == ',' ? text + ")" : text;
}

/// `states`: of all slots, behaviour by behaviour. Final infos are of those that have a final row.
std::string ColumnFault(const nlohmann::json& column, std::span<const std::uint8_t> states, bool final) {
  if (!column.is_object()) return "is no object";
  const auto of = column.find("slots"), values = column.find("values");
  if (of == column.end() || values == column.end() || !of->is_array() || !values->is_array())
    return "lacks the lists \"slots\" and \"values\"";
  if (of->size() != values->size())
    return "has " + std::to_string(of->size()) + " slots and " + std::to_string(values->size()) + " values";
  std::vector<std::uint8_t> named(states.size());
  for (const nlohmann::json& slot : *of) {
    if (!slot.is_number_integer() || slot < 0 || slot >= states.size())
      return "names slot " + Quote(JsonText(slot)) + "; there are " + std::to_string(states.size());
    const auto at = slot.get<std::size_t>();
    if (std::exchange(named[at], std::uint8_t{1}) != 0) return "names slot " + std::to_string(at) + " twice";
    if (final && (states[at] & kFinal) == 0)
      return "names slot " + std::to_string(at) + ", which has " + StateText(states[at]) + " and no final row (4)";
  }
  return "";
}

}  // namespace

ResultCheck::ResultCheck(const EnvSpec& env, Autoreset autoreset, Numbers numbers, Agreed agreed)
    : env_(&env), blocks_(env), autoreset_(autoreset), numbers_(numbers), agreed_(agreed) {
  chosen_.assign(blocks_.environments, 1);
  over_.assign(blocks_.environments, 0);
  for (const BehaviourSpec& behaviour : env.behaviours) {
    states_.emplace_back(static_cast<std::size_t>(behaviour.slots), std::uint8_t{0});
    choices_.push_back(MaskedChoices(behaviour.action_layout));
  }
}

void ResultCheck::Ask(FrameType type, std::span<const std::byte> chosen) {
  asked_ = type;
  for (std::size_t i = 0; i < chosen_.size(); ++i) chosen_[i] = chosen[i] != std::byte{0} ? 1 : 0;
}

std::uint8_t ResultCheck::StateIn(std::span<const std::byte> payload, std::size_t b, std::size_t slot) const {
  return std::to_integer<std::uint8_t>(payload[blocks_.behaviours[b].states + slot]);
}

Status ResultCheck::Judge(std::span<const std::byte> payload, std::span<const std::byte> before) {
  ResultParts parts;
  CONSAC_RETURN_IF_ERROR(JudgeSize(payload, &parts));
  std::size_t finals = parts.finals;
  for (std::size_t b = 0; b < states_.size(); ++b) {
    const BehaviourSpec& behaviour = env_->behaviours[b];
    const std::size_t agents = behaviour.agents.size();
    for (std::size_t slot = 0; slot < states_[b].size(); ++slot) {
      const std::size_t environment = slot / agents;
      const Site site{behaviour,
                      blocks_.behaviours[b],
                      payload,
                      before,
                      b,
                      slot,
                      environment,
                      states_[b][slot],
                      StateIn(payload, b, slot),
                      chosen_[environment] != 0};
      CONSAC_RETURN_IF_ERROR(JudgeSlot(site));
      if (site.Has(kFinal)) {
        CONSAC_RETURN_IF_ERROR(JudgeRow(site, payload.data() + finals, "the final row of "));
        finals += site.row_bytes();
      }
    }
    finals = AlignBlock(finals);
  }
  if (parts.groups != 0) CONSAC_RETURN_IF_ERROR(JudgeGroups(payload, parts.groups));
  if (parts.statistics != 0) {
    std::vector<Statistic> noted;
    const std::size_t begin = parts.statistics + sizeof(std::uint32_t);
    CONSAC_RETURN_IF_ERROR(ReadStatistics(payload.subspan(begin, parts.statistics_end - begin), &noted));
  }
  if (parts.infos != 0) CONSAC_RETURN_IF_ERROR(JudgeInfos(payload, parts));
  Remember(payload);
  return Status::Ok();
}

/// Where final rows begin, and what comes behind them.
Status ResultCheck::JudgeSize(std::span<const std::byte> payload, ResultParts* parts) const {
  if (payload.size() < blocks_.result_bytes) {
    return Breaks("R60", "it has " + std::to_string(payload.size()) + " bytes, too few for its " +
                             std::to_string(blocks_.result_bytes) + " of rows, rewards, states and masks");
  }
  const std::uint32_t said = WordAt(payload, 0);
  const std::uint32_t known =
      kPartFinals | kPartInfos | (agreed_.statistics ? kPartStatistics : 0) | (agreed_.groups ? kPartGroups : 0);
  if ((said & ~known) != 0) {
    return Breaks("R61", "its parts are " + std::to_string(said) + "; 1 (final rows) and 2 (infos) are known" +
                             (agreed_.statistics ? ", and 4 (statistics)" : "") +
                             (agreed_.groups ? ", and 8 (groups)" : ""));
  }
  *parts = FindParts(*env_, blocks_, payload);
  if ((parts->rows_with_final > 0) != ((said & kPartFinals) != 0)) {
    return Breaks("R61", std::to_string(parts->rows_with_final) +
                             " slots have state 4 (a final row follows), but its parts are " + std::to_string(said));
  }
  if (payload.size() != parts->end) {
    return Breaks("R60", "it has " + std::to_string(payload.size()) + " bytes, by its parts and states " +
                             std::to_string(parts->end));
  }
  return JudgePadding(payload, *parts);
}

/// Between blocks, behind final rows, statistics and infos, there are zeros.
Status ResultCheck::JudgePadding(std::span<const std::byte> payload, const ResultParts& parts) const {
  const auto zero = [&](std::size_t from) {
    for (std::size_t at = from; at < std::min(AlignBlock(from), payload.size()); ++at) {
      if (payload[at] != std::byte{0}) return at;
    }
    return std::size_t{0};
  };
  std::size_t wrong = zero(parts.statistics_end), finals = blocks_.result_bytes;
  if (wrong == 0) wrong = zero(parts.infos_end);
  for (std::size_t b = 0; b < states_.size() && wrong == 0; ++b) {
    const BehaviourSpec& spec = env_->behaviours[b];
    const BehaviourBlocks& at = blocks_.behaviours[b];
    const std::size_t slots = states_[b].size(), row_bytes = spec.observation_layout.row_bytes;
    const auto mask_bytes = spec.masks_actions ? static_cast<std::size_t>(spec.action_layout.mask_bytes) : 0;
    for (std::size_t slot = 0; slot < slots; ++slot) {
      if ((StateIn(payload, b, slot) & kFinal) != 0) finals += row_bytes;
    }
    for (const std::size_t end :
         {at.observations + slots * row_bytes, at.states + slots, at.masks + slots * mask_bytes, finals}) {
      if (wrong == 0) wrong = zero(end);
    }
    finals = AlignBlock(finals);
  }
  if (wrong == 0) return Status::Ok();
  return Breaks("R62", "byte " + std::to_string(wrong) + " is " + std::to_string(std::to_integer<int>(payload[wrong])) +
                           ", but padding is 0");
}

Status ResultCheck::JudgeGroups(std::span<const std::byte> payload, std::size_t at) const {
  for (std::size_t i = 0; i < blocks_.environments * blocks_.groups; ++i) {
    double paid = 0.0;
    std::memcpy(&paid, payload.data() + at + i * sizeof(paid), sizeof(paid));
    const std::size_t environment = i / blocks_.groups;
    const std::string group = Quote(env_->groups[i % blocks_.groups].name) + " of environment ";
    if (!std::isfinite(paid))
      return Breaks("R107", "what group " + group + std::to_string(environment) + " is paid is NaN or infinite",
                    StatusCode::kNonFinite);
    if (paid != 0.0 && !TookPart(environment))
      return Breaks("R107", "group " + group + std::to_string(environment) + ", in which nobody took part, is paid " +
                                NumberText(paid));
  }
  return Status::Ok();
}

bool ResultCheck::TookPart(std::size_t environment) const {
  if (asked_ != FrameType::kStep || chosen_[environment] == 0) return false;
  for (std::size_t b = 0; b < states_.size(); ++b) {
    const std::size_t agents = env_->behaviours[b].agents.size();
    for (std::size_t slot = environment * agents; slot < (environment + 1) * agents; ++slot)
      if ((states_[b][slot] & kActive) != 0) return true;
  }
  return false;
}

Status ResultCheck::JudgeSlot(const Site& site) const {
  if ((site.state & ~kStateBits) != 0)
    return Breaks("R63", site.Name() + " has " + StateText(site.state) + "; the highest bit known is 16");
  if (site.Has(kFirst) && !site.Has(kActive)) {
    return Breaks("R64", site.Name() + " has " + StateText(site.state) +
                             ": a first observation (8) of an agent that does not take part; set 16 for every agent "
                             "whose action counts next time");
  }
  double reward = 0.0;
  std::memcpy(&reward, site.payload.data() + site.at.rewards + site.slot * sizeof(reward), sizeof(reward));
  const bool plays = site.chosen && asked_ == FrameType::kStep && (site.was & kActive) != 0;
  if (!plays && (reward != 0.0 || site.Has(kEnds | kFinal))) {
    return Breaks("R65", site.Name() + " has reward " + NumberText(reward) + " and " + StateText(site.state) +
                             ", but took no part in this step: its reward and states 1, 2 and 4 are 0");
  }
  if (numbers_ == Numbers::kJudged && !std::isfinite(reward)) {
    return Breaks("R75", "the reward of " + site.Name() + " is NaN or infinite; mend it in the world",
                  StatusCode::kNonFinite);
  }
  if (!site.chosen) return JudgeRepeated(site);
  if (!plays && site.Has(kActive) && !site.Has(kFirst)) {
    return Breaks("R66", site.Name() + " has " + StateText(site.state) +
                             ": it begins to take part without a first observation (8)");
  }
  if (plays) CONSAC_RETURN_IF_ERROR(JudgeEnd(site));
  if (site.Has(kActive)) CONSAC_RETURN_IF_ERROR(JudgeMask(site));
  return site.Has(kActive | kEnds) ? JudgeRow(site, site.row(), "") : Status::Ok();
}

/// Of an agent that took part in the step: whether it has ended, and what its autoreset makes of that.
Status ResultCheck::JudgeEnd(const Site& site) const {
  if (!site.Has(kEnds)) {
    if ((site.state & kStateBits) == kActive) return Status::Ok();
    return Breaks("R67", site.Name() + " took part and has " + StateText(site.state) +
                             " now; an agent that has not ended has 16 and nothing else, one that has ended 1 or 2");
  }
  if (autoreset_ != Autoreset::kSameStep) {
    if (!site.Has(kFinal | kBegins)) return Status::Ok();
    return Breaks("R69", site.Name() + " has " + StateText(site.state) +
                             "; with next_step and disabled the episode's last observation is in the row itself: " +
                             "neither 4 nor 8 nor 16");
  }
  if (!site.Has(kFinal) && site.Has(kTerminated | kBegins)) {
    return Breaks("R68", site.Name() + " has " + StateText(site.state) +
                             "; with same_step an episode that ends has a final row (4)");
  }
  if (site.Has(kActive) != site.Has(kFirst)) {
    return Breaks("R68", site.Name() + " has " + StateText(site.state) +
                             "; with same_step an agent that has ended and takes part has a first observation (8)");
  }
  return Status::Ok();
}

Status ResultCheck::JudgeRepeated(const Site& site) const {
  const bool same = site.state == (site.was & kBegins);
  if (!same) {
    return Breaks("R70", site.Name() + " was not stepped and has " + StateText(site.state) + ", before it had " +
                             StateText(site.was));
  }
  if (site.before.size() < blocks_.result_bytes || !site.Has(kActive)) return Status::Ok();
  const std::byte* row = site.before.data() + (site.row() - site.payload.data());
  const std::byte* mask = site.before.data() + (site.mask() - site.payload.data());
  if (std::memcmp(row, site.row(), site.row_bytes()) != 0)
    return Breaks("R70", site.Name() + " was not stepped, but its observation has changed");
  if (std::memcmp(mask, site.mask(), site.mask_bytes()) != 0)
    return Breaks("R70", site.Name() + " was not stepped, but its mask has changed");
  return Status::Ok();
}

Status ResultCheck::JudgeMask(const Site& site) const {
  if (site.mask_bytes() == 0) return Status::Ok();
  const std::byte* mask = site.mask();
  unsigned all = 0;
  for (std::size_t i = 0; i < site.mask_bytes(); ++i) all |= std::to_integer<unsigned>(mask[i]);
  if (all > 1) return Breaks("R71", "the mask of " + site.Name() + " has a byte that is neither 0 nor 1");
  const std::int64_t choice = ChoiceWithNothingLegal(choices_[site.b], reinterpret_cast<const std::uint8_t*>(mask));
  if (choice < 0) return Status::Ok();
  return Breaks("R72",
                site.Name() + " has no legal action for choice " + std::to_string(choice) + "; leave at least one");
}

Status ResultCheck::JudgeRow(const Site& site, const std::byte* row, const char* what) const {
  const RowFault fault = FindRowFault(site.spec.observation_layout, row, numbers_);
  if (fault.leaf == nullptr) return Status::Ok();
  const std::string& name = fault.leaf->name;
  if (fault.non_finite) {
    return Breaks("R75",
                  std::string(what) + (name.empty() ? "an observation" : name) + " of " + site.Name() +
                      " is NaN or infinite; mend it in the world",
                  StatusCode::kNonFinite);
  }
  return Breaks("R73", std::string(what) + site.Name() + " has " + NumberText(fault.value) + " at element " +
                           std::to_string(fault.element) + (name.empty() ? "" : " of '" + name + "'") + ", outside " +
                           NumberText(fault.low) + " to " + NumberText(fault.high));
}

Status ResultCheck::JudgeInfos(std::span<const std::byte> payload, const ResultParts& parts) const {
  const std::size_t begin = parts.infos + sizeof(std::uint32_t), length = parts.infos_end - begin;
  const std::string_view text(reinterpret_cast<const char*>(payload.data()) + begin, length);
  if (length > kLargestJson)
    return Breaks("R74", "its infos are " + std::to_string(length) + " bytes of JSON; at most 1 MiB is taken");
  const Result<nlohmann::json> infos = ParseObject(payload.subspan(begin, length));
  if (!infos.ok()) return Breaks("R74", "its infos are no JSON object: " + Quote(text));
  std::vector<std::uint8_t> states;
  for (std::size_t b = 0; b < states_.size(); ++b) {
    for (std::size_t slot = 0; slot < states_[b].size(); ++slot) states.push_back(StateIn(payload, b, slot));
  }
  for (const char* part : {"infos", "final_infos"}) {
    const auto columns = infos->find(part);
    if (columns == infos->end()) continue;
    if (!columns->is_object()) return Breaks("R74", "its " + std::string(part) + " are no object");
    for (const auto& [name, column] : columns->items()) {
      const std::string fault = ColumnFault(column, states, part[0] == 'f');
      if (!fault.empty()) return Breaks("R74", std::string(part) + " " + Quote(name) + " " + fault);
    }
  }
  return Status::Ok();
}

/// What the next RESULT goes on from.
void ResultCheck::Remember(std::span<const std::byte> payload) {
  anyone_ = false;
  for (std::size_t world = 0; world < over_.size(); ++world) {
    bool active = false, ended = false;
    for (std::size_t b = 0; b < states_.size(); ++b) {
      const std::size_t agents = env_->behaviours[b].agents.size();
      for (std::size_t slot = world * agents; slot < (world + 1) * agents; ++slot) {
        const std::uint8_t state = states_[b][slot] = StateIn(payload, b, slot);
        active = active || (state & kActive) != 0;
        ended = ended || (state & kEnds) != 0;
      }
    }
    anyone_ = anyone_ || active;
    // A RESET begins an episode, though nobody may take part in it yet; so does the STEP behind an end with
    // `next_step`.
    const bool begun = chosen_[world] != 0 &&
                       (asked_ == FrameType::kReset || (autoreset_ == Autoreset::kNextStep && over_[world] != 0));
    over_[world] = !active && !begun && (ended || over_[world] != 0) ? 1 : 0;
  }
}

std::string_view RuleOf(const Status& status) {
  const std::string_view text = status.message();
  const std::size_t open = text.rfind(" (R");
  if (open == std::string_view::npos || !text.ends_with(")")) return {};
  return text.substr(open + 2, text.size() - open - 3);
}

}  // namespace consac::protocol2
