// What goes wrong in shared memory is judged there as over TCP, by both ends; only Linux's regions can be opened by who
// knows nothing but SPEC.
#if defined(__linux__)
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <thread>

#include "consac/base/hash.h"
#include "tests/faults/fault_peers.h"

namespace consac {
namespace {

using namespace testing;
using ::testing::HasSubstr;

constexpr std::size_t kRequestTurn = 64, kResultTurn = 128;

/// A region of shared memory, as either end maps it.
class Mapped {
 public:
  Mapped(int descriptor, std::size_t bytes)
      : descriptor_(descriptor),
        bytes_(bytes),
        data_(static_cast<std::byte*>(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0))) {}
  ~Mapped() {
    munmap(data_, bytes_);
    close(descriptor_);
  }
  Mapped(const Mapped&) = delete;
  Mapped& operator=(const Mapped&) = delete;
  /// The region that SPEC tells of.
  static std::unique_ptr<Mapped> Of(const SharedMemorySpec& spec) {
    return std::make_unique<Mapped>(open(spec.path.c_str(), O_RDWR), spec.bytes);
  }
  /// A new one, with its head.
  static std::unique_ptr<Mapped> New(std::size_t bytes) {
    const int descriptor = memfd_create("consac", MFD_ALLOW_SEALING);
    EXPECT_EQ(ftruncate(descriptor, static_cast<off_t>(bytes)), 0);
    EXPECT_EQ(fcntl(descriptor, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW), 0);
    auto region = std::make_unique<Mapped>(descriptor, bytes);
    const std::uint32_t head[2] = {kMagic, kVersion};
    std::memcpy(region->data_, head, sizeof(head));
    return region;
  }
  std::string path() const { return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(descriptor_); }
  std::byte* at(std::size_t offset) const { return data_ + offset; }
  std::atomic_ref<std::uint32_t> turn(std::size_t offset) const {
    return std::atomic_ref<std::uint32_t>(*reinterpret_cast<std::uint32_t*>(data_ + offset));
  }
  /// Writes a frame and takes the turn; its reader looks now and then though nobody wakes it.
  void Put(std::size_t offset, std::span<const std::byte> frame, std::size_t turn_at) const {
    std::memcpy(at(offset), frame.data(), frame.size());
    turn(turn_at).fetch_add(1);
  }

 private:
  int descriptor_;
  std::size_t bytes_;
  std::byte* data_;
};

/// A frame with its CRC, or with another.
std::vector<std::byte> CheckedFrame(FrameType type, std::uint64_t request, std::span<const std::byte> payload,
                                    std::uint32_t changed = 0) {
  std::vector<std::byte> bytes = FrameBytes(type, request, payload);
  WriteHeader({type, true, static_cast<std::uint32_t>(payload.size()), Crc32c(payload) ^ changed, request, 0},
              bytes.data());
  return bytes;
}

/// A trainer whose session has begun in shared memory; its RESET was answered.
class SharedTrainer {
 public:
  explicit SharedTrainer(const Engine& engine) : trainer(engine.Connect()) {
    Hello hello;
    hello.capabilities = {"shm"};
    trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
    const Frame welcome = trainer.Next();
    EXPECT_EQ(welcome.header.type, FrameType::kWelcome);
    trainer.resume = ParseWelcome(welcome.payload)->resume;
    trainer.Send(FrameType::kConfigure, 1, R"({"transport":"shm"})");
    const Result<SpecMessage> spec = ParseSpec(trainer.Next().payload);
    EXPECT_TRUE(spec.ok()) << spec.status().message();
    shared = spec->shared_memory;
    region = Mapped::Of(shared);
    trainer.blocks = Blocks(engine.spec());
    const std::vector<int> all(kCopies, 1);
    EXPECT_EQ(Answer(CheckedFrame(FrameType::kReset, 2, trainer.ResetPayload(1, all))), FrameType::kResult);
    step = trainer.StepPayload(std::vector<std::int32_t>(kCopies, 0), all);
  }
  void Put(std::span<const std::byte> frame) const { region->Put(shared.request_offset, frame, kRequestTurn); }
  /// The type of what answers `frame` in memory; 0 where nothing does.
  FrameType Answer(std::span<const std::byte> frame) const {
    const std::uint32_t before = region->turn(kResultTurn).load();
    Put(frame);
    if (!Soon([&] { return region->turn(kResultTurn).load() != before; })) return static_cast<FrameType>(0);
    return ReadHeader(region->at(shared.result_offset), kLargestFrame)->type;
  }

