// Every way to the system's randomness fills all that was asked for, and never twice alike.
#include "base/entropy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace consac {
namespace {

class EachEntropySource : public ::testing::TestWithParam<EntropySource> {};
INSTANTIATE_TEST_SUITE_P(Each, EachEntropySource,
                         ::testing::ValuesIn(EntropySources().begin(), EntropySources().end()));

TEST_P(EachEntropySource, FillsEveryByteAndNotTheSameTwice) {
  std::array<unsigned char, 1000> first{}, second{};
  ASSERT_TRUE(GetParam()(first));
  ASSERT_TRUE(GetParam()(second));
  EXPECT_NE(first, second);
  // 1000 bytes that were all drawn hold about four zeros; a quarter that was left out would hold 250.
  for (const auto& drawn : {first, second}) EXPECT_LT(std::count(drawn.begin() + 750, drawn.end(), 0), 60);
  EXPECT_TRUE(GetParam()({}));
}

TEST(UnguessableHex, IsTwiceAsManyDigitsAndNotTheSameTwice) {
  const std::string name = UnguessableHex(33);
  EXPECT_EQ(name.size(), 66u);
  EXPECT_EQ(name.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(name, UnguessableHex(33));
  EXPECT_EQ(UnguessableHex(0), "");
}

}  // namespace
}  // namespace consac
