// The table of algorithms. A new one is its own files and one row here.
#include <vector>

#include "algo/algorithms.h"
#include "consac/base/rng.h"
#include "consac/base/text.h"

namespace consac::learn {
namespace {

constexpr std::size_t kMostAdded = 32;

/// An algorithm that has two generations, as one of them.
template <Generation generation, auto create>
Result<std::unique_ptr<Learner>> As(const LearnerOptions& options, const HyperparameterSet& values) {
  return create(generation, options, values);
}

std::vector<Algorithm>& AlgorithmTable() {
  static std::vector<Algorithm> table = [] {
    std::vector<Algorithm> own = {
        {"ppo2", "proximal policy optimisation as in Stable Baselines 2.10.2, the thesis' algorithm",
         LogStyle::kStableBaselines2, PpoTable(Generation::kStableBaselines2),
         As<Generation::kStableBaselines2, CreatePpo>},
        {"ppo", "proximal policy optimisation as in Stable Baselines3", LogStyle::kStableBaselines3,
         PpoTable(Generation::kStableBaselines3), As<Generation::kStableBaselines3, CreatePpo>},
        {"a2c", "advantage actor-critic, as in Stable Baselines3 or, with the preset sb2, 2.10.2",
         LogStyle::kStableBaselines3, A2cTable(), CreateA2c},
        {"dqn", "deep Q-learning, as in Stable Baselines3 or, with the preset sb2, 2.10.2", LogStyle::kStableBaselines3,
         DqnTable(), CreateDqn},
        {"sac", "soft actor-critic for Box actions, as in Stable Baselines3 or, with the preset sb2, 2.10.2",
         LogStyle::kStableBaselines3, SacTable(), CreateSac},
        {"td3",
         "twin delayed deterministic policy gradient for Box actions, as in Stable Baselines3 or, with the preset sb2, "
         "2.10.2",
         LogStyle::kStableBaselines3, Td3Table(), CreateTd3},
        {"ddpg",
         "deep deterministic policy gradient for Box actions, as in Stable Baselines3 or, with the preset sb2, 2.10.2",
         LogStyle::kStableBaselines3, DdpgTable(), CreateDdpg},
    };
    own.reserve(own.size() + kMostAdded);  // rows stay where they are
    return own;
  }();
  return table;
}

/// The value of a hyperparameter; "" where there is none of that name.
std::string_view TextOf(const HyperparameterSet& values, std::string_view name) {
  for (const Hyperparameter& row : values.table()) {
    if (row.name == name) return values.Text(name);
  }
  return {};
}

}  // namespace

void AddAlgorithm(const Algorithm& algorithm) {
  std::vector<Algorithm>& table = AlgorithmTable();
  CONSAC_ASSERT(table.size() < table.capacity() && !FindAlgorithm(algorithm.name).ok());
  if (table.size() < table.capacity()) table.push_back(algorithm);
}

std::span<const Algorithm> Algorithms() {
  return AlgorithmTable();
}

std::uint64_t BehaviourSeed(std::uint64_t seed, std::size_t b) {
  return b == 0 ? seed : Rng(seed, StreamId("behaviour"), static_cast<std::uint32_t>(b)).NextU64();
}

LogStyle LogStyleOf(const Algorithm& algorithm, const HyperparameterSet& values) {
  const std::string_view keys = TextOf(values, "log_keys");
  if (keys.empty()) return algorithm.log_style;
  return keys == "sb2" ? LogStyle::kStableBaselines2 : LogStyle::kStableBaselines3;
}

bool RelabelsGoals(const Algorithm& algorithm, const HyperparameterSet& values) {
  return algorithm.relabels_goals || TextOf(values, "replay_buffer_class") == "HerReplayBuffer";
}

Status CheckTogether(const HyperparameterSet& values) {
  if (TextOf(values, "replay_buffer_class") != "HerReplayBuffer") return Status::Ok();
  const auto refuse = [](const std::string& why) {
    return Status{StatusCode::kInvalidArgument, "HerReplayBuffer " + why};
  };
  if (TextOf(values, "prioritized_replay") == "true")
    return refuse("does not draw by priority; leave out prioritized_replay");
  const std::string_view n_steps = TextOf(values, "n_steps");
  if (n_steps.empty() || n_steps == "1") return Status::Ok();
  return refuse("looks one step ahead, and n_steps is " + std::string(n_steps) + "; leave it at 1");
}

Result<const Algorithm*> FindAlgorithm(std::string_view name) {
  std::vector<std::string_view> known;
  for (const Algorithm& algorithm : AlgorithmTable()) {
    if (algorithm.name == name) return &algorithm;
    known.emplace_back(algorithm.name);
  }
  return Status{StatusCode::kNotFound, "unknown algorithm " + Quote(name) + Suggestion(name, known)};
}

}  // namespace consac::learn
