#pragma once
// What a peer has not taken yet: a session never waits in a write.

#include <span>
#include <vector>

#include "consac/base/hooks.h"
#include "consac/base/text.h"
#include "consac/transport/transport.h"

namespace consac {

/// Bytes on their way out, in order. Holds what has not been taken, and 64 KiB when all has.
class Outbox {
 public:
  /// Sends what is taken at once and keeps the rest.
  Status Send(Transport& transport, std::span<const std::byte> bytes) {
    if (empty()) {
      const Result<std::size_t> count = transport.WriteSome(bytes, 0.0);
      if (!count.ok()) return count.status();
      bytes = bytes.subspan(*count);
      if (bytes.empty()) return Status::Ok();
      taken_at_ = Now();
    }
    rest_.insert(rest_.end(), bytes.begin(), bytes.end());
    return Status::Ok();
  }
  /// Sends more of it, waiting at most `timeout_s`; kDeadlineExceeded when nothing was taken for `limit_s`.
  Status Flush(Transport& transport, double timeout_s, double limit_s) {
    const Result<std::size_t> count = transport.WriteSome(std::span(rest_).subspan(sent_), timeout_s);
    if (!count.ok()) return count.status();
    sent_ += *count;
    if (*count > 0) taken_at_ = Now();
    if (sent_ == rest_.size()) Clear();
    if (empty() || Now() - taken_at_ <= limit_s) return Status::Ok();
    return {StatusCode::kDeadlineExceeded, transport.peer() + " takes no data for " + NumberText(limit_s) +
                                               " s; it hangs or is stopped in a debugger"};
  }
  bool empty() const { return rest_.empty(); }
  /// Bytes that it holds: 0 once all has been taken.
  std::size_t held() const { return rest_.size(); }
  void Clear() {
    rest_.clear();
    if (rest_.capacity() > kKept) rest_.shrink_to_fit();
    sent_ = 0;
  }

 private:
  static constexpr std::size_t kKept = 65536;
  std::vector<std::byte> rest_;
  std::size_t sent_ = 0;
  double taken_at_ = 0.0;
};

}  // namespace consac
