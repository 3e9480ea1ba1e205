// Numbers and names as text.
#include "consac/base/text.h"

#include <gtest/gtest.h>

#include <charconv>
#include <clocale>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/shortest.h"
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

template <class Number>
void ExpectAsToChars(Number value) {
  char expected[32];
  char text[32];
  const std::string_view wanted(expected, std::to_chars(expected, expected + sizeof(expected), value).ptr);
  const std::size_t length = FormatWithoutToChars(value, std::span<char, 32>(text));
  ASSERT_EQ(std::string_view(text, length), wanted);
}

template <class Number>
void ExpectAllAsToChars() {
  using Limits = std::numeric_limits<Number>;
  for (const Number value :
       {Number{0}, Limits::min(), Limits::max(), Limits::lowest(), Limits::denorm_min(), Limits::epsilon(),
        Limits::infinity(), Limits::quiet_NaN(), Number(123456789), Number(1e22), Number(1e23)}) {
    ExpectAsToChars(value);
    ExpectAsToChars(-value);
    ExpectAsToChars(std::nextafter(value, Number{0}));
    ExpectAsToChars(std::nextafter(value, Number{1}));
  }
  // The gap below a power of two is half of that above: 2^-44 as a double is one whose nearest 16 digits do not read
  // back.
  for (int exponent = Limits::min_exponent - Limits::digits; exponent < Limits::max_exponent; ++exponent) {
    ExpectAsToChars(std::ldexp(Number{1}, exponent));
    ExpectAsToChars(std::ldexp(Number{3}, exponent - 1));
  }
  for (int exponent = Limits::min_exponent10; exponent <= Limits::max_exponent10; ++exponent) {
    const Number ten = std::pow(Number{10}, static_cast<Number>(exponent));
    ExpectAsToChars(ten);
    ExpectAsToChars(std::nextafter(ten, Number{0}));
    ExpectAsToChars(ten / 7);
  }
}

TEST(Text, WithoutToCharsItIsTheSameText) {
  ExpectAllAsToChars<float>();
  ExpectAllAsToChars<double>();
  Rng rng(1, 4);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = (std::uint64_t{rng.NextU32()} << 32) | rng.NextU32();
    double random = 0;
    std::memcpy(&random, &bits, sizeof(random));
    ExpectAsToChars(random);
    ExpectAsToChars(static_cast<float>(static_cast<std::int32_t>(rng.NextU32())) / 1000.0f);
    const std::uint32_t half = rng.NextU32();
    float random_float = 0;
    std::memcpy(&random_float, &half, sizeof(random_float));
    ExpectAsToChars(random_float);
  }
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
  char text[32];
  const std::size_t length = FormatWithoutToChars(1.5, std::span<char, 32>(text));
  EXPECT_EQ(std::string_view(text, length), "1.5");
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
  EXPECT_EQ(NearestName("rate_learning", kKnown), "learning_rate");
  EXPECT_EQ(Suggestion("gama", kKnown), " (did you mean 'gamma'?)");
}

}  // namespace
}  // namespace consac
