#pragma once
// Other ranks are the host's, as threads are (executor.h): a training may run as several processes, each with worlds of
// its own, all with the same parameters. Whatever is summed for learning is summed over the ranks, in their order.

#include <cstddef>
#include <cstdint>
#include <span>

namespace consac {

/// The ranks of one training; by default one alone. All make the same calls in the same order, with the same counts.
struct Communicator {
  std::int64_t rank = 0;  ///< this one
  std::int64_t size = 1;  ///< how many there are
  /// Replaces `numbers` [count] by their sums, added from rank 0 upwards: the same bits on every rank.
  void (*sum)(void* user, double* numbers, std::int64_t count) = nullptr;
  /// The same in single precision.
  void (*sum_floats)(void* user, float* numbers, std::int64_t count) = nullptr;
  /// Replaces `bytes` [count] by rank 0's.
  void (*broadcast)(void* user, std::byte* bytes, std::int64_t count) = nullptr;
  /// Handed to all three.
  void* user = nullptr;

  /// Sums over the ranks, in place.
  void Sum(std::span<double> numbers) const {
    if (size > 1) sum(user, numbers.data(), static_cast<std::int64_t>(numbers.size()));
  }
  /// The same in single precision.
  void Sum(std::span<float> numbers) const {
    if (size > 1) sum_floats(user, numbers.data(), static_cast<std::int64_t>(numbers.size()));
  }
  /// The sum of one number.
  double Sum(double number) const {
    Sum({&number, 1});
    return number;
  }
  /// Everybody has rank 0's numbers afterwards.
  void Broadcast(std::span<float> numbers) const {
    const std::span<std::byte> bytes = std::as_writable_bytes(numbers);
    if (size > 1) broadcast(user, bytes.data(), static_cast<std::int64_t>(bytes.size()));
  }
};

}  // namespace consac
