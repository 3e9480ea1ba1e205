// Whole records or none, also when the disk is full.
#include "consac/learn/log/output_file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/files.h"
#include "tests/folder.h"

namespace consac::learn {
namespace {

#if !defined(_WIN32)
using testing::FileSizeLimit;
#endif
using testing::Put;
using testing::TestFolder;
using testing::TextOf;

TEST(OutputFile, TruncatesOrGoesOn) {
  const TestFolder folder;
  Put(folder.File("a"), "old\n");
  (*OutputFile::Open(folder.File("a"), OpenMode::kAppend))->Append("new\n");
  EXPECT_EQ(TextOf(folder.File("a")), "old\nnew\n");
  (*OutputFile::Open(folder.File("a"), OpenMode::kTruncate))->Append("only\n");
  EXPECT_EQ(TextOf(folder.File("a")), "only\n");
}

// A power cut leaves zeros, and many; byte by byte these would be minutes. What they cannot come from stays, and is not
// read to its end.
TEST(OutputFile, IsCutToItsLastLineHoweverFarBackThatIs) {
  const TestFolder folder;
  const std::string text(200000, 'x');
  Put(folder.File("a"), "first\n" + text + "\n" + text);
  const auto file = *OutputFile::Open(folder.File("a"), OpenMode::kAppend);
  ASSERT_TRUE(file->CutToLine(file->size()).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "first\n" + text + "\n");
  ASSERT_TRUE(file->CutToLine(file->size() - 1).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "first\n");
  std::filesystem::resize_file(folder.File("a"), std::uint64_t{60} << 20);
  const auto zeros = *OutputFile::Open(folder.File("a"), OpenMode::kAppend);
  ASSERT_TRUE(zeros->CutToLine(zeros->size()).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "first\n");
  ASSERT_TRUE(zeros->CutToLine(5).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "");
  std::filesystem::resize_file(folder.File("a"), std::uint64_t{20} << 30);
  const auto many = *OutputFile::Open(folder.File("a"), OpenMode::kAppend);
  for (const Status& refused :
       {many->CutToLine(many->size()), many->CutLinesWhile([](std::string_view) { return true; }),
        many->FirstLine().status()}) {
    EXPECT_EQ(refused.code(), StatusCode::kDataLoss);
    EXPECT_NE(refused.message().find("64 MiB without an end of a line"), std::string::npos) << refused.message();
  }
  EXPECT_EQ(std::filesystem::file_size(folder.File("a")), std::uint64_t{20} << 30);
}

TEST(OutputFile, AnErrorNamesTheFile) {
  const auto file = OutputFile::Open("/nowhere/a.csv", OpenMode::kTruncate);
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.status().code(), StatusCode::kDataLoss) << "a file that cannot be written, not a name that is unknown";
  EXPECT_NE(file.status().message().find("'/nowhere/a.csv'"), std::string::npos);
}

TEST(OutputFile, WhatHasAnotherNameIsNeitherEmptiedNorWrittenTo) {
  const TestFolder folder;
  Put(folder.File("precious"), "theirs\n");
  std::filesystem::create_hard_link(folder.File("precious"), folder.File("a"));
  for (const OpenMode mode : {OpenMode::kTruncate, OpenMode::kAppend}) {
    const auto file = OutputFile::Open(folder.File("a"), mode);
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.status().message().find("a' has another name (a hard link)"), std::string::npos);
    EXPECT_EQ(TextOf(folder.File("precious")), "theirs\n");
  }
}

#if !defined(_WIN32)
TEST(OutputFile, AFullDiskLosesRecordsNeverHalfOfOne) {
  const TestFolder folder;
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kTruncate));
  const FileSizeLimit limit(10);
  file->Append("12345\n");
  file->Flush();
  EXPECT_TRUE(file->status().ok());
  file->Append("67890\n");
  file->Flush();
  EXPECT_EQ(file->status().code(), StatusCode::kResourceExhausted);
  EXPECT_NE(file->status().message().find(folder.File("a")), std::string::npos);
  EXPECT_EQ(TextOf(folder.File("a")), "12345\n");
  file->Append("abc\n");  // it fits
  file->Flush();
  EXPECT_EQ(TextOf(folder.File("a")), "12345\nabc\n");
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
  EXPECT_EQ(TextOf(folder.File("theirs")), "theirs\n");
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
  EXPECT_EQ(TextOf(folder.File("a")), "two\nthree\nfour\n");
}

#if !defined(_WIN32)  // where a file that is open is not moved
TEST(OutputFile, AnotherFileUnderItsNameIsNotReplaced) {
  const TestFolder folder;
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kTruncate));
  file->Append("one\n");
  file->Flush();
  std::filesystem::rename(folder.File("a"), folder.File("moved"));
  Put(folder.File("a"), "theirs\n");
  EXPECT_EQ(file->Replace("two\n").code(), StatusCode::kDataLoss);
  file->Append("three\n");
  file->Flush();
  EXPECT_EQ(TextOf(folder.File("a")), "theirs\n");
  EXPECT_EQ(TextOf(folder.File("moved")), "one\nthree\n");
}
#endif

TEST(OutputFile, CutsLinesOffItsEnd) {
  const TestFolder folder;
  const std::string text = std::string(300000, 'x') + "\n";
  std::string seen;
  Put(folder.File("a"), "head\nb\n" + text + "\nc\nhalf");
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kAppend));
  const auto cut = [&](char last) {
    return file->CutLinesWhile([&](std::string_view line) {
      seen += line.substr(0, 1).empty() ? "-" : std::string(line.substr(0, 1));
      return line != std::string(1, last) && line != "head";
    });
  };
  ASSERT_TRUE(cut('b').ok());
  EXPECT_EQ(seen, "c-xb");
  EXPECT_EQ(TextOf(folder.File("a")), "head\nb\n");
  EXPECT_EQ(*file->FirstLine(), "head");
  file->Append(text);
  file->Append("d\n");
  ASSERT_TRUE(cut('d').ok());
  EXPECT_EQ(TextOf(folder.File("a")), "head\nb\n" + text + "d\n");
  ASSERT_TRUE(file->CutLinesWhile([](std::string_view) { return true; }).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "");
}

TEST(OutputFile, TakesARecordThatIsLongerThanItsBuffer) {
  const TestFolder folder;
  const std::string row = std::string(3 * OutputFile::kBufferBytes, 'x') + "\n";
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kTruncate));
  file->Append("first\n");
  file->Append(row);
  file->Append("last\n");
  file->Flush();
  EXPECT_EQ(TextOf(folder.File("a")), "first\n" + row + "last\n");
}

TEST(OutputFile, CutsAtTheEndOfALine) {
  const TestFolder folder;
  Put(folder.File("a"), "one\ntwo\nthree\n");
  auto file = std::move(*OutputFile::Open(folder.File("a"), OpenMode::kAppend));
  ASSERT_TRUE(file->CutToLine(100).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "one\ntwo\nthree\n");
  ASSERT_TRUE(file->CutToLine(10).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "one\ntwo\n");
  file->Append("more\n");
  ASSERT_TRUE(file->CutToLine(4).ok());
  EXPECT_EQ(TextOf(folder.File("a")), "one\n");
}

}  // namespace
}  // namespace consac::learn
