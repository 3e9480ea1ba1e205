#pragma once
// The rows of the table of distributions, one per file of this folder; distribution.cpp puts them together.

#include "consac/policy/distribution.h"

namespace consac {

/// One choice of n, or one of each of several: logits, concatenated.
Distribution CategoricalDistribution();
/// Independent bits: a logit each.
Distribution BernoulliDistribution();
/// Independent normal numbers: a mean each, and a free log standard deviation.
Distribution GaussianDistribution();
/// The value of each choice; the best legal one is taken.
Distribution QValuesDistribution();
/// Normal numbers, means and deviations from the network, squashed by tanh and stretched to the bounds.
Distribution SquashedGaussianDistribution();
/// A number from -1 to 1 as the network says it, stretched to the bounds.
Distribution DeterministicDistribution();

/// Normal numbers whose deviation follows the state, by a matrix of each slot; means from the network.
Distribution SdeGaussianDistribution();
/// The same squashed by tanh and stretched to the bounds.
Distribution SquashedSdeGaussianDistribution();

/// Whether the leaf is a choice of n or several.
bool IsChoice(const Leaf& leaf);
/// The index of the largest legal value.
std::int64_t BestLegal(const float* values, const std::uint8_t* mask, std::int64_t n);
/// An index from 0 as the world takes it.
double ChoiceInWorld(const Leaf& leaf, std::int64_t index, float raw);
/// A number from -1 to 1 as the world takes it.
double StretchedToBounds(const Leaf& leaf, std::int64_t index, float raw);

/// Entropy of the tanh of a normal number. Not for hot paths.
double SquashedNormalEntropy(double mean, double deviation);

}  // namespace consac
