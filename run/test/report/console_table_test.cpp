// The tables of both generations, letter by letter.
#include "report/console_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace consac::run {
namespace {

using learn::CellKind;
using learn::Row;

constexpr auto kSb2 = learn::LogStyle::kStableBaselines2, kSb3 = learn::LogStyle::kStableBaselines3;

TEST(ConsoleTable, StableBaselines2) {
  const Row row = {{"approxkl", 0.00012345, CellKind::kSingle},
                   {"clipfrac", 0.25, CellKind::kSingle},
                   {"ep_len_mean", 104.0, CellKind::kDouble},
                   {"ep_reward_mean", 21.123456, CellKind::kDouble},
                   {"explained_variance", -0.0123, CellKind::kDouble},
                   {"fps", 312345, CellKind::kInteger},
                   {"n_updates", 12, CellKind::kInteger},
                   {"policy_entropy", 0.6931472, CellKind::kSingle},
                   {"policy_loss", -1.5e-5, CellKind::kSingle},
                   {"serial_timesteps", 1536, CellKind::kInteger},
                   {"time_elapsed", 0.0000167, CellKind::kDouble},
                   {"total_timesteps", 12288, CellKind::kInteger},
                   {"value_loss", 33.0, CellKind::kSingle}};
  EXPECT_EQ(FormatTable(kSb2, row),
            "-----------------------------------\n"
            "| approxkl           | 0.00012345 |\n"
            "| clipfrac           | 0.25       |\n"
            "| ep_len_mean        | 104        |\n"
            "| ep_reward_mean     | 21.1       |\n"
            "| explained_variance | -0.0123    |\n"
            "| fps                | 312345     |\n"
            "| n_updates          | 12         |\n"
            "| policy_entropy     | 0.6931472  |\n"
            "| policy_loss        | -1.5e-05   |\n"
            "| serial_timesteps   | 1536       |\n"
            "| time_elapsed       | 1.67e-05   |\n"
            "| total_timesteps    | 12288      |\n"
            "| value_loss         | 33.0       |\n"
            "-----------------------------------\n");
}

TEST(ConsoleTable, StableBaselines3) {
  const Row row = {{"rollout/ep_len_mean", 157.0},
                   {"rollout/ep_rew_mean", -227.4},
                   {"time/fps", 972, CellKind::kInteger},
                   {"time/iterations", 19, CellKind::kInteger},
                   {"time/time_elapsed", 80, CellKind::kInteger},
                   {"time/total_timesteps", 77824, CellKind::kInteger},
                   {"train/approx_kl", 0.037781604, CellKind::kSingle},
                   {"train/clip_fraction", 0.2431},
                   {"train/explained_variance", 0.99912},
                   {"train/learning_rate", 0.001},
                   {"train/n_updates", 180, CellKind::kInteger},
                   {"train/policy_gradient_loss", -0.003981},
                   {"train/value_loss", 0.2264}};
  EXPECT_EQ(FormatTable(kSb3, row),
            "-----------------------------------------\n"
            "| rollout/                |             |\n"
            "|    ep_len_mean          | 157         |\n"
            "|    ep_rew_mean          | -227        |\n"
            "| time/                   |             |\n"
            "|    fps                  | 972         |\n"
            "|    iterations           | 19          |\n"
            "|    time_elapsed         | 80          |\n"
            "|    total_timesteps      | 77824       |\n"
            "| train/                  |             |\n"
            "|    approx_kl            | 0.037781604 |\n"
            "|    clip_fraction        | 0.243       |\n"
            "|    explained_variance   | 0.999       |\n"
            "|    learning_rate        | 0.001       |\n"
            "|    n_updates            | 180         |\n"
            "|    policy_gradient_loss | -0.00398    |\n"
            "|    value_loss           | 0.226       |\n"
            "-----------------------------------------\n");
}

TEST(ConsoleTable, LongTextsAreCut) {
  EXPECT_EQ(FormatTable(kSb2, {{"a_key_of_twenty_three_c", 1.0}}),
            "--------------------------------------\n"
            "| a_key_of_twenty_three_c | 1        |\n"
            "--------------------------------------\n");
  EXPECT_EQ(FormatTable(kSb2, {{"a_key_of_twenty_four_cha", 1.0}}),
            "--------------------------------------\n"
            "| a_key_of_twenty_four... | 1        |\n"
            "--------------------------------------\n");
  const std::string table = FormatTable(kSb3, {{"train/a_key_that_is_much_too_long_for_the_table", 1.0}});
  EXPECT_NE(table.find("|    a_key_that_is_much_too_long_fo... | 1        |\n"), std::string::npos) << table;
}

TEST(ConsoleTable, AnEmptyRowPrintsNothing) {
  EXPECT_EQ(FormatTable(kSb2, {}), "");
}

TEST(ConsoleTable, NumbersAsStableBaselinesShowsThem) {
  EXPECT_EQ(TableText({"", std::numeric_limits<double>::quiet_NaN(), CellKind::kDouble}), "nan     ");
  EXPECT_EQ(TableText({"", 123456.0, CellKind::kDouble}), "1.23e+05");
}

}  // namespace
}  // namespace consac::run
