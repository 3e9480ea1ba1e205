#pragma once
// What the conformance cases call things: types of frames, bytes as hex. For the runners of either direction.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "consac/base/hash.h"
#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "consac/space/layout.h"
#include "consac/transport/transport.h"

namespace consac::cli {

inline constexpr double kConformancePatience = 10.0;  ///< s for an answer, unless --timeout says otherwise

inline constexpr std::pair<const char*, protocol2::FrameType> kFrameNames[] = {
    {"HELLO", protocol2::FrameType::kHello},         {"WELCOME", protocol2::FrameType::kWelcome},
    {"CONFIGURE", protocol2::FrameType::kConfigure}, {"SPEC", protocol2::FrameType::kSpec},
    {"RESET", protocol2::FrameType::kReset},         {"STEP", protocol2::FrameType::kStep},
    {"RESULT", protocol2::FrameType::kResult},       {"ERROR", protocol2::FrameType::kError},
    {"GOAWAY", protocol2::FrameType::kGoAway},       {"BYE", protocol2::FrameType::kBye},
    {"PING", protocol2::FrameType::kPing},           {"PONG", protocol2::FrameType::kPong},
    {"PAUSED", protocol2::FrameType::kPaused},       {"RESUMED", protocol2::FrameType::kResumed},
    {"RENDER", protocol2::FrameType::kRender},       {"FRAME", protocol2::FrameType::kFrame},
    {"RELABEL", protocol2::FrameType::kRelabel},     {"REWARDS", protocol2::FrameType::kRewards}};

/// What SPEC and blocks depend on, of capabilities that were agreed.
inline protocol2::Agreed AgreedIn(std::span<const std::string> capabilities) {
  const auto has = [&](std::string_view name) { return protocol2::HasCapability(capabilities, name); };
  return {has("parameters"), has("statistics"), has("groups")};
}

/// A JSON value; null where it is none.
inline nlohmann::json ReadCase(std::string_view text) {
  const Result<nlohmann::json> read = ReadJson<nlohmann::json>(text);
  return read.ok() ? *read : nlohmann::json();
}

/// A type by its name or its number.
inline protocol2::FrameType FrameTypeOf(const nlohmann::json& name) {
  if (name.is_number()) return static_cast<protocol2::FrameType>(name.get<std::uint16_t>());
  for (const auto& [text, type] : kFrameNames) {
    if (name == text) return type;
  }
  return static_cast<protocol2::FrameType>(0);
}

/// A type's name, "type 99" where it has none.
inline std::string FrameName(protocol2::FrameType type) {
  for (const auto& [text, known] : kFrameNames) {
    if (type == known) return text;
  }
  return fmt::format("type {}", static_cast<int>(type));
}

/// Bytes of hex digits.
inline std::string FromHex(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return bytes;
}

/// Bytes that a case cuts into pieces of hex.
inline std::string BytesOf(const nlohmann::json& pieces) {
  std::string bytes;
  for (const nlohmann::json& piece : pieces) bytes += FromHex(piece);
  return bytes;
}

/// A whole frame; with its CRC where `checked`.
inline std::string WholeFrame(protocol2::FrameType type, std::uint64_t request, std::uint32_t session,
                              const std::string& payload, bool checked) {
  std::string frame(protocol2::kHeaderBytes, '\0');
  const std::uint32_t crc = checked ? Crc32c(std::as_bytes(std::span(payload))) : 0;
  protocol2::WriteHeader({type, checked, static_cast<std::uint32_t>(payload.size()), crc, request, session},
                         reinterpret_cast<std::byte*>(frame.data()));
  return frame + payload;
}

/// Writes a stream as a case wants it: held back for the next write, or in pieces that arrive one after another.
class CaseWriter {
 public:
  explicit CaseWriter(double patience_s = kConformancePatience) : patience_s_(patience_s) {}

