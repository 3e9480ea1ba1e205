// Observations and actions of text protocol 1, straight between bytes and rows: no allocation but for an error.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "consac/base/text.h"
#include "consac/protocol/text1.h"

namespace consac::text1 {
namespace {

constexpr std::size_t kLongestNumber = 32;

Status MessageError(std::string_view kind, std::string_view message, const std::string& what) {
  return {StatusCode::kProtocol, std::string(kind) + " " + Quote(message, 120) + ": " + what};
}

// A decimal number without a negative exponent: one that cannot be had all the same is too large.
bool IsDecimal(std::string_view text) {
  const auto skip_digits = [&text] {
    const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
    text.remove_prefix(digits);
    return digits;
  };
  if (text.starts_with('+') || text.starts_with('-')) text.remove_prefix(1);
  std::size_t digits = skip_digits();
  if (text.starts_with('.')) {
    text.remove_prefix(1);
    digits += skip_digits();
  }
  if (digits == 0 || text.empty()) return digits > 0;
  if (!text.starts_with('e') && !text.starts_with('E')) return false;
  text.remove_prefix(1);
  if (text.starts_with('+')) text.remove_prefix(1);
  return skip_digits() > 0 && text.empty();
}

// NaN, infinity and what is too large for a number are told apart from other text, because they point at a fault in
// the world, not in the wire.
bool LooksNonFinite(std::string_view text) {
  if (IsDecimal(text)) return true;
  std::string lower;
  for (const char c : text.substr(0, 16)) lower += static_cast<char>(c | 0x20);
  return lower.find("nan") != std::string::npos || lower.find("inf") != std::string::npos ||
         lower.find("ind") != std::string::npos;
}

Status NumberError(std::string_view kind, std::string_view message, std::string_view text, std::size_t index) {
  Status status = MessageError(
      kind, message, "number " + std::to_string(index + 1) + " is " + Quote(text) + ", expected a finite number");
  return LooksNonFinite(text) ? Status{StatusCode::kNonFinite, status.message()} : status;
}

Status ParseChoice(std::string_view kind, std::string_view message, std::string_view text, const Leaf& leaf,
                   std::byte* row) {
  std::int64_t choice = 0;
  if (!ParseNumber(text, &choice) || choice < 0 || choice >= leaf.space.n()) {
    return MessageError(kind, message, Quote(text) + " is no choice from 0 to " + std::to_string(leaf.space.n() - 1));
  }
  const auto stored = static_cast<std::int32_t>(choice);
  std::memcpy(row + leaf.offset, &stored, sizeof(stored));
  return Status::Ok();
}

/// Reads "n1,n2,..." into a one-leaf row.
Status ParseRow(std::string_view kind, std::string_view message, std::string_view text, const Layout& layout,
                std::byte* row) {
  const Leaf& leaf = layout.leaves[0];
  if (leaf.space.kind() == SpaceKind::kDiscrete) return ParseChoice(kind, message, text, leaf, row);
  auto* values = reinterpret_cast<float*>(row + leaf.offset);
  std::size_t index = 0;
  const auto count = static_cast<std::size_t>(leaf.count);
  while (true) {
    const std::size_t comma = text.find(',');
    const std::string_view number = text.substr(0, comma);
    if (index < count && !ParseNumber(number, &values[index])) return NumberError(kind, message, number, index);
    ++index;
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  if (index == count) return Status::Ok();
  const char* hint = index == 2 * count ? "; twice as many: does its sender write decimal commas (a locale)?" : "";
  return MessageError(kind, message,
                      "it holds " + std::to_string(index) + " numbers, expected " + std::to_string(count) + hint);
}

char* PutText(const char* text, std::size_t length, char* at) {
  std::memcpy(at, text, length);
  return at + length;
}

char* PutNumber(float value, char* at) {
  char digits[kLongestNumber];
  return PutText(digits, FormatNumber(value, std::span<char, 32>(digits)), at);
}

char* PutRow(const Layout& layout, const std::byte* row, char* at) {
  const Leaf& leaf = layout.leaves[0];
  if (leaf.space.kind() == SpaceKind::kDiscrete) {
    std::int32_t choice = 0;
    std::memcpy(&choice, row + leaf.offset, sizeof(choice));
    return std::to_chars(at, at + kLongestNumber, choice).ptr;
  }
  const auto* values = reinterpret_cast<const float*>(row + leaf.offset);
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    if (i > 0) *at++ = ',';
    at = PutNumber(values[i], at);
  }
  return at;
}

Status NotSendable(std::string_view kind, const std::string& what, float value) {
  return {StatusCode::kNonFinite,
          std::string(kind) + ": " + what + " is " + NumberText(value) + "; it is not sent, mend where it comes from"};
}

}  // namespace

Status CheckSendable(std::string_view kind, const Layout& layout, const std::byte* row, float reward) {
  if (!std::isfinite(reward)) return NotSendable(kind, "the reward", reward);
  const Leaf& leaf = layout.leaves[0];
  if (leaf.space.kind() == SpaceKind::kDiscrete) return Status::Ok();
  const auto* values = reinterpret_cast<const float*>(row + leaf.offset);
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    if (!std::isfinite(values[i])) return NotSendable(kind, "number " + std::to_string(i + 1), values[i]);
  }
  return Status::Ok();
}

