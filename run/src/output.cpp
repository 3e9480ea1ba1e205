#include "consac/run/output.h"

#include <atomic>
#include <cerrno>

namespace consac::run {
namespace {

std::atomic<int> output_error{0};

/// The stream itself keeps no reason, and its buffer may be empty again when somebody asks.
void NoteFailure(std::FILE* stream) {
  int none = 0;
  if (stream == stdout) output_error.compare_exchange_strong(none, errno != 0 ? errno : EIO);
}

}  // namespace

void WriteOutput(std::FILE* stream, std::string_view text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stream) < text.size()) NoteFailure(stream);
}

void FlushOutput(std::FILE* stream) {
  errno = 0;
  if (std::fflush(stream) != 0) NoteFailure(stream);
}

int OutputError() {
  return output_error.load();
}

}  // namespace consac::run
