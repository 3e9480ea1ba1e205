#pragma once
// Counter-based random numbers (Philox 4x32-10): one seed, one stream per use, exact state that can be saved.
// Two generators with different streams never share a draw, so adding a use never changes another's numbers.
// Source: Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3".

#include <cstdint>
#include <span>
#include <string_view>

namespace consac {

class Archive;

/// A stream number from its name ("action_sampling", "minibatch_shuffle"): FNV-1a, stable for ever.
constexpr std::uint64_t StreamId(std::string_view name) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return hash;
}

/// The generator. A value: copying it forks the sequence.
class Rng {
 public:
  /// Stream `stream` (see StreamId) of `seed`; `index` tells apart many of one kind, such as worlds.
  explicit Rng(std::uint64_t seed = 0, std::uint64_t stream = 0, std::uint32_t index = 0);

  /// 32 uniform bits.
  std::uint32_t NextU32() {
    if (used_ == 4) Refill();
    return block_[used_++];
  }
  /// 64 uniform bits.
  std::uint64_t NextU64();
  /// Uniform in [0, 1), 24 bits.
  float Uniform() { return static_cast<float>(NextU32() >> 8) * 0x1.0p-24f; }
  /// Uniform in [0, 1), 53 bits.
  double UniformDouble() { return static_cast<double>(NextU64() >> 11) * 0x1.0p-53; }
  /// Uniform in [low, high).
  double Between(double low, double high) { return low + (high - low) * UniformDouble(); }
  /// Uniform integer in [0, n), without bias; n > 0.
  std::uint32_t Below(std::uint32_t n);
  /// Standard normal (Box-Muller; two draws per pair, the second kept).
  float Normal();
  /// Fisher-Yates shuffle.
  void Shuffle(std::span<std::int32_t> items);

  /// The whole state, for checkpoints.
  void Visit(Archive& archive);

 private:
  void Refill();

  std::uint32_t key_[2] = {};
  std::uint32_t counter_[4] = {};
  std::uint32_t block_[4] = {};
  std::uint32_t used_ = 4;
  std::uint32_t has_normal_ = 0;
  float normal_ = 0.0f;
};

}  // namespace consac
