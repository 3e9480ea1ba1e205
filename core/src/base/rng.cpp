#include "consac/base/rng.h"

#include <cmath>
#include <utility>

#include "consac/base/archive.h"

namespace consac {
namespace {

constexpr std::uint32_t kPhiloxMultiplier0 = 0xD2511F53u;
constexpr std::uint32_t kPhiloxMultiplier1 = 0xCD9E8D57u;
constexpr std::uint32_t kPhiloxWeyl0 = 0x9E3779B9u;
constexpr std::uint32_t kPhiloxWeyl1 = 0xBB67AE85u;

}  // namespace

// The key is the seed; the stream and the index fill the upper half of the counter, so that every (seed, stream,
// index) has 2^32 blocks of its own. The stream's upper 32 bits are folded into the key.
Rng::Rng(std::uint64_t seed, std::uint64_t stream, std::uint32_t index)
    : key_{static_cast<std::uint32_t>(seed) ^ static_cast<std::uint32_t>(stream >> 32),
           static_cast<std::uint32_t>(seed >> 32)},
      counter_{0, 0, index, static_cast<std::uint32_t>(stream)} {}

void Rng::Refill() {
  std::uint32_t x0 = counter_[0], x1 = counter_[1], x2 = counter_[2], x3 = counter_[3];
  std::uint32_t k0 = key_[0], k1 = key_[1];
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = std::uint64_t{kPhiloxMultiplier0} * x0;
    const std::uint64_t p1 = std::uint64_t{kPhiloxMultiplier1} * x2;
    x0 = static_cast<std::uint32_t>(p1 >> 32) ^ x1 ^ k0;
    x1 = static_cast<std::uint32_t>(p1);
    x2 = static_cast<std::uint32_t>(p0 >> 32) ^ x3 ^ k1;
    x3 = static_cast<std::uint32_t>(p0);
    k0 += kPhiloxWeyl0;
    k1 += kPhiloxWeyl1;
  }
  block_[0] = x0;
  block_[1] = x1;
  block_[2] = x2;
  block_[3] = x3;
  used_ = 0;
  if (++counter_[0] == 0) ++counter_[1];
}

std::uint64_t Rng::NextU64() {
  const std::uint64_t high = NextU32();
  return (high << 32) | NextU32();
}

// Lemire's multiply-shift with rejection.
std::uint32_t Rng::Below(std::uint32_t n) {
  std::uint64_t product = std::uint64_t{NextU32()} * n;
  auto low = static_cast<std::uint32_t>(product);
  if (low < n) {
    const std::uint32_t threshold = (0u - n) % n;
    while (low < threshold) {
      product = std::uint64_t{NextU32()} * n;
      low = static_cast<std::uint32_t>(product);
    }
  }
  return static_cast<std::uint32_t>(product >> 32);
}

float Rng::Normal() {
  if (has_normal_ != 0) {
    has_normal_ = 0;
    return normal_;
  }
  const double radius = std::sqrt(-2.0 * std::log(1.0 - UniformDouble()));
  const double angle = 6.283185307179586 * UniformDouble();
  normal_ = static_cast<float>(radius * std::sin(angle));
  has_normal_ = 1;
  return static_cast<float>(radius * std::cos(angle));
}

void Rng::Shuffle(std::span<std::int32_t> items) {
  for (std::size_t i = items.size(); i > 1; --i) {
    std::swap(items[i - 1], items[Below(static_cast<std::uint32_t>(i))]);
  }
}

void Rng::Visit(Archive& archive) {
  archive("key", std::span<std::uint32_t>(key_));
  archive("counter", std::span<std::uint32_t>(counter_));
  archive("block", std::span<std::uint32_t>(block_));
  archive("used", used_);
  archive.Check("used", used_ <= 4);
  archive("has_normal", has_normal_);
  archive("normal", normal_);
}

}  // namespace consac