  RawTrainer trainer;
  SharedMemorySpec shared;
  std::unique_ptr<Mapped> region;
  std::vector<std::byte> step;
};

TEST(FaultBShared, B8_TheEngineLooksAtACrcThereToo) {
  const Engine engine;
  SharedTrainer shared(engine);
  EXPECT_EQ(shared.Answer(CheckedFrame(FrameType::kStep, 3, shared.step)), FrameType::kResult);
  const std::int64_t steps = engine.steps();
  shared.Put(CheckedFrame(FrameType::kStep, 4, shared.step, 1));
  const Frame error = shared.trainer.Next();
  ASSERT_EQ(error.header.type, FrameType::kError) << "over TCP, as whatever ends the connection";
  EXPECT_EQ(ParseError(error.payload)->code, "CRC_MISMATCH");
  EXPECT_EQ(error.header.request, 4u);
  EXPECT_EQ(engine.steps(), steps) << "nothing is carried out";
  RawTrainer again(engine.Connect());
  ASSERT_EQ(ResumeAnswer(again, shared.trainer.resume, {"shm"}), "WELCOME") << "a loss, and nobody's fault (R24)";
  again.blocks = shared.trainer.blocks;
  again.Ask(FrameType::kStep, 4, shared.step);
  EXPECT_EQ(again.last_type, FrameType::kResult);
}

TEST(FaultBShared, WhatATrainerWroteIntoItsRegionIsNobodyElses) {
  const Engine engine;
  const auto first_result = [&engine] {
    RawTrainer trainer(engine.Connect());
    trainer.Begin(engine.spec());
    std::vector<std::byte> result =
        trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(1, std::vector<int>(kCopies, 1)));
    EXPECT_EQ(trainer.last_type, FrameType::kResult);
    trainer.Send(FrameType::kBye, 3, "");
    return result;
  };
  const std::vector<std::byte> before = first_result();
  {
    SharedTrainer shared(engine);
    const std::size_t payload = shared.shared.result_offset + kHeaderBytes;
    std::memset(shared.region->at(payload), 0xff, shared.trainer.blocks.result_bytes);
    shared.trainer.Send(FrameType::kBye, 3, "");
  }
  EXPECT_EQ(first_result(), before);
}

TEST(FaultBShared, B7_ARefusedHeadersNumberIsTheErrors) {
  for (const bool magic : {true, false}) {
    const Engine engine;
    SharedTrainer shared(engine);
    std::vector<std::byte> frame = FrameBytes(FrameType::kStep, 77, shared.step);
    frame[magic ? 6 : 0] = std::byte{2};
    shared.Put(frame);
    const Frame error = shared.trainer.Next();
    ASSERT_EQ(error.header.type, FrameType::kError);
    EXPECT_EQ(ParseError(error.payload)->code, magic ? "MALFORMED" : "BAD_MAGIC");
    EXPECT_EQ(error.header.request, magic ? 77u : 0u);
  }
}

/// What the trainer makes of a first step's answer whose CRC is `changed`.
Status StepWhoseAnswersCrcIs(std::uint32_t changed) {
  RawEngine engine;
  const std::size_t results = 8192;
  const auto region = Mapped::New(2 * results);
  engine.message.shared_memory = {region->path(), 2 * results, 192, results - 192, results, results, 50};
  std::thread peer([&] {
    ASSERT_TRUE(engine.Accept());
    (void)engine.Next();
    Welcome welcome;
    welcome.session = 1;
    welcome.capabilities = {"shm"};
    engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
    engine.Send(FrameType::kSpec, engine.Next().header.request, EncodeSpec(engine.message));
    for (const std::uint64_t request : {2, 3}) {
      ASSERT_TRUE(Soon([&] { return region->turn(kRequestTurn).load() == request - 1; }));
      const int state = request == 2 ? kFirst | kActive : kActive;
      region->Put(results,
                  CheckedFrame(FrameType::kResult, request, engine.ResultPayload(state), request == 3 ? changed : 0),
                  kResultTurn);
    }
    (void)engine.Next();
  });
  Status status;
  {
    Session session(engine.Connect(), Impatient(Way::kShared));
    status = session.Step();
  }
  peer.join();
  return status;
}

TEST(FaultBShared, B8_TheTrainerLooksAtACrcThereToo) {
  EXPECT_TRUE(StepWhoseAnswersCrcIs(0).ok()) << StepWhoseAnswersCrcIs(0).message();
  const Status changed = StepWhoseAnswersCrcIs(1);
  EXPECT_EQ(changed.code(), StatusCode::kProtocol);
  EXPECT_THAT(changed.message(), HasSubstr("CRC_MISMATCH"));
}

}  // namespace
}  // namespace consac
#endif
