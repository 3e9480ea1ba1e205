#pragma once
// Text protocol 1, the thesis' three messages, as a sans-I/O codec: bytes in, events out; values in, bytes out. No
// sockets, no clock of its own, no allocation per message once created. One implementation for server, client,
// plugin and fuzzers. In words: spec/text1.md.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/env/vector_env.h"

namespace consac::text1 {

/// Longest message that is accepted, in bytes.
inline constexpr std::size_t kMaxMessage = 1 << 20;
/// Most numbers in one space.
inline constexpr std::int64_t kMaxSize = 65536;

/// The engine's first message.
struct Setup {
  Space action_space;                ///< Discrete, or float32 Box of one dimension
  Space observation_space;           ///< the same
  std::int64_t training_length = 0;  ///< steps (actions); 0 with a model name: act only
  std::string model_name;            ///< "" when the engine gave none
};

/// Ok when the protocol can carry the space; otherwise says which space it is and that protocol 1 carries Discrete
/// and one-dimensional Box only.
Status CheckSpace(const Space& space, std::string_view role);
/// Appends the setup message without its terminator.
Status EncodeSetup(const Setup& setup, std::string* out);
/// Parses a whole setup message (no terminator); the error quotes the field and says what was expected.
Result<Setup> ParseSetup(std::string_view message);

/// What a sender puts after a message.
enum class Terminator : std::uint8_t { kNewline, kNone };

/// Cuts a byte stream into messages. Accepts \n, \r\n and no terminator, by the grammar of what is expected.
/// Feed bytes as they come, ask Next after each; when nothing has come for the quiet time, call Quiet.
class Framer {
 public:
  /// Which grammar the next message has.
  enum class Expect : std::uint8_t { kSetup, kObservation, kAction };
  /// A framer with room for the largest message of these spaces; grows to kMaxMessage at most while reading a setup.
  Framer();
  /// From the next message on, this grammar. `single_character`: the message's last field is one character (an
  /// action with at most ten choices; `done` always is), so it is complete without a terminator.
  void SetExpect(Expect expect, bool single_character);
  /// Room to read bytes into; never empty unless the message is too long.
  std::span<std::byte> Writable();
  /// `count` bytes were written into Writable(). kProtocol past kMaxMessage.
  Status Commit(std::size_t count);
  /// The next complete message without its terminator, or an empty view when there is none yet. Valid until the
  /// next Writable.
  std::string_view Next();
  /// No byte has followed for the quiet time: what is there, if anything, is a message.
  std::string_view Quiet();
  /// Bytes received that belong to no message yet, for error messages.
  std::string_view pending() const;

 private:
  void SkipTerminators();
  std::string_view Take(std::size_t length);

  std::vector<char> buffer_;  // received bytes; pending ones are [begin_, end_)
  std::size_t begin_ = 0, end_ = 0;
  std::size_t scanned_ = 0;  // pending bytes that were looked at already
  int hashes_ = 0;           // '#' among them
  Expect expect_ = Expect::kSetup;
  bool single_character_ = false;
};

/// How the one line begins that a second trainer is turned away with.
inline constexpr std::string_view kBusyPrefix = "busy: ";

/// Reads "o1,o2,...#reward#done" (or "o1,o2,..." alone where `act_only`) into a row. NaN, infinity, wrong counts and
/// anything else that does not fit is one line that quotes the text.
Status ParseObservation(std::string_view message, const Layout& observation, bool act_only, std::byte* row,
                        float* reward, bool* done);
/// Reads an action into a row; a Discrete action must be a choice, Box numbers are clipped to their bounds.
Status ParseAction(std::string_view message, const Layout& action, std::byte* row);
/// kNonFinite when the reward or a number of the row is NaN or infinite: such numbers are never sent. `kind` names the
/// message in the error.
Status CheckSendable(std::string_view kind, const Layout& layout, const std::byte* row, float reward);
/// Writes an observation (see CheckSendable) into `out`, which must hold MaxText; returns the bytes written, terminator
/// included.
std::size_t EncodeObservation(const Layout& observation, const std::byte* row, float reward, bool done,
                              Terminator terminator, std::span<char> out);
/// Writes an action likewise.
std::size_t EncodeAction(const Layout& action, const std::byte* row, Terminator terminator, std::span<char> out);
/// Bytes that the longest message of this layout can take.
std::size_t MaxText(const Layout& layout);

}  // namespace consac::text1
