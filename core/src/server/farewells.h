#pragma once
// Connections whose last word is an ERROR. A TCP connection that is closed with bytes unread is reset, and what was
// said last may be lost with it: so only our own end of it closes at first. Private to core/server.

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "consac/base/hooks.h"
#include "consac/transport/transport.h"

namespace consac {

/// Lets peers read what was said last. Never waits.
class Farewells {
 public:
  /// Says no more to `transport`; it is closed once its peer has, or 2 s later.
  void Add(std::unique_ptr<Transport> transport) {
    if (leaving_.size() >= kMost) leaving_.erase(leaving_.begin());
    transport->CloseWriting();
    leaving_.push_back({std::move(transport), Now() + kPatience});
  }

  /// Throws away what has come meanwhile.
  void Look() {
    std::erase_if(leaving_, [](Leaving& one) {
      std::array<std::byte, 65536> thrown_away;
      for (int reads = 0; reads < kReads; ++reads) {
        const Result<std::size_t> count = one.transport->Read(thrown_away, 0.0);
        if (!count.ok() || Now() > one.until) return true;
        if (*count == 0) return false;
      }
      return false;
    });
  }

  void Clear() { leaving_.clear(); }
  bool empty() const { return leaving_.empty(); }

 private:
  static constexpr double kPatience = 2.0;  // s
  static constexpr std::size_t kMost = 64;
  static constexpr int kReads = 64;  // a flood does not keep the engine

  struct Leaving {
    std::unique_ptr<Transport> transport;
    double until;
  };
  std::vector<Leaving> leaving_;
};

}  // namespace consac
