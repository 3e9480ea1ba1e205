#pragma once
// Protocol 2 as bytes: frames, control messages and the blocks of STEP and RESULT. Sans-I/O: bytes in, frames out, no
// sockets, no allocation per step. Used by server, client, tests and fuzzers. spec/protocol2.md is the law.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"
#include "consac/env/vector_env.h"

namespace consac::protocol2 {

inline constexpr std::uint32_t kMagic = 0x43534EC0;  ///< the bytes C0 4E 53 43
inline constexpr int kVersion = 2;                   ///< lowest and highest that this code speaks
inline constexpr std::size_t kHeaderBytes = 32;
inline constexpr std::size_t kLargestBeforeWelcome = 4096;
inline constexpr std::size_t kLargestPing = 64;
inline constexpr std::size_t kLargestFrame = std::size_t{64} << 20;
inline constexpr std::size_t kLargestJson = std::size_t{1} << 20;

/// What a frame is.
enum class FrameType : std::uint16_t {
  kHello = 1,
  kWelcome,
  kConfigure,
  kSpec,
  kReset,
  kStep,
  kResult,
  kError,
  kGoAway,
  kBye,
  kPing,
  kPong,
  kPaused,
  kResumed,
  kRender,
  kFrame,
  kRelabel,
  kRewards
};
inline constexpr std::uint16_t kOptionalType = 0x8000;  ///< skipped by those who do not know it

/// The fields of a header that carry meaning.
struct FrameHeader {
  FrameType type = FrameType::kHello;
  bool checked = false;       ///< the payload's CRC-32C travels with it
  std::uint32_t length = 0;   ///< of the payload
  std::uint32_t crc = 0;      ///< CRC-32C of the payload where `checked`
  std::uint64_t request = 0;  ///< number of the request, or of the one that is answered
  std::uint32_t session = 0;
};

/// Writes 32 bytes.
void WriteHeader(const FrameHeader& header, std::byte* out);
/// Reads 32 bytes; `limit` bounds the payload. Errors begin with their name in the specification, "BAD_MAGIC: ...".
Result<FrameHeader> ReadHeader(const std::byte* bytes, std::size_t limit);
/// The number in a header of 32 bytes that is refused; 0 where it has no magic.
std::uint64_t RefusedRequest(const std::byte* bytes);
/// CRC_MISMATCH where the header has a CRC and `payload` another; over TCP and in shared memory alike.
Status CheckPayload(const FrameHeader& header, std::span<const std::byte> payload);

/// A failure under a name of the specification, as kProtocol "NAME: text".
Status Fault(std::string_view name, const std::string& text);
/// The name of such a failure; "MALFORMED" where it has none.
std::string_view FaultName(const Status& status);
/// Its text without the name.
std::string FaultText(const Status& status);

/// One frame that has arrived.
struct Frame {
  FrameHeader header;
  std::span<const std::byte> payload;  // valid until the reader is asked for the next frame
};

/// Bytes in, frames out, however they were cut or joined. Holds 64 KiB or what frames have usually taken of late; while
/// a longer one is on its way at most 16 KiB more than it, and than twice what has come of it. Movable.
class FrameReader {
 public:
  /// Payloads of at most `limit` bytes.
  explicit FrameReader(std::size_t limit = kLargestBeforeWelcome);
  /// Once WELCOME has said how much.
  void SetLimit(std::size_t limit) { limit_ = limit; }
  /// Where the next bytes go. After construction empty only where memory was short, which Next then says; never empty
  /// where Next has returned false.
  std::span<std::byte> Writable();
  /// So many of them have arrived.
  void Commit(std::size_t count) { end_ += count; }
  /// The next whole frame; false when there is none yet. After an error the stream cannot be read further;
  /// kResourceExhausted where there is no memory for the frame.
  Result<bool> Next(Frame* frame);
  /// Bytes that belong to no whole frame, for error messages.
  std::span<const std::byte> pending() const { return {buffer_.get() + begin_, end_ - begin_}; }
  /// Bytes that it holds.
  std::size_t capacity() const { return capacity_; }
  /// The number in the header of the frame that Next has refused; 0 where there was no magic.
  std::uint64_t refused_request() const { return refused_request_; }

