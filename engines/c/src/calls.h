#pragma once
// How a call of the C interface goes: its Status becomes a code and the calling thread's sentence, and what is thrown
// below, when memory runs out, ends here. Private to engines/c.

#include <cstddef>
#include <cstring>
#include <new>
#include <string>

#include "consac.h"
#include "consac/base/status.h"

namespace consac::c {

/// The code; a failure's sentence is kept for consac_last_error. Allocates nothing.
consac_status Tell(const Status& status) noexcept;
/// The same for a sentence that is at hand.
consac_status Tell(consac_status code, const char* message) noexcept;

/// What is said of an exception, which can only be that memory ran out.
inline constexpr const char* kNoMemory = "memory ran out; ask for less at once, or free what is not needed";

/// Makes a call that gives a Status.
template <class Call>
consac_status Make(const Call& call) noexcept {
  try {
    return Tell(call());
  } catch (...) {
    return Tell(CONSAC_RESOURCE_EXHAUSTED, kNoMemory);
  }
}

/// Ok where a pointer is one.
inline Status Given(const void* pointer, const char* what) {
  if (pointer != nullptr) return Status::Ok();
  return {StatusCode::kInvalidArgument, std::string(what) + " is NULL"};
}

/// A text of the caller; "" for NULL.
inline std::string TextOf(const char* text) {
  return text != nullptr ? text : "";
}

/// A caller's struct as this library knows it, `what` for the error: what an older caller's lacks is 0; what a newer
/// one's has beyond it must be.
template <class T>
Status TakeOptions(const T* given, const char* what, T* taken) {
  *taken = T{};
  taken->size = sizeof(T);
  if (given == nullptr) return Status::Ok();
  constexpr std::size_t kMost = 4096;
  if (given->size < sizeof(given->size) || given->size > kMost) {
    return {StatusCode::kInvalidArgument,
            std::string(what) + ".size is " + std::to_string(given->size) + "; set it to the size of the struct"};
  }
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = sizeof(T); i < given->size; ++i) {
    if (bytes[i] == 0) continue;
    return {StatusCode::kInvalidArgument, std::string(what) + " sets a field that this library (" + consac_version() +
                                              ") does not know; use a newer one"};
  }
  std::memcpy(taken, given, given->size < sizeof(T) ? given->size : sizeof(T));
  taken->size = sizeof(T);
  return Status::Ok();
}

/// The reverse: what the library knows goes into as much of the struct as the caller has.
template <class T>
Status GiveFacts(T facts, const char* what, T* into) {
  CONSAC_RETURN_IF_ERROR(Given(into, what));
  if (into->size < sizeof(into->size)) {
    return {StatusCode::kInvalidArgument,
            std::string(what) + ".size is " + std::to_string(into->size) + "; set it to the size of the struct"};
  }
  facts.size = into->size < sizeof(T) ? into->size : sizeof(T);
  std::memcpy(into, &facts, facts.size);
  return Status::Ok();
}

}  // namespace consac::c
