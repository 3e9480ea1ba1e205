// Whole records or none, also when the disk is full.
#include "report/output_file.h"

#include <gtest/gtest.h>

#include "run/test/report/files.h"

namespace consac::run {
namespace {

using testing::Contents;
using testing::Put;
using testing::TestFolder;

TEST(OutputFile, TruncatesOrGoesOn) {
  const TestFolder folder;
  Put(folder.File("a"), "old\n");
  (*OutputFile::Open(folder.File("a"), OpenMode::kAppend))->Append("new\n");
  EXPECT_EQ(Contents(folder.File("a")), "old\nnew\n");
  (*OutputFile::Open(folder.File("a"), OpenMode::kTruncate))->Append("only\n");
  EXPECT_EQ(Contents(folder.File("a")), "only\n");
}

// A power cut leaves zeros, of any number; byte by byte these would be minutes.
TEST(OutputFile, IsCutToItsLastLineHoweverFarBackThatIs) {
  const TestFolder folder;
  const std::string text(200000, 'x');
  Put(folder.File("a"), "first\n" + text + "\n" + text);
  const auto file = *OutputFile::Open(folder.File("a"), OpenMode::kAppend);
  file->CutToLine(file->size());
  EXPECT_EQ(Contents(folder.File("a")), "first\n" + text + "\n");
  file->CutToLine(file->size() - 1);
  EXPECT_EQ(Contents(folder.File("a")), "first\n");
  std::filesystem::resize_file(folder.File("a"), std::uint64_t{1} << 30);
  const auto zeros = *OutputFile::Open(folder.File("a"), OpenMode::kAppend);
  zeros->CutToLine(zeros->size());
  EXPECT_EQ(Contents(folder.File("a")), "first\n");
  zeros->CutToLine(5);
  EXPECT_EQ(Contents(folder.File("a")), "");
}

TEST(OutputFile, AnErrorNamesTheFile) {
  const auto file = OutputFile::Open("/nowhere/a.csv", OpenMode::kTruncate);
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.status().code(), StatusCode::kDataLoss) << "a file that cannot be written, not a name that is unknown";
  EXPECT_NE(file.status().message().find("'/nowhere/a.csv'"), std::string::npos);
}

#if !defined(_WIN32)
TEST(OutputFile, AFullDiskLosesRecordsNeverHalfOfOne) {
  const TestFolder folder;
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kTruncate));
  const testing::FileSizeLimit limit(10);
  file->Append("12345\n");
  file->Flush();
  EXPECT_TRUE(file->status().ok());
  file->Append("67890\n");
  file->Flush();
  EXPECT_EQ(file->status().code(), StatusCode::kResourceExhausted);
  EXPECT_NE(file->status().message().find(folder.File("a")), std::string::npos);
  EXPECT_EQ(Contents(folder.File("a")), "12345\n");
  file->Append("abc\n");  // it fits
  file->Flush();
  EXPECT_EQ(Contents(folder.File("a")), "12345\nabc\n");
  EXPECT_EQ(file->size(), 10u);
  EXPECT_EQ(file->status().code(), StatusCode::kResourceExhausted) << "the first failure stays";
}

TEST(OutputFile, ALinkIsNotFollowed) {
  const TestFolder folder;
  Put(folder.File("theirs"), "theirs\n");
  ASSERT_EQ(symlink(folder.File("theirs").c_str(), folder.File("a").c_str()), 0);
  for (const OpenMode mode : {OpenMode::kAppend, OpenMode::kTruncate}) {
    const auto file = OutputFile::Open(folder.File("a"), mode);
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.status().message().find("is a link"), std::string::npos) << file.status().message();
  }
  EXPECT_EQ(Contents(folder.File("theirs")), "theirs\n");
}

TEST(OutputFile, ADeviceThatIsFull) {
  auto file = std::move(*OutputFile::Open("/dev/full", OpenMode::kAppend));
  file->Append("row\n");
  file->Flush();
  EXPECT_EQ(file->status().code(), StatusCode::kResourceExhausted);
}
#endif

TEST(OutputFile, ReplacesAllAndGoesOnBehindIt) {
  const TestFolder folder;
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kTruncate));
  file->Append("one\n");
  ASSERT_TRUE(file->Replace("two\nthree\n").ok());
  EXPECT_EQ(file->size(), 10u);
  file->Append("four\n");
  file->Flush();
  EXPECT_TRUE(file->status().ok());
  EXPECT_EQ(Contents(folder.File("a")), "two\nthree\nfour\n");
}

TEST(OutputFile, CutsAtTheEndOfALine) {
  const TestFolder folder;
  Put(folder.File("a"), "one\ntwo\nthree\n");
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kAppend));
  file->CutToLine(100);
  EXPECT_EQ(Contents(folder.File("a")), "one\ntwo\nthree\n");
  file->CutToLine(10);
  EXPECT_EQ(Contents(folder.File("a")), "one\ntwo\n");
  file->Append("more\n");
  file->CutToLine(4);
  EXPECT_EQ(Contents(folder.File("a")), "one\n");
}

}  // namespace
}  // namespace consac::run
