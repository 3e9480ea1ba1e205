#pragma once
// What algorithms with several critics share: how many there may be, the least of their values, and a loss of each in
// what they report. Private to learn.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "collect/sliced_evaluator.h"

namespace consac::learn {

/// Most critics that may be asked for (n_critics).
inline constexpr std::int64_t kMostCritics = 10;
/// The first two stand among an algorithm's own terms; these are the names of the others'.
inline constexpr const char* kFurtherCriticTerms[] = {"loss/qf3_loss", "loss/qf4_loss", "loss/qf5_loss",
                                                      "loss/qf6_loss", "loss/qf7_loss", "loss/qf8_loss",
                                                      "loss/qf9_loss", "loss/qf10_loss"};
inline constexpr std::size_t kTwoCritics = 2;
static_assert(std::size(kFurtherCriticTerms) + kTwoCritics == static_cast<std::size_t>(kMostCritics));

/// An algorithm's own terms, and those of further critics behind them.
template <std::size_t own>
constexpr std::array<const char*, own + std::size(kFurtherCriticTerms)> WithFurtherCritics(
    const char* const (&terms)[own]) {
  std::array<const char*, own + std::size(kFurtherCriticTerms)> all{};
  std::copy_n(terms, own, all.begin());
  std::copy_n(kFurtherCriticTerms, std::size(kFurtherCriticTerms), all.begin() + own);
  return all;
}
/// How many of those are in use with so many critics; the others are not saved.
constexpr std::size_t TermsInUse(std::size_t own, std::int64_t critics) {
  return own + (critics > static_cast<std::int64_t>(kTwoCritics) ? static_cast<std::size_t>(critics) - kTwoCritics : 0);
}
/// Where the loss of critic `k` stands: the first two from `first` on.
constexpr std::size_t CriticTerm(std::size_t k, std::size_t first, std::size_t own) {
  return k < kTwoCritics ? first + k : own + k - kTwoCritics;
}

/// min_k Q_k of row `i` of what ran last.
inline float LeastValue(const SlicedEvaluator& values, std::int64_t critics, std::size_t i) {
  float least = values.output(0)[i];
  for (std::int64_t k = 1; k < critics; ++k) least = std::min(least, values.output(static_cast<std::size_t>(k))[i]);
  return least;
}

}  // namespace consac::learn
