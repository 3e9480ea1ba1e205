// The one reader of JSON: what it refuses, and that it is linear.
#include "consac/base/json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "consac/base/hooks.h"

namespace consac {
namespace {

using nlohmann::json;

std::string Repeated(std::string_view piece, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += piece;
  return out;
}

std::string Nested(int depth) {
  return Repeated("[", static_cast<std::size_t>(depth)) + Repeated("]", static_cast<std::size_t>(depth));
}

double SecondsFor(const std::string& text) {
  const double start = Now();
  EXPECT_TRUE(ReadJson<json>(text, {.values = std::size_t{1} << 22}).ok());
  return Now() - start;
}

TEST(Json, ReadsWhatIsJson) {
  const Result<json> read = ReadJson<json>(R"({"a":[1,-2,2.5,"x",true,null,{"a":{}}]})");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(JsonText(*read), R"({"a":[1,-2,2.5,"x",true,null,{"a":{}}]})");
}

TEST(Json, RefusesWhatIsNone) {
  for (const char* text : {"", " ", "{", "[1,]", "{\"a\":1}x", "nan", "[1e999]", "{\"a\"}", "\"\xff\"", "'a'", "\xef"})
    EXPECT_EQ(ReadJson<json>(text).status().code(), StatusCode::kDataLoss) << text;
}

TEST(Json, RefusesAMemberThatIsThereTwice) {
  const Status status = CheckJson(R"({"a":1,"b":{"a":1},"a":2})");
  EXPECT_NE(status.message().find("'a' twice"), std::string::npos) << status.message();
  EXPECT_TRUE(CheckJson(R"([{"a":1},{"a":1}])").ok());
}

TEST(Json, DepthIsBoundedToTheLevel) {
  EXPECT_TRUE(CheckJson(Nested(64)).ok());
  EXPECT_FALSE(CheckJson(Nested(65)).ok());
  EXPECT_FALSE(CheckJson(Repeated("{\"a\":", 100000) + "1" + Repeated("}", 100000)).ok());
  EXPECT_FALSE(CheckJson(Repeated("[", 1000000)).ok());
}

TEST(Json, BytesAndValuesAreBounded) {
  EXPECT_TRUE(CheckJson("[1,2]", {.bytes = 5, .values = 3}).ok());
  EXPECT_FALSE(CheckJson("[1,2]", {.bytes = 4}).ok());
  EXPECT_FALSE(CheckJson("[1,2]", {.values = 2}).ok());
}

// Four times the text takes about four times as long; a quadratic reader takes sixteen times. The texts that froze one.
TEST(Json, TimeIsLinearInSize) {
  for (const char* piece : {"{},", "[],", "0,", "\"\","}) {
    const auto of = [&](std::size_t count) { return "[" + Repeated(piece, count) + "0]"; };
    double best = 1e9;
    for (int tries = 0; tries < 5 && best >= 9.0; ++tries)
      best = std::min(best, SecondsFor(of(200000)) / SecondsFor(of(50000)));
    EXPECT_LT(best, 9.0) << piece;
  }
}

TEST(Json, TextNeedsNoUtf8) {
  EXPECT_EQ(JsonText(json("a\xff")), "\"a\xef\xbf\xbd\"");
  EXPECT_EQ(AsciiJsonText(json("\xc3\xa4\x1b\x7f")), R"("\u00e4\u001b\u007f")");
}

// nlohmann's reader takes it for the end, and whatever follows for nothing.
TEST(Json, ANulByteIsNotTheEnd) {
  EXPECT_TRUE(CheckJson("{}").ok());
  EXPECT_EQ(CheckJson(std::string_view("{}\0[[[", 6)).code(), StatusCode::kDataLoss);
  EXPECT_FALSE(CheckJson(std::string_view("2\0", 2)).ok());
}

}  // namespace
}  // namespace consac