  Status Write(Transport& transport, const nlohmann::json& how, std::string bytes) {
    held_ += bytes;
    if (how.contains("hold")) return Status::Ok();
    const std::string all = std::exchange(held_, {});
    const std::size_t pieces = how.value("pieces", std::size_t{1});
    const std::size_t size = (all.size() + pieces - 1) / pieces;
    for (std::size_t at = 0; at < all.size(); at += size) {
      if (at > 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      CONSAC_RETURN_IF_ERROR(
          transport.Write(std::as_bytes(std::span(all)).subspan(at, std::min(size, all.size() - at)), patience_s_));
    }
    return Status::Ok();
  }

 private:
  double patience_s_;
  std::string held_;
};

/// Whether every choice of an action is legal by its mask row.
inline bool IsLegal(const Layout& layout, const std::uint8_t* mask, const std::byte* row) {
  for (const Leaf& leaf : layout.leaves) {
    std::int64_t at = leaf.mask_offset;
    for (std::int64_t i = 0; leaf.mask_count > 0 && i < leaf.count; ++i) {
      const auto [low, high] = ElementBounds(leaf, i);
      if (mask[at + static_cast<std::int64_t>(ReadElement(leaf, row, i) - low)] == 0) return false;
      at += static_cast<std::int64_t>(high - low) + 1;
    }
  }
  return true;
}

/// Moves every choice to the first legal one from where it is.
inline void MakeLegal(const Layout& layout, const std::uint8_t* mask, std::byte* row) {
  for (const Leaf& leaf : layout.leaves) {
    if (leaf.mask_count == 0) continue;
    std::int64_t at = leaf.mask_offset;
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const auto [low, high] = ElementBounds(leaf, i);
      const auto choices = static_cast<std::int64_t>(high - low) + 1;
      auto choice = static_cast<std::int64_t>(ReadElement(leaf, row, i) - low);
      for (std::int64_t tried = 0; tried < choices && mask[at + choice] == 0; ++tried) choice = (choice + 1) % choices;
      WriteElement(leaf, row, i, low + static_cast<double>(choice));
      at += choices;
    }
  }
}

/// The same with its CRC as `how` wants it: "right", "wrong", or some number "without flag", which is not looked at;
/// and with `flip`, a place in the header and bits that are the other way there.
inline std::string WholeFrame(protocol2::FrameType type, std::uint64_t request, std::uint32_t session,
                              const std::string& payload, bool checked, const nlohmann::json& how) {
  const std::string crc = how.value("crc", "");
  std::string frame = WholeFrame(type, request, session, payload, crc.empty() ? checked : crc != "without flag");
  constexpr std::size_t kCrcOffset = 12;
  if (crc == "wrong" || crc == "without flag") frame[kCrcOffset] = static_cast<char>(frame[kCrcOffset] ^ 1);
  if (how.contains("flip")) frame[how["flip"][0].get<std::size_t>()] ^= static_cast<char>(how["flip"][1].get<int>());
  return frame;
}

/// A text of a case or of the peer for people: at most `most` bytes, and a mark where there are more.
inline std::string Shortened(const std::string& text, std::size_t most = 400) {
  return text.size() <= most ? text : text.substr(0, most) + "...";
}

/// A frame that has come, for people: JSON as it is, anything else in hex.
inline std::string FrameText(const protocol2::Frame& frame) {
  const std::string payload(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size());
  if (payload.starts_with("{")) return FrameName(frame.header.type) + " " + Quote(payload, 400);
  std::string hex;
  for (const char byte : payload.substr(0, 64)) hex += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return fmt::format("{} of {} bytes{}{}{}", FrameName(frame.header.type), payload.size(), hex.empty() ? "" : ": ", hex,
                     payload.size() > 64 ? "..." : "");
}

/// A case's rules in one line.
inline std::string RulesText(const nlohmann::json& rules) {
  std::string text;
  for (const nlohmann::json& rule : rules) text += (text.empty() ? "" : " ") + rule.get<std::string>();
  return text;
}

/// A case that does not hold, in one sentence.
inline Status Failed(const std::string& what) {
  return {StatusCode::kProtocol, what};
}

}  // namespace consac::cli
