#include "consac/policy/distribution.h"

#include <array>

#include "policy/distributions.h"

namespace consac {
namespace {

constexpr std::size_t kCategoricalRow = 0, kBernoulliRow = 1, kGaussianRow = 2;

const auto& DistributionTable() {
  static const std::array kRows = {CategoricalDistribution(),      BernoulliDistribution(),
                                   GaussianDistribution(),         QValuesDistribution(),
                                   SquashedGaussianDistribution(), DeterministicDistribution(),
                                   SdeGaussianDistribution(),      SquashedSdeGaussianDistribution()};
  return kRows;
}

}  // namespace

const Distribution* FindDistribution(std::string_view name) {
  for (const Distribution& row : DistributionTable()) {
    if (row.name == name) return &row;
  }
  return nullptr;
}

std::vector<std::string_view> DistributionNames() {
  std::vector<std::string_view> names;
  for (const Distribution& row : DistributionTable()) names.push_back(row.name);
  return names;
}

const Distribution& DefaultDistribution(const Leaf& leaf) {
  switch (leaf.space.kind()) {
    case SpaceKind::kBox:
      return DistributionTable()[kGaussianRow];
    case SpaceKind::kMultiBinary:
      return DistributionTable()[kBernoulliRow];
    default:
      return DistributionTable()[kCategoricalRow];
  }
}

}  // namespace consac
