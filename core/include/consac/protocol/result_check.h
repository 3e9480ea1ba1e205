#pragma once
// Judges the RESULTs of one session by the rules of spec/protocol2.md: sizes, states, masks, rows, infos. One judge for
// the trainer, `consac doctor` and the conformance cases. It reads; what a RESULT holds is taken by ReadResult.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "consac/protocol/protocol2.h"

namespace consac::protocol2 {

/// Whether NaN and infinity are a fault of the RESULT, or looked for by somebody else.
enum class Numbers : std::uint8_t { kJudged, kLeft };

/// What a session's RESULTs have said so far, and whether the next one fits to it. No allocation per step, but for
/// infos. Not thread-safe.
class ResultCheck {
 public:
  ResultCheck() = default;
  /// `env` must outlive it.
  ResultCheck(const EnvSpec& env, Autoreset autoreset, Numbers numbers = Numbers::kJudged, Agreed agreed = {});

  /// The request that the next RESULT answers: a RESET or a STEP of the environments of `chosen` (one byte each).
  void Ask(FrameType type, std::span<const std::byte> chosen);
  /// Ok, or kProtocol (kNonFinite for NaN and infinity) with slot, value and the number of the rule: "... (R67)".
  /// `before`: the RESULT before this one, against which what must be repeated is compared; may be empty.
  Status Judge(std::span<const std::byte> payload, std::span<const std::byte> before = {});

  /// Whether an agent takes part, as of the latest RESULT.
  bool anyone() const { return anyone_; }
  /// Whether the environment's episode is over and its next one has not begun (`next_step` and `disabled`).
  bool over(std::size_t environment) const { return over_[environment] != 0; }

 private:
  struct Site;  // a slot and what is to be said of it
  Status JudgeSize(std::span<const std::byte> payload, ResultParts* parts) const;
  Status JudgePadding(std::span<const std::byte> payload, const ResultParts& parts) const;
  Status JudgeGroups(std::span<const std::byte> payload, std::size_t at) const;
  /// Whether an agent of the environment took part in the STEP that is answered.
  bool TookPart(std::size_t environment) const;
  Status JudgeSlot(const Site& site) const;
  Status JudgeEnd(const Site& site) const;
  Status JudgeMask(const Site& site) const;
  Status JudgeRow(const Site& site, const std::byte* row, const char* what) const;
  Status JudgeRepeated(const Site& site) const;
  Status JudgeInfos(std::span<const std::byte> payload, const ResultParts& parts) const;
  std::uint8_t StateIn(std::span<const std::byte> payload, std::size_t b, std::size_t slot) const;
  void Remember(std::span<const std::byte> payload);

  const EnvSpec* env_ = nullptr;
  Blocks blocks_;
  Autoreset autoreset_ = Autoreset::kSameStep;
  Numbers numbers_ = Numbers::kJudged;
  Agreed agreed_;
  FrameType asked_ = FrameType::kReset;
  std::vector<std::uint8_t> chosen_, over_;         // [environments]
  std::vector<std::vector<std::uint8_t>> states_;   // [behaviours][slots] of the RESULT before
  std::vector<std::vector<std::int64_t>> choices_;  // [behaviours] mask bytes of each choice
  bool anyone_ = false;
};

/// The rule that a refusal of ResultCheck names, "R67"; "" where it names none.
std::string_view RuleOf(const Status& status);

}  // namespace consac::protocol2
