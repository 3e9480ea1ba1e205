// Shared memory, every way this system has: two ends see the same bytes, turns are seen in order and wake a sleeper,
// misuse is a Status, nothing stays behind.
#include "transport/shared_memory.h"

#include <gtest/gtest.h>

#include <cstring>
#include <thread>

#include "consac/base/hooks.h"
#include "transport/shared_memory_ways.h"

#if CONSAC_SHARED_POSIX
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace consac {
namespace {

constexpr std::size_t kBytes = 10000;

class EachWay : public ::testing::TestWithParam<SharedMemoryWay> {
 protected:
  void SetUp() override {
    auto made = GetParam().create(kBytes);
    ASSERT_TRUE(made.ok()) << made.status().message();
    engine = std::move(*made);
  }
  void Join() {
    auto opened = GetParam().open(engine->path(), kBytes);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    trainer = std::move(*opened);
  }
  std::unique_ptr<SharedRegion> engine, trainer;
};
INSTANTIATE_TEST_SUITE_P(Each, EachWay, ::testing::ValuesIn(SharedMemoryWays().begin(), SharedMemoryWays().end()),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST_P(EachWay, BothEndsSeeTheSameBytesWhichBeginAsZeros) {
  Join();
  EXPECT_NE(engine->data(), trainer->data());
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(trainer->data()) % 64, 0u);
  for (std::size_t i = 0; i < kBytes; ++i) ASSERT_EQ(trainer->data()[i], std::byte{0});
  for (std::size_t i = 0; i < kBytes; ++i) engine->data()[i] = static_cast<std::byte>(i * 7);
  EXPECT_EQ(std::memcmp(engine->data(), trainer->data(), kBytes), 0);
  trainer->data()[kBytes - 1] = std::byte{99};
  EXPECT_EQ(engine->data()[kBytes - 1], std::byte{99});
}

TEST_P(EachWay, AWaitWithoutATurnEndsInTimeAndATurnIsSeenOnce) {
  Join();
  SharedTurn writer(*engine, 64), reader(*trainer, 64);
  const double start = Now();
  EXPECT_FALSE(reader.Await(0.05));
  EXPECT_GE(Now() - start, 0.045);
  EXPECT_LT(Now() - start, 2.0);
  EXPECT_FALSE(reader.Await(0.0));
  writer.Take();
  EXPECT_TRUE(reader.Await(0.0));
  EXPECT_FALSE(reader.Await(0.0));
}

TEST_P(EachWay, ATurnWakesASleeper) {
  Join();
  SharedTurn reader(*trainer, 64);
  const std::atomic<std::uint32_t>& asleep = engine->Word(68);
  std::thread late([&] {
    SharedTurn writer(*engine, 64);
    while (asleep.load() == 0) std::this_thread::yield();
    writer.Take();
  });
  const double start = Now();
  EXPECT_TRUE(reader.Await(30.0));
  EXPECT_LT(Now() - start, 20.0);
  late.join();
}

TEST_P(EachWay, ManyTurnsThereAndBackLoseNothing) {
  Join();
  constexpr std::uint32_t kRounds = 3000;
  constexpr std::size_t kRequest = 192, kResult = 5000;
  SharedTurn request(*engine, 64), result(*engine, 128);
  SharedTurn far_request(*trainer, 64), far_result(*trainer, 128);
  std::thread far([&] {
    for (std::uint32_t i = 1; i <= kRounds; ++i) {
      while (!far_request.Await(1.0)) {
      }
      std::uint32_t value = 0;
      std::memcpy(&value, trainer->data() + kRequest, sizeof(value));
      value *= 3;
      std::memcpy(trainer->data() + kResult, &value, sizeof(value));
      far_result.Take();
    }
  });
  std::uint32_t wrong = 0;
  for (std::uint32_t i = 1; i <= kRounds; ++i) {
    std::memcpy(engine->data() + kRequest, &i, sizeof(i));
    request.Take();
    while (!result.Await(1.0)) {
    }
    std::uint32_t value = 0;
    std::memcpy(&value, engine->data() + kResult, sizeof(value));
    wrong += value != 3 * i ? 1 : 0;
  }
  far.join();
  EXPECT_EQ(wrong, 0u);
}

TEST_P(EachWay, WhatIsTooSmallOrNoRegionIsRefused) {
  EXPECT_EQ(GetParam().open(engine->path(), kBytes + 100000).status().code(), StatusCode::kDataLoss);
  const std::string path = engine->path();
  for (const std::string& other :
       {std::string(), std::string("/etc/passwd"), std::string("/proc/self/fd/0"), path + "x", path + "/../1",
        "../" + path, std::string("Local\\other"), "Global" + path}) {
    const auto opened = GetParam().open(other, kBytes);
    ASSERT_FALSE(opened.ok()) << other;
    EXPECT_EQ(opened.status().code(), StatusCode::kDataLoss) << other;
    EXPECT_NE(opened.status().message().find(other), std::string::npos);
  }
}

TEST_P(EachWay, AnOwnerThatIsGoneCannotBeOpened) {
  const std::string path = engine->path();
  engine.reset();
  EXPECT_FALSE(GetParam().open(path, kBytes).ok());
}

TEST_P(EachWay, TheOtherEndOutlivesItsOwner) {
  Join();
  engine->data()[500] = std::byte{5};
  engine.reset();
  EXPECT_EQ(trainer->data()[500], std::byte{5});
}

TEST_P(EachWay, TwoRegionsAreTwo) {
  const auto other = GetParam().create(kBytes);
  ASSERT_TRUE(other.ok());
  EXPECT_NE((*other)->path(), engine->path());
}

TEST(SharedRegion, TakesTheFirstWay) {
  ASSERT_FALSE(SharedMemoryWays().empty());
  const auto made = SharedRegion::Create(kBytes);
  ASSERT_TRUE(made.ok());
  EXPECT_TRUE(SharedRegion::Open((*made)->path(), kBytes).ok());
}

#if CONSAC_SHARED_POSIX
TEST(PosixRegion, IsForOneUserAndItsNameIsGoneOnceBothHaveIt) {
  auto engine = kPosixWay.create(kBytes);
  ASSERT_TRUE(engine.ok());
  const std::string path = (*engine)->path();
  EXPECT_LE(path.size(), 31u);  // macOS' limit
  const int descriptor = shm_open(path.c_str(), O_RDWR, 0);
  ASSERT_GE(descriptor, 0);
  struct stat what;
  ASSERT_EQ(fstat(descriptor, &what), 0);
  EXPECT_EQ(what.st_mode & 0777, 0600u);
  close(descriptor);
  ASSERT_TRUE(kPosixWay.open(path, kBytes).ok());
  EXPECT_LT(shm_open(path.c_str(), O_RDWR, 0), 0);
}
#endif

}  // namespace
}  // namespace consac
