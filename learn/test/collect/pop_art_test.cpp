// What belongs to a critic besides its network: values by their running moments, and the penalty on its weights.
#include "collect/pop_art.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "consac/nn/action_networks.h"
#include "optim/weight_penalty.h"

namespace consac::learn {
namespace {

nn::Network SmallCritic() {
  nn::TowerOptions tower;
  tower.layers = {5, 4};
  return *nn::Network::Create(
      *nn::Critics(Layout::Of(*Space::Box(-1, 1, {2})), {.tower = tower, .action_size = 1, .count = 1}, {}));
}

TEST(PopArt, OutputsOfBothNetworksGoOnToMeanWhatTheyMeant) {
  const nn::Network network = SmallCritic();
  LearnedNetwork critic(network, Rng(1, 1), {});
  PopArt pop_art(&critic, "qf0/head");
  const float seen[] = {0.3f, -0.8f}, done[] = {0.6f};
  const float* inputs[] = {seen, done};
  const auto value = [&](SlicedEvaluator& of) {
    of.Forward(inputs, 1);
    return pop_art.Value(of.output(0)[0]);
  };
  EXPECT_EQ(pop_art.mean(), 0.0);
  EXPECT_EQ(pop_art.deviation(), 1.0);
  const double now = value(critic.Online()), of_target = value(critic.Target());  // both are packed by now
  pop_art.Take(std::vector<float>{100.0f, 300.0f});
  EXPECT_NEAR(pop_art.mean(), 200.0, 2.0);
  EXPECT_GT(pop_art.deviation(), 90.0);
  EXPECT_NEAR(value(critic.Online()), now, 1e-3);
  EXPECT_NEAR(value(critic.Target()), of_target, 1e-3);
  EXPECT_NEAR(pop_art.Output(300.0f), (300.0 - pop_art.mean()) / pop_art.deviation(), 1e-12);
}

TEST(PopArt, MovesTheLayerOfItsOutputAlone) {
  const nn::Network network = SmallCritic();
  LearnedNetwork critic(network, Rng(1, 1), {});
  const std::vector<float> before(critic.parameters().begin(), critic.parameters().end());
  PopArt(&critic, "qf0/head").Take(std::vector<float>{-50.0f, 90.0f});
  for (const nn::Parameter& tensor : network.parameters()) {
    const auto at = static_cast<std::size_t>(tensor.offset);
    EXPECT_EQ(critic.parameters()[at] != before[at], tensor.name.starts_with("qf0/head/")) << tensor.name;
  }
}

TEST(PopArt, SumsThatNoTrainingLeavesAreRefused) {
  const double kNan = std::nan("");
  LearnedNetwork critic(SmallCritic(), Rng(1, 1), {});
  PopArt pop_art(&critic, "qf0/head");
  pop_art.Take(std::vector<float>{1.0f, 2.0f});
  StateWriter writer;
  writer("pop_art", pop_art);
  const auto status_with = [&](std::size_t place, double number) {
    StateMap fields = writer.fields();
    std::memcpy(fields["pop_art/sums"].bytes.data() + place * sizeof(double), &number, sizeof(number));
    StateReader reader(fields);
    PopArt other(&critic, "qf0/head");
    reader("pop_art", other);
    return reader.status();
  };
  EXPECT_TRUE(status_with(0, -3.0).ok()) << "targets may be negative";
  for (const auto& [place, number] : {std::pair(0, kNan), std::pair(1, -1.0), std::pair(1, kNan), std::pair(2, 0.0),
                                      std::pair(2, -4.0), std::pair(2, HUGE_VAL)}) {
    const Status status = status_with(static_cast<std::size_t>(place), number);
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << place << ": " << number;
    EXPECT_NE(status.message().find("'pop_art/sums' is out of its range"), std::string::npos) << status.message();
  }
}

TEST(WeightPenalty, ItsGradientIsThatOfHalfTheSquaresOfHiddenWeights) {
  const nn::Network network = SmallCritic();
  const LearnedNetwork critic(network, Rng(2, 2), {});
  std::vector<float> gradient(critic.parameters().size(), 1.0f);
  WeightPenalty(network, "qf0/head", 0.25).AddGradient(critic.parameters(), gradient);
  int penalised = 0;
  for (const nn::Parameter& tensor : network.parameters()) {
    const bool hidden = tensor.name.ends_with("/w") && tensor.name != "qf0/head/w";
    penalised += hidden ? 1 : 0;
    for (std::int64_t i = tensor.offset; i < tensor.offset + tensor.count; ++i) {
      const auto at = static_cast<std::size_t>(i);
      EXPECT_EQ(gradient[at], hidden ? 1.0f + 0.25f * critic.parameters()[at] : 1.0f) << tensor.name;
    }
  }
  EXPECT_EQ(penalised, 2);
  std::vector<float> none(gradient.size(), 1.0f);
  WeightPenalty(network, "qf0/head", 0.0).AddGradient(critic.parameters(), none);
  EXPECT_EQ(none, std::vector<float>(gradient.size(), 1.0f));
}

}  // namespace
}  // namespace consac::learn