std::size_t MaxText(const Layout& layout) {
  return static_cast<std::size_t>(layout.leaves[0].count) * (kLongestNumber + 1) + kLongestNumber + 8;
}

Status ParseObservation(std::string_view message, const Layout& observation, bool act_only, std::byte* row,
                        float* reward, bool* done) {
  constexpr std::string_view kKind = "observation";
  const std::size_t first = message.find('#');
  *reward = 0.0f;
  *done = false;
  if (first == std::string_view::npos) {
    if (act_only) return ParseRow(kKind, message, message, observation, row);
    return MessageError(kKind, message, "expected o1,o2,...#reward#done");
  }
  const std::size_t second = message.find('#', first + 1);
  if (second == std::string_view::npos) return MessageError(kKind, message, "expected o1,o2,...#reward#done");
  CONSAC_RETURN_IF_ERROR(ParseRow(kKind, message, message.substr(0, first), observation, row));
  const std::string_view reward_text = message.substr(first + 1, second - first - 1),
                         done_text = message.substr(second + 1);
  if (!ParseNumber(reward_text, reward)) {
    const char* hint =
        reward_text.find(',') != std::string_view::npos ? "; a decimal comma? write it without a locale" : "";
    const Status status = MessageError(kKind, message, "reward " + Quote(reward_text) + " is no finite number" + hint);
    return LooksNonFinite(reward_text) ? Status{StatusCode::kNonFinite, status.message()} : status;
  }
  if (done_text != "0" && done_text != "1")
    return MessageError(kKind, message, "done " + Quote(done_text) + " is neither 0 nor 1");
  *done = done_text == "1";
  return Status::Ok();
}

Status ParseAction(std::string_view message, const Layout& action, std::byte* row) {
  CONSAC_RETURN_IF_ERROR(ParseRow("action", message, message, action, row));
  ClipRow(action, row);
  return Status::Ok();
}

std::size_t EncodeObservation(const Layout& observation, const std::byte* row, float reward, bool done,
                              Terminator terminator, std::span<char> out) {
  CONSAC_ASSERT(out.size() >= MaxText(observation));
  if (out.size() < MaxText(observation)) return 0;
  char* at = PutRow(observation, row, out.data());
  *at++ = '#';
  at = PutNumber(reward, at);
  *at++ = '#';
  *at++ = done ? '1' : '0';
  if (terminator == Terminator::kNewline) *at++ = '\n';
  return static_cast<std::size_t>(at - out.data());
}

std::size_t EncodeAction(const Layout& action, const std::byte* row, Terminator terminator, std::span<char> out) {
  CONSAC_ASSERT(out.size() >= MaxText(action));
  if (out.size() < MaxText(action)) return 0;
  char* at = PutRow(action, row, out.data());
  if (terminator == Terminator::kNewline) *at++ = '\n';
  return static_cast<std::size_t>(at - out.data());
}

}  // namespace consac::text1