 private:
  Status MakeRoom(std::size_t whole);
  bool Hold(std::size_t capacity);

  std::unique_ptr<std::byte[]> buffer_;
  std::size_t capacity_ = 0, begin_ = 0, end_ = 0, limit_;
  std::size_t usual_ = 0;  // bytes of the latest frames, the longest forgotten last
  std::uint64_t refused_request_ = 0;
};

/// Who a client is and what it can do.
struct Hello {
  int lowest = kVersion, highest = kVersion;
  std::string client;
  std::vector<std::string> capabilities;
  std::string token;   ///< of the server's access check; "" for none
  std::string resume;  ///< of a session to go on with; ""
  std::size_t max_frame = kLargestFrame;
};

/// Capabilities that SPEC and the blocks depend on.
struct Agreed {
  bool parameters = false;  ///< SPEC says parameters, RESET and STEP may set them
  bool statistics = false;  ///< RESULT may have them
  bool groups = false;      ///< SPEC says groups, RESULT may have what they are paid
};

/// The server's answer.
struct Welcome {
  std::string server;
  std::uint32_t session = 0;
  std::string resume;  ///< to come back with after a lost connection
  std::vector<std::string> capabilities;
  std::size_t max_frame = kLargestFrame;
  double heartbeat_s = 10.0;
  std::uint64_t last_request = 0;
  bool resumed = false;
};

/// Whether `capabilities`, as HELLO and WELCOME list them, have one of that name.
bool HasCapability(std::span<const std::string> capabilities, std::string_view name);
/// The first of `names` that `capabilities` lack; "" where they lack none.
std::string LackingCapability(std::span<const std::string> capabilities, std::span<const std::string> names);

/// How the next episode of an environment begins.
enum class Autoreset : std::uint8_t { kSameStep, kNextStep, kDisabled };

/// What the client asks of the session.
struct Configure {
  Autoreset autoreset = Autoreset::kSameStep;
  std::string expect_json;  ///< behaviours that it was made for, as SPEC writes them; ""
  bool shared_memory = false;
};

/// Where the frames lie in a shared region.
struct SharedMemorySpec {
  std::string path;  ///< to open and map; "" when there is none
  std::uint64_t bytes = 0, request_offset = 0, request_bytes = 0, result_offset = 0, result_bytes = 0;
  std::int64_t spin_us = 0;
};

/// What SPEC says.
struct SpecMessage {
  EnvSpec env;
  Autoreset autoreset = Autoreset::kSameStep;
  std::int64_t training_length = 0;
  std::string model_name;
  SharedMemorySpec shared_memory;
};

/// What ERROR says.
struct ErrorMessage {
  std::string code;
  bool ends_connection = false;
  std::string message;
  std::string path;  ///< of the first difference; ""
  double retry_after_s = 0.0;
  std::int64_t environment = -1;  ///< whose fault it is; -1: no single one's
};

/// Why an engine takes no further requests.
struct GoAway {
  std::string reason;
  double retry_after_s = 0.0;  ///< it may be tried again then; 0: it does not say
};

// Each as JSON, and back. A message that does not fit is MALFORMED.
std::string EncodeHello(const Hello& hello);
Result<Hello> ParseHello(std::span<const std::byte> payload);
std::string EncodeWelcome(const Welcome& welcome);
Result<Welcome> ParseWelcome(std::span<const std::byte> payload);
std::string EncodeConfigure(const Configure& configure);
Result<Configure> ParseConfigure(std::span<const std::byte> payload);
/// Of a session without parameters or groups `spec.env` has none.
std::string EncodeSpec(const SpecMessage& spec);
Result<SpecMessage> ParseSpec(std::span<const std::byte> payload, const Agreed& agreed = {});
std::string EncodeError(const ErrorMessage& error);
Result<ErrorMessage> ParseError(std::span<const std::byte> payload);
/// GOAWAY: why no further requests are taken.
std::string EncodeGoAway(const std::string& reason);
Result<GoAway> ParseGoAway(std::span<const std::byte> payload);

/// RENDER's environment.
Result<std::int64_t> ParseRender(std::span<const std::byte> payload);
/// FRAME's payload.
std::string EncodePicture(const Picture& picture);

/// The behaviours of SPEC alone, as a JSON list.
std::string BehavioursJson(const EnvSpec& env);
/// Ok when `found` has every member of `expected` (both lists of behaviours in JSON); otherwise SPEC_MISMATCH, and
/// `path` names the first difference.
Status CompareBehaviours(const std::string& expected, const std::string& found, std::string* path);

/// A slot's state in RESULT.
enum SlotState : std::uint8_t { kTerminated = 1, kTruncated = 2, kFinal = 4, kFirst = 8, kActive = 16 };

/// Offsets of one behaviour's blocks, from the payload's first byte.
struct BehaviourBlocks {
  std::size_t actions = 0;                                           // in STEP
  std::size_t observations = 0, rewards = 0, states = 0, masks = 0;  // in RESULT
};

/// Where everything lies in RESET, STEP and RESULT of one SPEC.
class Blocks {
 public:
  Blocks() = default;
  /// For what SPEC describes.
  explicit Blocks(const EnvSpec& env);
  std::size_t environments = 0;
  std::size_t seeds = 0;           // offset in RESET
  std::size_t options = 0;         // offset in RESET, after seeds
  std::size_t step_bytes = 0;      // whole payload of STEP
  std::size_t result_bytes = 0;    // payload of RESULT without finals and infos, which follow
  std::size_t largest_result = 0;  // with a final row for every slot
  std::size_t parameters = 0;      // of one environment
  std::size_t groups = 0;          // of one environment
  /// Bytes of the block of what groups are paid.
  std::size_t group_bytes() const { return environments * groups * sizeof(double); }
  /// Bytes of the block of parameters, the last of RESET and STEP.
  std::size_t parameter_bytes() const { return environments * parameters * sizeof(double); }
  std::vector<BehaviourBlocks> behaviours;
};

inline constexpr std::size_t kActiveOffset = 8;  ///< of the byte per environment in RESET and STEP
inline constexpr std::uint32_t kWithSeeds = 1, kWithOptions = 2, kWithParameters = 4;  ///< flags of RESET and STEP
inline constexpr std::uint32_t kPartFinals = 1, kPartInfos = 2, kPartStatistics = 4, kPartGroups = 8;  ///< of RESULT

/// Writes into RESULT's payload how long the engine took, and reads it from there [s].
void WriteEngineTime(double seconds, std::byte* payload);
double ReadEngineTime(const std::byte* payload);

/// The next multiple of 8.
constexpr std::size_t AlignBlock(std::size_t offset) {
  return (offset + 7) & ~std::size_t{7};
}

/// Where the blocks of a RESULT lie whose size differs from one to the next; 0: not there.
struct ResultParts {
  std::size_t rows_with_final = 0;
  std::size_t finals = 0, finals_end = 0;
  std::size_t groups = 0, statistics = 0, infos = 0;
  std::size_t statistics_end = 0, infos_end = 0;  // of their JSON, which begins 4 bytes behind the block
  std::size_t end = 0;                            // by all that; the payload's size unless it is wrong
};
/// Of a payload that has at least blocks.result_bytes. Nothing beyond `end` may be read where that is not its size.
ResultParts FindParts(const EnvSpec& env, const Blocks& blocks, std::span<const std::byte> payload);
/// Adds what RESULT's statistics say (R105); kProtocol where they are wrong.
Status ReadStatistics(std::span<const std::byte> json, std::vector<Statistic>* statistics);
/// The same as JSON, without what is not finite; "" where there are none.
std::string EncodeStatistics(std::span<const Statistic> statistics);

/// Reads a RESULT of a `same_step` session into `batches`, one per behaviour with all its slots; MALFORMED when it is
/// too short for what it claims.
Status ReadResult(const EnvSpec& env, const Blocks& blocks, std::span<const std::byte> payload,
                  std::span<Batch> batches);

}  // namespace consac::protocol2
