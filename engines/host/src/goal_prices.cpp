#include "goal_prices.h"

#include <cmath>
#include <string>

#include "consac/base/text.h"
#include "consac/protocol/relabel.h"

namespace consac::host {

Result<GoalPrices> GoalPrices::Of(const Goals& goals, const BehaviourSpec& behaviour) {
  GoalPrices prices;
  if (goals.reward == GoalReward::kNone) return prices;
  const auto wrong = [&](const std::string& what) {
    return Status{StatusCode::kInvalidArgument, "behaviour '" + behaviour.name + "' has a goal reward, but " + what};
  };
  const Layout& layout = behaviour.observation_layout;
  if (!protocol2::HasGoals(layout))
    return wrong("no observations 'achieved_goal' and 'desired_goal' that are alike; give it both, of one space");
  if (goals.reward == GoalReward::kSparse && !(goals.threshold >= 0.0 && std::isfinite(goals.threshold)))
    return wrong("its threshold is " + NumberText(goals.threshold) + "; give a distance of 0 or more");
  if (goals.reward == GoalReward::kFunction && !goals.price)
    return wrong("no function that prices goals; give one, or choose sparse or dense");
  prices.goals_ = goals;
  prices.row_bytes_ = layout.row_bytes;
  for (const Leaf& leaf : layout.leaves) {
    const auto below = PathBelow(kAchievedGoal, leaf);
    if (below.has_value()) prices.parts_.emplace_back(leaf, *FindLeafBelow(layout, kDesiredGoal, *below));
  }
  return prices;
}

void GoalPrices::Price(const std::byte* observations, std::int64_t rows, float* rewards) const {
  if (goals_.reward == GoalReward::kFunction) return goals_.price(observations, rows, rewards);
  for (std::int64_t i = 0; i < rows; ++i) {
    const float distance = Distance(observations + static_cast<std::size_t>(i) * row_bytes_);
    const bool there = distance <= static_cast<float>(goals_.threshold);  // float32's 0.1 is 0.1 or less
    rewards[i] = goals_.reward == GoalReward::kDense ? -distance : there ? 0.0f : -1.0f;
  }
}

float GoalPrices::Distance(const std::byte* row) const {
  double squares = 0.0;
  for (const auto& [achieved, desired] : parts_) {
    for (std::int64_t i = 0; i < achieved.count; ++i) {
      const double apart = ReadElement(desired, row, i) - ReadElement(achieved, row, i);
      squares += apart * apart;
    }
  }
  return static_cast<float>(std::sqrt(squares));
}

}  // namespace consac::host
