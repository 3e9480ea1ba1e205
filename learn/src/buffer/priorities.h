#pragma once
// Which rows a prioritised replay draws, and what each draw weighs: a tree of sums and a tree of minima over the places
// of a ring. Source: Schaul et al. 2016, arXiv:1511.05952, as Stable Baselines 2.10.2 has it (proportional, every draw
// by itself). Private to learn.

#include <cstdint>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/rng.h"

namespace consac::learn {

/// How much priorities count.
struct PriorityOptions {
  double alpha = 0.6;     ///< exponent: 0 draws uniformly
  double epsilon = 1e-6;  ///< added to every error
};

/// Priorities of places; those that hold nothing have none. Sums are recomputed from below, so that they follow from
/// the leaves alone: a restored tree draws the same.
class Priorities {
 public:
  /// For `places` places, none of which holds anything.
  Priorities(std::int64_t places, const PriorityOptions& options);

  /// Something new is at `place`: it is drawn as the most urgent so far.
  void Add(std::int64_t place);
  /// Nothing is there any more.
  void Remove(std::int64_t place) { Set(place, 0.0f); }
  /// What was drawn from `place` was off by `error`. One that is not finite changes nothing.
  void Update(std::int64_t place, double error);
  /// A place, with probability p^alpha / sum; at least one must hold something.
  std::int64_t Sample(Rng& rng) const;
  /// Probability of drawing `place`.
  double Probability(std::int64_t place) const { return sums_[Leaf(place)] / sums_[1]; }
  /// (P(place) n)^-beta over the largest of them, where n places hold something: n cancels.
  float Weight(std::int64_t place, double beta) const;

  /// Priorities and the largest so far; the trees are built anew.
  void Visit(Archive& archive);

 private:
  std::size_t Leaf(std::int64_t place) const { return static_cast<std::size_t>(leaves_ + place); }
  void Set(std::int64_t place, float powered);
  void Combine(std::size_t node);

  PriorityOptions options_;
  std::int64_t places_, leaves_;  // leaves: a power of two
  double largest_ = 1.0;          // priority before the exponent
  std::vector<double> sums_;      // [2 leaves] node i has 2i and 2i + 1 below it
  std::vector<float> minima_;     // [2 leaves] of those that hold something
};

}  // namespace consac::learn
