#pragma once
// A fixed run of floats at the start of a cache line, zeroed, with kSlack readable floats behind its end. Used for
// packed parameters and activations; allocated at creation, never grown.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>

#include "consac/nn/kernels.h"

namespace consac::nn {

/// The buffer. Movable; its address stays.
class AlignedFloats {
 public:
  /// Empty.
  AlignedFloats() = default;
  /// `count` zeros.
  explicit AlignedFloats(std::int64_t count) : count_(count) {
    const std::size_t bytes = static_cast<std::size_t>(count + kSlack) * sizeof(float);
    data_.reset(static_cast<float*>(::operator new (bytes, std::align_val_t{64})));
    std::memset(data_.get(), 0, bytes);
  }
  /// First float.
  float* data() { return data_.get(); }
  /// First float.
  const float* data() const { return data_.get(); }
  /// Floats, without the slack.
  std::int64_t count() const { return count_; }
  /// All of it, without the slack.
  std::span<float> span() { return {data_.get(), static_cast<std::size_t>(count_)}; }

 private:
  struct Free {
    void operator()(float* data) const { ::operator delete (data, std::align_val_t{64}); }
  };
  std::unique_ptr<float, Free> data_;
  std::int64_t count_ = 0;
};

}  // namespace consac::nn
