#include "consac/transport/transport.h"

#include "consac/base/text.h"

namespace consac {

Status Transport::Write(std::span<const std::byte> bytes, double timeout_s) {
  while (!bytes.empty()) {
    const Result<std::size_t> count = WriteSome(bytes, timeout_s);
    if (!count.ok()) return count.status();
    if (*count == 0) {
      return {StatusCode::kDeadlineExceeded,
              peer() + " takes no data for " + NumberText(timeout_s) + " s; it hangs or is stopped in a debugger"};
    }
    bytes = bytes.subspan(*count);
  }
  return Status::Ok();
}

}  // namespace consac
