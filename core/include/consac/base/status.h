#pragma once
// Status and Result<T>: how `core` and `learn` report an expected failure without exceptions.
// Used by everything that reads bytes, files, configuration or a peer. Not for hot paths (those cannot fail)
// and not for a caller's mistake (see hooks.h, CONSAC_ASSERT).

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "consac/base/hooks.h"

namespace consac {

/// What kind of failure it is; the command line turns it into an exit code, an engine into an error event.
enum class StatusCode : std::uint8_t {
  kOk,
  kInvalidArgument,     ///< a value that cannot be used: unknown key, wrong shape, out of range
  kNotFound,            ///< no such world, algorithm, file, model
  kAlreadyExists,       ///< a name or port that is taken
  kFailedPrecondition,  ///< right call, wrong moment: opening an open socket, sending with no client
  kDataLoss,            ///< damaged, cut or foreign file; nothing of it was used
  kProtocol,            ///< bytes from a peer that do not fit the protocol
  kNonFinite,           ///< NaN or infinity where a number is needed
  kUnavailable,         ///< nobody listens, or the peer went away
  kDeadlineExceeded,    ///< the peer is silent past the deadline
  kResourceExhausted,   ///< disk full, too long a message, out of descriptors
  kCancelled,           ///< the user asked to stop
  kInternal,            ///< our own mistake, reported instead of crashing
};

/// Success, or a code with one sentence: what, the offending value, what to do.
class [[nodiscard]] Status {
 public:
  /// Success.
  Status() = default;
  /// A failure. `message` is for people, often holds what somebody else wrote, and is kept as a line: what does not
  /// show becomes \xNN (PrintableLine in names.h), and the rest of more than 4 KiB is left out.
  Status(StatusCode code, std::string message);
  /// Success, spelt out.
  static Status Ok() { return {}; }

  /// True on success.
  bool ok() const { return code_ == StatusCode::kOk; }
  /// The kind of failure.
  StatusCode code() const { return code_; }
  /// The sentence; empty on success.
  const std::string& message() const { return message_; }

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
};

/// A value, or the Status that says why there is none. `*result` on a failure is a caller's mistake.
template <class T>
class [[nodiscard]] Result {
 public:
  /// Holds a value.
  Result(T value) : value_(std::move(value)) {}  // NOLINT: implicit by intent, `return value;`
  /// Holds a failure; `status` must not be ok.
  Result(Status status) : status_(std::move(status)) {  // NOLINT: implicit by intent, `return status;`
    CONSAC_ASSERT(!status_.ok());
  }

  /// True when there is a value.
  bool ok() const { return value_.has_value(); }
  /// Why there is none; ok when there is one.
  const Status& status() const { return status_; }
  /// The value; only after ok().
  T& operator*() & {
    CONSAC_ASSERT(ok());
    return *value_;
  }
  /// The value; only after ok().
  const T& operator*() const& {
    CONSAC_ASSERT(ok());
    return *value_;
  }
  /// The value, moved out; only after ok().
  T&& operator*() && {
    CONSAC_ASSERT(ok());
    return std::move(*value_);
  }
  /// Member access; only after ok().
  T* operator->() {
    CONSAC_ASSERT(ok());
    return &*value_;
  }
  /// Member access; only after ok().
  const T* operator->() const {
    CONSAC_ASSERT(ok());
    return &*value_;
  }

 private:
  std::optional<T> value_;
  Status status_;
};

}  // namespace consac

/// Returns the Status of `expression` from the enclosing function when it is a failure.
#define CONSAC_RETURN_IF_ERROR(expression)           \
  do {                                               \
    ::consac::Status consac_status_ = (expression);  \
    if (!consac_status_.ok()) return consac_status_; \
  } while (false)
