// The table of algorithms. A new one is its own files and one row here.
#include <vector>

#include "algo/ppo.h"
#include "consac/base/text.h"

namespace consac::learn {
namespace {

const std::vector<Algorithm>& AlgorithmTable() {
  static const std::vector<Algorithm> table = {
      {"ppo2", "proximal policy optimisation as in Stable Baselines 2.10.2, the thesis' algorithm",
       LogStyle::kStableBaselines2, Ppo2Table(), CreatePpo2},
      {"ppo", "proximal policy optimisation as in Stable Baselines3", LogStyle::kStableBaselines3, PpoTable(),
       CreatePpo},
  };
  return table;
}

}  // namespace

std::span<const Algorithm> Algorithms() {
  return AlgorithmTable();
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
