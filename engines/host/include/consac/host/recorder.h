#pragma once
// Demonstrations: what agents saw and did, step by step, as a file that anything can read: safetensors, in words in
// spec/demonstration.md.

#include <cstdint>
#include <memory>
#include <string>

#include "consac/host/tick_world.h"

namespace consac::host {

/// Takes down every step of one behaviour, up to 1 GiB of them.
class Recorder {
 public:
  /// `world` must outlive it.
  Recorder(TickWorld& world, std::size_t b);
  ~Recorder();
  /// To be called right before each TickWorld::Offer.
  void Note();
  /// Steps of single agents so far.
  std::int64_t steps() const;
  /// Writes what there is; goes on recording.
  Status Save(const std::string& path) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace consac::host
