#pragma once
// Where protocol 2's frames lie in a shared region. Private to core/server.

#include <algorithm>
#include <cstring>
#include <memory>

#include "consac/protocol/protocol2.h"
#include "transport/shared_memory.h"

namespace consac {

/// What travels in a region beside RESET, STEP and RESULT.
enum class Also : std::uint8_t { kNothing, kRelabels };

/// Both ends' view of a region: a request area and a result area, each with its turn.
struct SharedChannel {
  static constexpr std::size_t kRequestTurn = 64, kResultTurn = 128, kRequests = 192;

  std::unique_ptr<SharedRegion> region;
  SharedTurn request_turn, result_turn;
  std::size_t request_offset = kRequests, request_bytes = 0, result_offset = 0, result_bytes = 0;

  std::byte* request() const { return region->data() + request_offset; }
  std::byte* result() const { return region->data() + result_offset; }

  /// The engine's: room for the largest STEP and RESET of `blocks`, and for a RESULT of `result_room` bytes.
  static Result<SharedChannel> Create(const protocol2::Blocks& blocks, std::size_t result_room, Also also) {
    SharedChannel channel;
    const bool relabels = also == Also::kRelabels;
    channel.request_bytes = protocol2::AlignBlock(
        protocol2::kHeaderBytes +
        std::max(std::max(blocks.step_bytes, blocks.options) + blocks.parameter_bytes(), relabels ? kRelabelRoom : 0));
    // The first observation row begins a cache line.
    const std::size_t before_rows =
        protocol2::kHeaderBytes + (blocks.behaviours.empty() ? 0 : blocks.behaviours[0].observations);
    channel.result_offset = (kRequests + channel.request_bytes + before_rows + 63) / 64 * 64 - before_rows;
    channel.result_bytes = protocol2::AlignBlock(protocol2::kHeaderBytes +
                                                 std::max(result_room + kErrorRoom, relabels ? kRewardsRoom : 0));
    Result<std::unique_ptr<SharedRegion>> region = SharedRegion::Create(channel.result_offset + channel.result_bytes);
    if (!region.ok()) return region.status();
    const std::uint32_t head[2] = {protocol2::kMagic, protocol2::kVersion};
    std::memcpy((*region)->data(), head, sizeof(head));
    channel.region = std::move(*region);
    channel.FindTurns();
    return channel;
  }

  /// The trainer's, of what SPEC says; every number is checked.
  static Result<SharedChannel> Open(const protocol2::SharedMemorySpec& spec, const protocol2::Blocks& blocks) {
    const std::size_t step =
        protocol2::kHeaderBytes + std::max(blocks.step_bytes, blocks.options) + blocks.parameter_bytes();
    const bool fits = spec.bytes <= kLargestRegion && spec.request_offset >= kRequests &&
                      spec.request_offset % 8 == 0 && spec.result_offset % 8 == 0 && spec.request_bytes >= step &&
                      spec.result_bytes >= protocol2::kHeaderBytes + blocks.result_bytes &&
                      spec.request_offset + spec.request_bytes <= spec.bytes &&
                      spec.result_offset + spec.result_bytes <= spec.bytes && spec.request_bytes <= spec.bytes &&
                      spec.result_bytes <= spec.bytes;
    if (!fits) return Status{StatusCode::kDataLoss, "SPEC describes shared memory that cannot be"};
    Result<std::unique_ptr<SharedRegion>> region = SharedRegion::Open(spec.path, spec.bytes);
    if (!region.ok()) return region.status();
    std::uint32_t head[2];
    std::memcpy(head, (*region)->data(), sizeof(head));
    if (head[0] != protocol2::kMagic || head[1] != protocol2::kVersion)
      return Status{StatusCode::kDataLoss, "'" + spec.path + "' holds no frames of protocol 2"};
    SharedChannel channel;
    channel.region = std::move(*region);
    channel.request_offset = spec.request_offset;
    channel.request_bytes = spec.request_bytes;
    channel.result_offset = spec.result_offset;
    channel.result_bytes = spec.result_bytes;
    channel.FindTurns();
    return channel;
  }

  /// The frame that lies at `at` in an area of `bytes`, its payload in place; judged as one that came over TCP. `head`
  /// is a copy of its header, which might change while it is looked at.
  static Result<protocol2::Frame> FrameAt(const std::byte* at, std::size_t bytes, const std::byte* head) {
    const Result<protocol2::FrameHeader> header = protocol2::ReadHeader(head, bytes - protocol2::kHeaderBytes);
    if (!header.ok()) return header.status();
    const protocol2::Frame frame{*header, {at + protocol2::kHeaderBytes, header->length}};
    CONSAC_RETURN_IF_ERROR(protocol2::CheckPayload(frame.header, frame.payload));
    return frame;
  }

  protocol2::SharedMemorySpec Spec() const {
    return {region->path(), region->size(), request_offset,   request_bytes,
            result_offset,  result_bytes,   kSpinMicroseconds};
  }

 private:
  static constexpr std::size_t kErrorRoom = 1024;
  // A minibatch's; a system gives pages when they are written to. What is longer travels over TCP.
  static constexpr std::size_t kRelabelRoom = std::size_t{256} << 10, kRewardsRoom = std::size_t{8} << 10;
  static constexpr std::uint64_t kLargestRegion = std::uint64_t{1} << 31;
  static constexpr std::int64_t kSpinMicroseconds = 50;

  void FindTurns() {
    request_turn = SharedTurn(*region, kRequestTurn);
    result_turn = SharedTurn(*region, kResultTurn);
  }
};

}  // namespace consac
