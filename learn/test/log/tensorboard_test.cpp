// Event files, byte by byte. Vectors: TensorBoard's record_writer tests, and records that its own protobuf decodes.
#include "consac/learn/log/tensorboard.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/files.h"
#include "tests/folder.h"

namespace consac::learn {
namespace {

using testing::TestFolder;
using testing::TextOf;

std::string Hex(const std::string& bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const char c : bytes) {
    hex += kDigits[static_cast<unsigned char>(c) >> 4];
    hex += kDigits[static_cast<unsigned char>(c) & 15];
  }
  return hex;
}

TEST(Tensorboard, MaskedChecksums) {
  EXPECT_EQ(MaskedCrc(std::string(32, '\0')), 0x0FD7FFFAu);
  EXPECT_EQ(MaskedCrc("\x1A\x11"
                      "CRC test, one two"),
            0x5794D08Au);
}

TEST(Tensorboard, FirstRecord) {
  EXPECT_EQ(Hex(FrameRecord(VersionEvent(1700000000.0))),
            "1800000000000000a37f4b22"
            "0900000040fc54d9411a0d627261696e2e4576656e743a32"
            "eced8f9d");
}

TEST(Tensorboard, AScalarRecord) {
  const TestFolder folder;
  auto events = std::move(*EventWriter::Open(folder.File(EventFileName(1700000000)), 1700000000.0));
  const std::string path = events->path();
  events->Scalar(1700000000.0, 300, "loss", 0.5);
  events->Flush();
  const std::string first = FrameRecord(VersionEvent(1700000000.0));
  // wall_time, step 300, summary { value { tag "loss", simple_value 0.5 } }
  const std::string payload =
      std::string("\x09\x00\x00\x00\x40\xfc\x54\xd9\x41\x10\xac\x02\x2a\x0d\x0a\x0b\x0a\x04", 18) + "loss" +
      std::string("\x15\x00\x00\x00\x3f", 5);
  EXPECT_EQ(Hex(TextOf(path)), Hex(first + FrameRecord(payload)));
  EXPECT_NE(path.find("/events.out.tfevents.1700000000."), std::string::npos);
  EXPECT_EQ(EventFileName(7).find("events.out.tfevents.0000000007."), 0u) << "names in the order of their seconds";
}

TEST(Tensorboard, ARestartNamesTheFirstRepeatedStep) {
  EXPECT_EQ(Hex(RestartEvent(1700000000.0, 301)), "0900000040fc54d94110ad023a020801");
}

TEST(Tensorboard, ALongTagIsCutToWhatFits) {
  const TestFolder folder;
  auto events = std::move(*EventWriter::Open(folder.File(EventFileName(1)), 1.0));
  events->Scalar(1.0, INT64_MAX, std::string(5000, 'x'), 1.0);
  events->Flush();
  EXPECT_NE(TextOf(events->path()).find(std::string(200, 'x') + "\x15"), std::string::npos);
}

TEST(Tensorboard, AFileWithoutANumberGoesAgain) {
  const TestFolder folder;
  auto empty = std::move(*EventWriter::Open(folder.File(EventFileName(1700000000)), 1700000000.0));
  auto told = std::move(*EventWriter::Open(folder.File(EventFileName(1700000001)), 1700000001.0));
  const std::string none = empty->path(), one = told->path();
  empty->Restart(1700000000.0, 7);
  told->Scalar(1700000001.0, 8, "a", 1.0);
  empty.reset();
  told.reset();
  EXPECT_FALSE(std::filesystem::exists(none)) << "of a run that could not go on";
  EXPECT_TRUE(std::filesystem::exists(one));
}

}  // namespace
}  // namespace consac::learn
