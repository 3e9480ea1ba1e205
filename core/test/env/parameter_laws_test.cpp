#include "consac/env/parameter_laws.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

namespace consac {
namespace {

using ::testing::HasSubstr;

const std::vector<ParameterSpec> kParameters = {{"gravity", 9.8, 0.0, 20.0}, {"mass", 1.0, 0.1, 10.0}, {"level", 0.0}};

TEST(ParameterLaws, AreReadAndWhatIsWrongIsNamed) {
  const auto laws = ParseParameterLaws(" gravity=uniform 5  15,mass = 2, level=ramp 1 3 1e3 ");
  ASSERT_TRUE(laws.ok()) << laws.status().message();
  ASSERT_EQ(laws->size(), 3u);
  EXPECT_EQ((*laws)[0].kind, ParameterLaw::Kind::kUniform);
  EXPECT_EQ((*laws)[0].high, 15.0);
  EXPECT_EQ((*laws)[1].low, 2.0);
  EXPECT_EQ((*laws)[2].steps, 1000.0);
  EXPECT_TRUE(ParseParameterLaws("")->empty());
  for (const char* wrong : {"gravity", "=3", "gravity=", "gravity=unifrom 1 2", "gravity=uniform 2",
                            "gravity=uniform 2 1", "gravity=nan", "gravity=log_uniform 0 1", "gravity=ramp 1 2",
                            "gravity=ramp 1 2 0", "gravity=1,", "gravity=1,gravity=2", "gravity=1 2"})
    EXPECT_FALSE(ParseParameterLaws(wrong).ok()) << wrong;
  EXPECT_THAT(ParseParameterLaws("gravity=often").status().message(),
              HasSubstr("parameter 'gravity': 'often' cannot be used"));
}

TEST(ParameterLaws, AreOfParametersThatThereAreWithinTheirBounds) {
  const auto check = [](const char* text) {
    return CheckParameterLaws(*ParseParameterLaws(text), kParameters).message();
  };
  EXPECT_EQ(check("gravity=uniform 0 20, level=-1e9"), "");
  EXPECT_THAT(check("gravty=1"), HasSubstr("there is no parameter 'gravty'; is 'gravity' meant?"));
  EXPECT_THAT(check("gravity=uniform 1 21"), HasSubstr("parameter 'gravity' cannot be 21; 0 to 20"));
  EXPECT_THAT(check("mass=ramp 0 1 9"), HasSubstr("parameter 'mass' cannot be 0"));
}

TEST(ParameterChooser, KeepsToItsLawsAndLeavesTheOthers) {
  ParameterChooser chooser(*ParseParameterLaws("gravity=uniform 5 15, level=ramp 1 3 1000"), kParameters, 7, 0);
  EXPECT_FALSE(chooser.fixed());
  double least = 20.0, most = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const std::span<const double> values = chooser.Choose(i);
    least = std::min(least, values[0]);
    most = std::max(most, values[0]);
    EXPECT_TRUE(std::isnan(values[1]));
    EXPECT_NEAR(values[2], 1.0 + 2.0 * i / 1000.0, 1e-9);
  }
  EXPECT_GE(least, 5.0);
  EXPECT_LT(least, 5.1);
  EXPECT_LT(most, 15.0);
  EXPECT_GT(most, 14.9);
  EXPECT_EQ(chooser.Choose(5000)[2], 3.0);
  EXPECT_TRUE(ParameterChooser(*ParseParameterLaws("mass=2"), kParameters, 7, 0).fixed());
}

// Half of what is drawn in the logarithm lies below the geometric mean.
TEST(ParameterChooser, DrawsInTheLogarithm) {
  ParameterChooser chooser(*ParseParameterLaws("mass=log_uniform 0.1 10"), kParameters, 7, 0);
  int below = 0;
  for (int i = 0; i < 2000; ++i) below += chooser.Choose(0)[1] < 1.0 ? 1 : 0;
  EXPECT_NEAR(below, 1000, 100);
}

TEST(ParameterChooser, OneSeedAndPlaceAreOneSequence) {
  const auto first = [](std::uint64_t seed, std::uint32_t index) {
    return ParameterChooser(*ParseParameterLaws("gravity=uniform 0 20"), kParameters, seed, index).Choose(0)[0];
  };
  EXPECT_EQ(first(1, 0), first(1, 0));
  EXPECT_NE(first(1, 0), first(1, 1));
  EXPECT_NE(first(1, 0), first(2, 0));
}

}  // namespace
}  // namespace consac
