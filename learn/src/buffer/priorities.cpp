#include "buffer/priorities.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace consac::learn {
namespace {

constexpr float kNobody = std::numeric_limits<float>::infinity();

}  // namespace

Priorities::Priorities(std::int64_t places, const PriorityOptions& options)
    : options_(options),
      places_(places),
      leaves_(static_cast<std::int64_t>(std::bit_ceil(static_cast<std::uint64_t>(places)))),
      sums_(static_cast<std::size_t>(2 * leaves_)),
      minima_(static_cast<std::size_t>(2 * leaves_), kNobody) {}

void Priorities::Combine(std::size_t node) {
  sums_[node] = sums_[2 * node] + sums_[2 * node + 1];
  minima_[node] = std::min(minima_[2 * node], minima_[2 * node + 1]);
}

void Priorities::Set(std::int64_t place, float powered) {
  std::size_t node = Leaf(place);
  sums_[node] = static_cast<double>(powered);
  minima_[node] = powered > 0.0f ? powered : kNobody;
  while ((node /= 2) > 0) Combine(node);
}

// A priority too small for float32 would never be drawn again.
void Priorities::Add(std::int64_t place) {
  const auto powered = static_cast<float>(std::pow(largest_, options_.alpha));
  Set(place, std::clamp(powered, std::numeric_limits<float>::min(), std::numeric_limits<float>::max()));
}

void Priorities::Update(std::int64_t place, double error) {
  const double priority = std::fabs(error) + options_.epsilon;
  if (!std::isfinite(priority)) return;
  const auto powered = static_cast<float>(std::pow(priority, options_.alpha));
  Set(place, std::clamp(powered, std::numeric_limits<float>::min(), std::numeric_limits<float>::max()));
  largest_ = std::max(largest_, priority);
}

std::int64_t Priorities::Sample(Rng& rng) const {
  double left = rng.UniformDouble() * sums_[1];
  std::size_t node = 1;
  while (node < static_cast<std::size_t>(leaves_)) {
    node *= 2;
    if (left < sums_[node] || sums_[node + 1] <= 0.0) continue;
    left -= sums_[node];
    ++node;
  }
  return static_cast<std::int64_t>(node) - leaves_;
}

float Priorities::Weight(std::int64_t place, double beta) const {
  return static_cast<float>(std::pow(sums_[Leaf(place)] / static_cast<double>(minima_[1]), -beta));
}

void Priorities::Visit(Archive& archive) {
  std::vector<float> powered(static_cast<std::size_t>(places_));
  for (std::int64_t place = 0; place < places_; ++place)
    powered[static_cast<std::size_t>(place)] = static_cast<float>(sums_[Leaf(place)]);
  archive("powered", std::span<float>(powered));
  archive("largest", largest_);
  archive.Check("powered",
                std::all_of(powered.begin(), powered.end(), [](float p) { return p >= 0.0f && std::isfinite(p); }));
  if (!archive.loading() || !archive.status().ok()) return;
  for (std::int64_t place = 0; place < places_; ++place) {
    const float p = powered[static_cast<std::size_t>(place)];
    sums_[Leaf(place)] = static_cast<double>(p);
    minima_[Leaf(place)] = p > 0.0f ? p : kNobody;
  }
  for (auto node = static_cast<std::size_t>(leaves_) - 1; node > 0; --node) Combine(node);
}

}  // namespace consac::learn
