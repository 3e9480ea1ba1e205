#include "report/output_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

#include "consac/base/file.h"
#include "system/system.h"

namespace consac::run {
namespace {

StatusCode CodeOf(int error) {
  bool full = error == ENOSPC || error == EFBIG || error == EMFILE || error == ENFILE || error == ENOMEM;
#if defined(EDQUOT)
  full = full || error == EDQUOT;
#endif
  return full ? StatusCode::kResourceExhausted : StatusCode::kDataLoss;
}

// Writes all of `bytes`; 0, or the errno of what stopped it.
int WriteAll(int descriptor, const char* bytes, std::size_t count) {
  if (descriptor < 0) return EBADF;
  while (count > 0) {
    const std::int64_t written = WriteSome(descriptor, bytes, count);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes += written;
    count -= static_cast<std::size_t>(written);
  }
  return 0;
}

}  // namespace

Result<std::unique_ptr<OutputFile>> OutputFile::Open(const std::string& path, OpenMode mode) {
  const int descriptor = OpenToAppend(path, mode == OpenMode::kTruncate);
  if (descriptor >= 0 && IsPipe(descriptor)) {
    Close(descriptor);
    return Status{StatusCode::kDataLoss,
                  "'" + path + "' is a pipe and no file, so it would keep nothing; take it away"};
  }
  const std::int64_t size = descriptor < 0 ? -1 : SizeOf(descriptor);
  if (size < 0) {
    const int error = errno;
    if (descriptor >= 0) Close(descriptor);
    if (error == ELOOP)
      return Status{StatusCode::kDataLoss, "'" + path + "' is a link and no file of this run; take it away"};
    return Status{CodeOf(error), "cannot open '" + path + "' for writing: " + std::strerror(error)};
  }
  return std::unique_ptr<OutputFile>(new OutputFile(path, descriptor, static_cast<std::uint64_t>(size)));
}

OutputFile::OutputFile(std::string path, int descriptor, std::uint64_t size)
    : path_(std::move(path)), descriptor_(descriptor), size_(size) {
  buffer_.reserve(kBufferBytes);
}

OutputFile::~OutputFile() {
  Flush();
  if (descriptor_ >= 0) Close(descriptor_);
}

void OutputFile::Append(std::string_view record) {
  if (buffer_.size() + record.size() > kBufferBytes) Flush();
  CONSAC_ASSERT(record.size() <= kBufferBytes);
  buffer_.insert(buffer_.end(), record.begin(), record.end());
}

void OutputFile::Flush() {
  if (buffer_.empty()) return;
  const int error = WriteAll(descriptor_, buffer_.data(), buffer_.size());
  if (error == 0) {
    size_ += buffer_.size();
  } else {
    const bool cut = descriptor_ < 0 || CutTo(descriptor_, size_);
    if (status_.ok()) {
      status_ = Status{CodeOf(error), "cannot write '" + path_ + "': " + std::strerror(error) +
                                          (cut ? "" : " (and it may end in half a record)")};
    }
  }
  buffer_.clear();
}

Status OutputFile::Replace(std::string_view text) {
  Flush();
  if (descriptor_ >= 0) Close(descriptor_);  // Windows replaces no file that is open
  const Status replaced = WriteFileAtomically(path_, std::as_bytes(std::span(text)));
  descriptor_ = OpenToAppend(path_, false);
  const std::int64_t size = descriptor_ < 0 ? -1 : SizeOf(descriptor_);
  if (size >= 0)
    size_ = static_cast<std::uint64_t>(size);
  else if (status_.ok())
    status_ = Status{CodeOf(errno), "cannot open '" + path_ + "' again: " + std::strerror(errno)};
  return replaced;
}

void OutputFile::CutToLine(std::uint64_t bytes) {
  Flush();
  if (descriptor_ < 0) return;
  std::uint64_t end = std::min(bytes, size_);
  // Back from the end by blocks: what a power cut leaves there may be long.
  std::vector<char> block(std::min<std::uint64_t>(end, std::size_t{64} << 10));
  while (end > 0) {
    const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(end, block.size()));
    if (!ReadAt(descriptor_, end - count, block.data(), count)) break;
    const std::size_t line = std::string_view(block.data(), count).rfind('\n');
    end -= line == std::string_view::npos ? count : count - line - 1;
    if (line != std::string_view::npos) break;
  }
  if (end < size_ && CutTo(descriptor_, end)) size_ = end;
}

}  // namespace consac::run
