// Text from outside as names, files' names and lines.
#include "consac/base/names.h"

#include <gtest/gtest.h>

#include <set>

#include "consac/base/hooks.h"
#include "consac/base/rng.h"
#include "consac/base/text.h"

namespace consac {
namespace {

const std::string kUmlauts = "L\xc3\xa4ufer \xe8\xb5\xb0\xe8\x80\x85 \xf0\x9f\x8f\x83";  // two, three and four bytes
const std::string kOverride = "a\u202Eb";                                                // U+202E turns what follows

TEST(Names, TextThatShowsStaysReadable) {
  EXPECT_EQ(PrintableLine(kUmlauts), kUmlauts);
  EXPECT_EQ(Quote(kUmlauts), "'" + kUmlauts + "'");
  const std::string family = "\xf0\x9f\x91\xa9\xe2\x80\x8d\xf0\x9f\x91\xa7";  // with a joiner, which belongs to it
  EXPECT_EQ(PrintableLine(family), family);
}

TEST(Names, WhatDoesNotShowIsEscapedByteByByte) {
  EXPECT_EQ(PrintableLine("a\nb\x1b[2J\x7f\r"), "a\\x0ab\\x1b[2J\\x7f\\x0d");
  EXPECT_EQ(PrintableLine(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(PrintableLine(kOverride), "a\\xe2\\x80\\xaeb");
  EXPECT_EQ(PrintableLine("\xc2\x9b"
                          "2J"),
            "\\xc2\\x9b"
            "2J")
      << "CSI of one character";
  EXPECT_EQ(PrintableLine("\xe2\x80\xa8"), "\\xe2\\x80\\xa8") << "a line separator";
  EXPECT_EQ(PrintableLine("\xef\xbb\xbf"), "\\xef\\xbb\\xbf") << "a byte order mark";
}

TEST(Names, WhatIsNoUtf8IsEscaped) {
  for (const std::string bytes : {"\xff", "\xc3", "\xc3(", "\xe2\x80", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80",
                                  "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80", "\x80"}) {
    const std::string line = PrintableLine("<" + bytes + ">");
    EXPECT_EQ(line.find_first_of(bytes.substr(0, 1)), std::string::npos) << line;
    EXPECT_EQ(line.back(), '>');
  }
}

TEST(Names, ALineOfAnyBytesIsSafeAndStaysAsItIs) {
  Rng rng(3, 4);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes;
    for (int k = 0; k < 40; ++k) bytes += static_cast<char>(rng.Below(256));
    const std::string line = PrintableLine(bytes);
    for (const char c : line) ASSERT_TRUE(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f);
    ASSERT_EQ(PrintableLine(line), line);
  }
}

TEST(Names, TextOfSeveralLinesKeepsItsLineEnds) {
  EXPECT_EQ(PrintableText("a\nb\x1b[1A\n"), "a\nb\\x1b[1A\n");
}

TEST(Names, AQuoteIsNotCutWithinACharacter) {
  EXPECT_EQ(Quote("a\xc3\xa4z", 2), "'a'... (4 bytes)");
  EXPECT_EQ(Quote("a\xc3\xa4z", 3), "'a\xc3\xa4'... (4 bytes)");
}

TEST(Names, AnErrorsMessageAndALogLineAreOneLine) {
  const Status status(StatusCode::kUnavailable, "ends: \x1b[2K\ntraining completed");
  EXPECT_EQ(status.message(), "ends: \\x1b[2K\\x0atraining completed");
  const Status flood(StatusCode::kUnavailable, std::string(100000, 'x'));
  EXPECT_LT(flood.message().size(), 5000u);
  EXPECT_NE(flood.message().find("(100000 bytes)"), std::string::npos);

  std::string logged;
  Hooks hooks;
  hooks.user = &logged;
  hooks.log = [](void* user, LogLevel, std::string_view line) { *static_cast<std::string*>(user) = line; };
  SetHooks(hooks);
  Log(LogLevel::kWarning, "a\nb\x1b");
  SetHooks({});
  EXPECT_EQ(logged, "a\\x0ab\\x1b");
}

TEST(Names, ANameIsShortUtf8ThatShows) {
  EXPECT_TRUE(CheckName("behaviour", kUmlauts).ok());
  EXPECT_TRUE(CheckName("behaviour", std::string(kLongestName, 'x')).ok());
  for (const std::string& bad : {std::string(), std::string(kLongestName + 1, 'x'), std::string("a\0", 2),
                                 std::string("a\nb"), kOverride, std::string("\xff")}) {
    const Status status = CheckName("behaviour", bad);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << bad;
    EXPECT_NE(status.message().find("behaviour name"), std::string::npos);
  }
  EXPECT_TRUE(CheckOptionalName("model", "").ok());
  EXPECT_FALSE(CheckOptionalName("model", "\n").ok());
}

TEST(Names, TogetherTheyMakeDifferentFilesWhereCapitalsDoNotCount) {
  const auto check = [](std::vector<std::string_view> names) { return CheckNamesTogether("behaviour", names); };
  EXPECT_TRUE(check({"walker", "runner", kUmlauts}).ok());
  EXPECT_FALSE(check({"walker", "walker"}).ok());
  EXPECT_FALSE(check({"walker", "Walker"}).ok());
  EXPECT_TRUE(check({"\xc3\xa4", "\xc3\x84"}).ok()) << "their files are %C3%A4 and %C3%84";
  const std::string longest(kLongestName, 'x');
  EXPECT_TRUE(check({longest}).ok());
  EXPECT_FALSE(check({longest, "walker"}).ok()) << "too long for a file's name";
}

TEST(Names, AFileNameIsNoPathNoDeviceAndNotHidden) {
  EXPECT_EQ(FileNameOf("walker_2.b c", ".consac"), "walker_2.b c.consac");
  EXPECT_EQ(FileNameOf("../../.bashrc", ".consac"), "%2E.%2F..%2F.bashrc.consac");
  EXPECT_EQ(FileNameOf("/etc/passwd", ""), "%2Fetc%2Fpasswd");
  EXPECT_EQ(FileNameOf("c:\\x", ""), "c%3A%5Cx");
  EXPECT_EQ(FileNameOf(std::string_view("a\0b", 3), ""), "a%00b");
  EXPECT_EQ(FileNameOf("con", ".consac"), "%63on.consac");
  EXPECT_EQ(FileNameOf("LPT1 .x", ""), "%4CPT1 .x");
  EXPECT_EQ(FileNameOf("console", ""), "console");
  EXPECT_EQ(FileNameOf(" a.", ""), "%20a%2E");
}

TEST(Names, DifferentNamesHaveDifferentFiles) {
  std::set<std::string> files;
  std::set<std::string> names = {"con", "%63on", "%", "%25", ".a", "%2Ea", "a ", "a%20", "CON", "%43ON"};
  for (int a = 0; a < 256; ++a) {
    for (int b = 0; b < 256; ++b) names.insert({static_cast<char>(a), static_cast<char>(b)});
  }
  for (const std::string& name : names) {
    const std::string file = FileNameOf(name, ".consac");
    EXPECT_TRUE(files.insert(file).second) << file;
    EXPECT_EQ(file.find_first_of("/\\:*?\"<>|"), std::string::npos) << file;
  }
}

TEST(Names, AFolderNameIsPlain) {
  for (const char* good : {"walker", "road-v0__ppo__1", "a.b"}) EXPECT_TRUE(CheckFolderName("run", good).ok()) << good;
  for (const char* bad : {"", ".", "..", "a/b", "../x", ".a", "a.", "a b", "con", "NUL.txt", "com1", "caf\xc3\xa9"}) {
    EXPECT_FALSE(CheckFolderName("run", bad).ok()) << bad;
    EXPECT_TRUE(CheckFolderName("run", AsFolderName(bad)).ok()) << AsFolderName(bad);
  }
  EXPECT_TRUE(CheckFolderName("run", AsFolderName("." + std::string(1000, 'x'))).ok());
  EXPECT_EQ(AsFolderName("..abcdef", 4), "_..a");
  const std::string why = CheckFolderName("run", std::string(kLongestFolder + 1, 'x')).message();
  EXPECT_NE(why.find("has 129 bytes, a folder at most 128; shorten it"), std::string::npos) << why;
}

}  // namespace
}  // namespace consac
