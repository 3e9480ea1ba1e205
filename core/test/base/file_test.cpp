// Files are whole or not there; a full disk harms nothing. Checksums against published vectors.
#include "consac/base/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#if !defined(_WIN32)
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>
#endif

#include "consac/base/hash.h"

namespace consac {
namespace {

std::string Path(const char* name) {
  return (std::filesystem::temp_directory_path() / (std::string("consac_file_") + std::to_string(getpid()) + name))
      .string();
}

TEST(File, WritesAndReadsBack) {
  const std::string path = Path("a");
  const std::vector<std::byte> bytes(1000, std::byte{7});
  ASSERT_TRUE(WriteFileAtomically(path, bytes).ok());
  const auto back = ReadFile(path);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back, bytes);
  EXPECT_EQ(ReadFile(path, 10).status().code(), StatusCode::kResourceExhausted);
  std::filesystem::remove(path);
}

TEST(File, PathsAreUtf8OnEverySystem) {
  const std::string path = ::testing::TempDir() + "consac_L\xc3\xa4ufe_\xe8\xb5\xb0.bin";
  const std::vector<std::byte> bytes(3, std::byte{7});
  ASSERT_TRUE(WriteFileAtomically(path, bytes).ok());
  EXPECT_EQ(*ReadFile(path), bytes);
  const std::filesystem::path same(std::u8string(path.begin(), path.end()));
  EXPECT_TRUE(std::filesystem::exists(same)) << "under that very name";
  EXPECT_TRUE(std::filesystem::remove(same));
}

#if !defined(_WIN32)
TEST(File, ADeviceOrFolderIsNotReplaced) {
  for (const char* path : {"/dev/null", "/tmp"}) {
    EXPECT_EQ(WriteFileAtomically(path, {}).code(), StatusCode::kDataLoss) << path;
  }
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}
#endif

// Who names a file that is not there has made a mistake; what cannot be written is the disk's.
TEST(File, AFolderThatIsNotThereIsNoUnknownName) {
  EXPECT_EQ(WriteFileAtomically("/nonexistent/model.consac", {}).code(), StatusCode::kDataLoss);
}

TEST(File, MissingFileIsNamed) {
  const auto result = ReadFile("/nonexistent/model.consac");
  EXPECT_EQ(result.status().code(), StatusCode::kNotFound);
  EXPECT_NE(result.status().message().find("/nonexistent/model.consac"), std::string::npos);
}

#if !defined(_WIN32)
// In a child whose files may not grow past 4 KiB: the write fails, the old file stays, no temporary is left.
TEST(File, FullDiskLeavesTheOldFile) {
  const std::string path = Path("full");
  ASSERT_TRUE(WriteFileAtomically(path, std::vector<std::byte>(10, std::byte{1})).ok());
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    setrlimit(RLIMIT_FSIZE, &limit);
    const Status status = WriteFileAtomically(path, std::vector<std::byte>(100000, std::byte{2}));
    _exit(status.code() == StatusCode::kResourceExhausted ? 0 : 1);
  }
  int code = 0;
  waitpid(child, &code, 0);
  EXPECT_EQ(code, 0);
  EXPECT_EQ(ReadFile(path)->size(), 10u);
  int left = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(path).parent_path())) {
    left += entry.path().string().starts_with(path + ".tmp") ? 1 : 0;
  }
  EXPECT_EQ(left, 0);
  std::filesystem::remove(path);
}
#endif

#if !defined(_WIN32)  // where a folder with an open file is not moved
TEST(File, WhatIsBegunInAFolderEndsInItWhereverItIsMoved) {
  namespace fs = std::filesystem;
  const std::string root = Path("exchanged"), here = root + "/here", moved = root + "/moved";
  fs::create_directories(here);
  fs::create_directories(root + "/other");
  const std::string theirs = "theirs", ours = "ours";
  ASSERT_TRUE(WriteFileAtomically(root + "/other/model", std::as_bytes(std::span(theirs))).ok());
  const auto exchange = [&] {  // right behind the check, where a check alone sees nothing of it
    fs::rename(here, moved);
    fs::rename(root + "/other", here);
    return Status::Ok();
  };
  ASSERT_TRUE(WriteFileAtomically(here + "/model", std::as_bytes(std::span(ours)), exchange).ok());
  EXPECT_EQ(ReadFile(here + "/model")->size(), theirs.size());
  EXPECT_EQ(ReadFile(moved + "/model")->size(), ours.size());
  const auto refuse = [] { return Status{StatusCode::kDataLoss, "not this one"}; };
  EXPECT_EQ(WriteFileAtomically(here + "/model", std::as_bytes(std::span(ours)), refuse).message(), "not this one");
  EXPECT_EQ(ReadFile(here + "/model")->size(), theirs.size());
  EXPECT_EQ(std::distance(fs::directory_iterator(here), fs::directory_iterator()), 1) << "nothing half written";
  fs::remove_all(root);
}
#endif

TEST(Hash, PublishedVectors) {
  const auto bytes = [](std::string_view text) { return std::as_bytes(std::span(text)); };
  const std::span<const std::byte> abc[] = {bytes("a"), bytes("bc")};
  EXPECT_EQ(Sha256Hex(abc), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256Hex({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Crc32c(bytes("123456789")), 0xE3069283u);
  EXPECT_EQ(Crc32c(std::vector<std::byte>(32)), 0x8A9136AAu);
}

TEST(File, PieceByPieceItIsThereWholeOrNotAtAll) {
  const std::string path = Path("pieces");
  const std::string first = "first", second = "second";
  {
    AtomicFile left;
    ASSERT_TRUE(left.Open(path).ok());
    ASSERT_TRUE(left.Write(std::as_bytes(std::span(first))).ok());
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_FALSE(std::filesystem::exists(path + ".tmp-" + std::to_string(getpid()))) << "what was not committed is gone";
  AtomicFile file;
  ASSERT_TRUE(file.Open(path).ok());
  ASSERT_TRUE(file.Write(std::as_bytes(std::span(first))).ok());
  EXPECT_FALSE(std::filesystem::exists(path));
  ASSERT_TRUE(file.Write(std::as_bytes(std::span(second))).ok());
  ASSERT_TRUE(file.Commit().ok());
  FileReader reader;
  ASSERT_TRUE(reader.Open(path).ok());
  std::byte bytes[8];
  ASSERT_TRUE(reader.Read(bytes).ok());
  EXPECT_EQ(std::string_view(reinterpret_cast<const char*>(bytes), 8), "firstsec");
  EXPECT_EQ(reader.Read(bytes).code(), StatusCode::kDataLoss) << "three bytes are left";
  EXPECT_EQ(reader.Open(path + "s").code(), StatusCode::kNotFound);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace consac
