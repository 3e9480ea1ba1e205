#include "consac/env/begins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "consac/env/buffer.h"

namespace consac {
namespace {

using ::testing::ElementsAre;

TEST(EpisodeBegins, WhereAnEpisodeEndedOrNobodyActed) {
  BatchBuffer rows(BehaviourSpec::Of("default", *Space::Discrete(2), *Space::Discrete(2), 4));
  Batch& batch = rows.batch();
  std::fill_n(batch.terminated, 4, std::uint8_t{0});
  std::fill_n(batch.truncated, 4, std::uint8_t{0});
  EpisodeBegins begins(4);
  const std::int32_t everyone[] = {0, 1, 2, 3}, some[] = {0, 2};
  EXPECT_THAT(begins.Next(batch, everyone), ElementsAre(1, 1, 1, 1));
  EXPECT_THAT(begins.Next(batch, everyone), ElementsAre(0, 0, 0, 0));
  batch.terminated[1] = batch.truncated[2] = 1;
  EXPECT_THAT(begins.Next(batch, everyone), ElementsAre(0, 1, 1, 0));
  batch.terminated[1] = batch.truncated[2] = 0;
  EXPECT_THAT(begins.Next(batch, some), ElementsAre(0, 0));
  EXPECT_THAT(begins.Next(batch, everyone), ElementsAre(0, 1, 0, 1)) << "agents that have come";
  begins.Restart();
  EXPECT_THAT(begins.Next(batch, some), ElementsAre(1, 1));
}

}  // namespace
}  // namespace consac
