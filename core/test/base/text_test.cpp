// Numbers and names as text.
#include "consac/base/text.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cstring>

#include "consac/base/rng.h"

namespace consac {
namespace {

TEST(Text, EveryFloatReadsBackExactly) {
  Rng rng(1, 2);
  for (int i = 0; i < 100000; ++i) {
    const std::uint32_t bits = rng.NextU32();
    float value = 0;
    std::memcpy(&value, &bits, sizeof(value));
    if (value != value || value - value != 0) continue;
    char text[32];
    const std::size_t length = FormatNumber(value, std::span<char, 32>(text));
    float back = 1;
    ASSERT_TRUE(ParseNumber(std::string_view(text, length), &back));
    ASSERT_EQ(std::memcmp(&value, &back, sizeof(value)), 0) << std::string(text, length);
  }
}

TEST(Text, ShortestForm) {
  EXPECT_EQ(NumberText(0.1), "0.1");
  EXPECT_EQ(NumberText(40), "40");
  EXPECT_EQ(NumberText(-2.5), "-2.5");
}

TEST(Text, RefusesWhatIsNoFiniteNumber) {
  float value = 0;
  for (const char* text :
       {"", " 1", "1 ", "nan", "inf", "-inf", "1e999", "0x10", "1,5", "--1", "1.5.2", "1#", "+-5", "++5"}) {
    EXPECT_FALSE(ParseNumber(text, &value)) << text;
  }
  EXPECT_TRUE(ParseNumber("+1.5e-3", &value));
  EXPECT_FLOAT_EQ(value, 1.5e-3f);
}

TEST(Text, PeoplesNumbers) {
  std::int64_t whole = 0;
  for (const char* text : {"1000000", "1_000_000", "1e6", "1E6", "1_000e3"}) {
    EXPECT_TRUE(ParseHumanNumber(text, &whole)) << text;
    EXPECT_EQ(whole, 1000000) << text;
  }
  EXPECT_TRUE(ParseHumanNumber("1e18", &whole));
  EXPECT_EQ(whole, 1000000000000000000);
  for (const char* text : {"_1", "1_", "1__0", "1.5", "1e19", "1e30", "nan", ""})
    EXPECT_FALSE(ParseHumanNumber(text, &whole)) << text;
  double real = 0.0;
  EXPECT_TRUE(ParseHumanNumber("1_0.5", &real));
  EXPECT_EQ(real, 10.5);
}

TEST(Text, IgnoresTheLocale) {
  if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr) GTEST_SKIP() << "no locale with a decimal comma is installed";
  EXPECT_EQ(NumberText(1.5), "1.5");
  double value = 0;
  EXPECT_TRUE(ParseNumber("1.5", &value));
  std::setlocale(LC_ALL, "C");
}

TEST(Text, QuoteIsOneSafeLine) {
  EXPECT_EQ(Quote("a\nb\x01"), "'a\\x0ab\\x01'");
  EXPECT_EQ(Quote("abcdef", 3), "'abc'... (6 bytes)");
}

TEST(Text, NearestNameIsMeantOrEmpty) {
  constexpr std::string_view kKnown[] = {"learning_rate", "gamma", "n_steps"};
  EXPECT_EQ(NearestName("learnin_rate", kKnown), "learning_rate");
  EXPECT_EQ(NearestName("gama", kKnown), "gamma");
  EXPECT_EQ(NearestName("completely_different_thing", kKnown), "");
  EXPECT_EQ(Suggestion("gama", kKnown), " (did you mean 'gamma'?)");
}

}  // namespace
}  // namespace consac
