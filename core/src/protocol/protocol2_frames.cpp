// Frames of protocol 2: headers, and cutting a stream into them.
#include <algorithm>
#include <bit>
#include <cstring>
#include <new>

#include "consac/base/hash.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"

namespace consac::protocol2 {
namespace {

static_assert(std::endian::native == std::endian::little, "frames are little-endian and copied as they are");

constexpr std::uint16_t kFlagChecked = 1;
constexpr std::size_t kFirstRoom = 65536;
constexpr std::size_t kLeastRoom = 16384;
constexpr std::size_t kForgetting = 8;  // frames after which a third of a longer one's room is left

template <class T>
T Load(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(value));
  return value;
}

template <class T>
void Store(T value, std::byte* at) {
  std::memcpy(at, &value, sizeof(value));
}

}  // namespace

Status Fault(std::string_view name, const std::string& text) {
  return {StatusCode::kProtocol, std::string(name) + ": " + text};
}

std::string_view FaultName(const Status& status) {
  const std::string_view message = status.message();
  const std::size_t colon = message.find(": ");
  if (colon == std::string_view::npos) return "MALFORMED";
  for (const char c : message.substr(0, colon)) {
    if ((c < 'A' || c > 'Z') && c != '_') return "MALFORMED";
  }
  return message.substr(0, colon);
}

std::string FaultText(const Status& status) {
  const std::string_view name = FaultName(status);
  const bool named = status.message().starts_with(name);
  return named ? status.message().substr(name.size() + 2) : status.message();
}

void WriteHeader(const FrameHeader& header, std::byte* out) {
  Store(kMagic, out);
  Store(static_cast<std::uint16_t>(header.type), out + 4);
  Store(header.checked ? kFlagChecked : std::uint16_t{0}, out + 6);
  Store(header.length, out + 8);
  Store(header.crc, out + 12);
  Store(header.request, out + 16);
  Store(header.session, out + 24);
  Store(std::uint32_t{0}, out + 28);
}

Result<FrameHeader> ReadHeader(const std::byte* bytes, std::size_t limit) {
  if (Load<std::uint32_t>(bytes) != kMagic) {
    return Fault("BAD_MAGIC", "a frame begins with " + Quote({reinterpret_cast<const char*>(bytes), 4}) +
                                  ", expected '\\xc0NSC'; is this protocol 2?");
  }
  FrameHeader header;
  header.type = static_cast<FrameType>(Load<std::uint16_t>(bytes + 4));
  const auto flags = Load<std::uint16_t>(bytes + 6);
  header.checked = (flags & kFlagChecked) != 0;
  header.length = Load<std::uint32_t>(bytes + 8);
  header.crc = Load<std::uint32_t>(bytes + 12);
  header.request = Load<std::uint64_t>(bytes + 16);
  header.session = Load<std::uint32_t>(bytes + 24);
  if ((flags & ~kFlagChecked) != 0 || Load<std::uint32_t>(bytes + 28) != 0) {
    return Fault("MALFORMED", "a frame has flags " + std::to_string(flags) + " and reserved " +
                                  std::to_string(Load<std::uint32_t>(bytes + 28)) + "; unknown bits must be 0");
  }
  if (header.length > limit) {
    return Fault("FRAME_TOO_LARGE", "a frame claims " + std::to_string(header.length) + " bytes, at most " +
                                        std::to_string(limit) + " are taken");
  }
  return header;
}

std::uint64_t RefusedRequest(const std::byte* bytes) {
  return Load<std::uint32_t>(bytes) == kMagic ? Load<std::uint64_t>(bytes + 16) : 0;
}

Status CheckPayload(const FrameHeader& header, std::span<const std::byte> payload) {
  if (!header.checked || Crc32c(payload) == header.crc) return Status::Ok();
  return Fault("CRC_MISMATCH", "a frame's payload was changed on its way");
}

FrameReader::FrameReader(std::size_t limit) : limit_(limit) {
  (void)Hold(kFirstRoom);
}

std::span<std::byte> FrameReader::Writable() {
  return {buffer_.get() + end_, capacity_ - end_};
}

/// What is pending, in a buffer of that size; false when there is no memory for it.
bool FrameReader::Hold(std::size_t capacity) {
  std::unique_ptr<std::byte[]> next(new (std::nothrow) std::byte[capacity]);
  if (next == nullptr) return false;
  if (end_ > begin_) std::memcpy(next.get(), buffer_.get() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  buffer_ = std::move(next);
  capacity_ = capacity;
  return true;
}

/// Room behind what is pending, of which `whole` bytes are or will be the first frame. A claim alone takes no memory:
/// room for the rest comes with the rest.
Status FrameReader::MakeRoom(std::size_t whole) {
  const std::size_t there = end_ - begin_;
  const std::size_t wanted = std::max(kFirstRoom, std::max(usual_, std::min(2 * there, whole)) + kLeastRoom);
  const bool outgrown = capacity_ < there + kLeastRoom;
  const bool spare = capacity_ > 2 * wanted;
  if (outgrown || spare) {
    // What is spare is only ever given back.
    if (!Hold(wanted) && outgrown)
      return {StatusCode::kResourceExhausted, "there is no memory for a frame of " + std::to_string(whole) + " bytes"};
  } else if (capacity_ - end_ < kLeastRoom || there == 0) {
    if (there > 0) std::memmove(buffer_.get(), buffer_.get() + begin_, there);
    begin_ = 0;
    end_ = there;
  }
  return Status::Ok();
}

Result<bool> FrameReader::Next(Frame* frame) {
  const std::size_t there = end_ - begin_;
  const std::byte* at = buffer_.get() + begin_;
  if (there < kHeaderBytes) {
    // A wrong first byte is told at once, not after 32.
    if (there >= 4 && Load<std::uint32_t>(at) != kMagic) {
      std::byte padded[kHeaderBytes] = {};
      std::memcpy(padded, at, there);
      return ReadHeader(padded, limit_).status();
    }
    CONSAC_RETURN_IF_ERROR(MakeRoom(kHeaderBytes));
    return false;
  }
  const Result<FrameHeader> header = ReadHeader(at, limit_);
  if (!header.ok()) {
    refused_request_ = RefusedRequest(at);
    return header.status();
  }
  const std::size_t whole = kHeaderBytes + header->length;
  if (there < whole) {
    CONSAC_RETURN_IF_ERROR(MakeRoom(whole));
    return false;
  }
  frame->header = *header;
  frame->payload = {at + kHeaderBytes, header->length};
  begin_ += whole;
  usual_ = whole > usual_ ? whole : usual_ - (usual_ - whole) / kForgetting;
  if (const Status whole_payload = CheckPayload(*header, frame->payload); !whole_payload.ok()) {
    refused_request_ = header->request;
    return whole_payload;
  }
  return true;
}

}  // namespace consac::protocol2
