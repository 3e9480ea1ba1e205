#include "consac/learn/log/output_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/base/file.h"
#include "log/system.h"

namespace consac::learn {
namespace {

constexpr std::size_t kBlock = std::size_t{64} << 10;  // that is read at a time
constexpr const char* kOneLine = "without an end of a line";

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

bool Holds(int descriptor, std::string_view text) {
  std::string found(text.size(), '\0');
  return BytesIn(descriptor) == static_cast<std::int64_t>(text.size()) &&
         ReadAt(descriptor, 0, found.data(), found.size()) && found == text;
}

}  // namespace

Result<std::unique_ptr<OutputFile>> OutputFile::Open(const std::string& path, OpenMode mode) {
  const int descriptor = OpenToAppend(path);
  if (descriptor >= 0 && IsPipe(descriptor)) {
    CloseDescriptor(descriptor);
    return Status{StatusCode::kDataLoss,
                  "'" + path + "' is a pipe and no file, so it would keep nothing; take it away"};
  }
  if (descriptor >= 0 && HasOtherNames(descriptor)) {
    CloseDescriptor(descriptor);
    return Status{StatusCode::kDataLoss,
                  "'" + path + "' has another name (a hard link); it is left alone, take it away"};
  }
  // Only now, that it is known to be nobody else's.
  const bool empty = descriptor < 0 || mode == OpenMode::kAppend || CutTo(descriptor, 0);
  const std::int64_t size = descriptor < 0 || !empty ? -1 : BytesIn(descriptor);
  if (size < 0) {
    const int error = errno;
    if (descriptor >= 0) CloseDescriptor(descriptor);
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
  if (descriptor_ >= 0) CloseDescriptor(descriptor_);
}

void OutputFile::Append(std::string_view record) {
  if (buffer_.size() + record.size() > kBufferBytes) Flush();
  buffer_.insert(buffer_.end(), record.begin(), record.end());
}

void OutputFile::Flush() {
  if (buffer_.empty()) return;
  const int error = WriteAll(descriptor_, buffer_.data(), buffer_.size());
  if (error == 0) {
    size_ += buffer_.size();
    lines_ += static_cast<std::uint64_t>(std::count(buffer_.begin(), buffer_.end(), '\n'));
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
  if (descriptor_ < 0) return status_;
  const Status another = {StatusCode::kDataLoss,
                          "'" + path_ + "' was deleted, or is another file now; it is left alone"};
  AtomicFile next;
  CONSAC_RETURN_IF_ERROR(next.Open(path_, [&] { return IsStillAt(descriptor_, path_) ? Status::Ok() : another; }));
  CONSAC_RETURN_IF_ERROR(next.Write(std::as_bytes(std::span(text))));
  CloseDescriptor(std::exchange(descriptor_, -1));  // Windows replaces no file that is open
  const Status replaced = next.Commit();
  descriptor_ = OpenToAppend(path_);
  const std::int64_t size = descriptor_ < 0 ? -1 : BytesIn(descriptor_);
  if (size < 0) {
    if (status_.ok()) status_ = {CodeOf(errno), "cannot open '" + path_ + "' again: " + std::strerror(errno)};
  } else if (replaced.ok() && !Holds(descriptor_, text)) {  // the folder was exchanged just now
    CloseDescriptor(std::exchange(descriptor_, -1));
    if (status_.ok()) status_ = another;
  } else {
    size_ = static_cast<std::uint64_t>(size);
  }
  return replaced;
}

Status OutputFile::TooFar(const char* what) const {
  return {StatusCode::kDataLoss, "'" + path_ + "' has " + std::to_string(kFarthestBack >> 20) + " MiB " + what +
                                     ", so it is no log of this run; put the run's own there, or take it away"};
}

Status OutputFile::CutToLine(std::uint64_t bytes) {
  Flush();
  if (descriptor_ < 0) return Status::Ok();
  const std::uint64_t from = std::min(bytes, size_);
  std::uint64_t end = from;
  // Back from the end by blocks: what a power cut leaves there may be long.
  std::vector<char> block(static_cast<std::size_t>(std::min<std::uint64_t>(end, kBlock)));
  while (end > 0) {
    if (from - end >= kFarthestBack) return TooFar(kOneLine);
    const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(end, block.size()));
    if (!ReadAt(descriptor_, end - count, block.data(), count)) break;
    const std::size_t line = std::string_view(block.data(), count).rfind('\n');
    end -= line == std::string_view::npos ? count : count - line - 1;
    if (line != std::string_view::npos) break;
  }
  if (end < size_ && CutTo(descriptor_, end)) size_ = end;
  return Status::Ok();
}

Status OutputFile::CutAfterLines(std::uint64_t lines) {
  Flush();
  if (descriptor_ < 0) return Status::Ok();
  const auto cannot = [&](const char* what) {
    return Status{StatusCode::kDataLoss, std::string("cannot ") + what + " '" + path_ + "': " + std::strerror(errno)};
  };
  std::vector<char> block(static_cast<std::size_t>(std::min<std::uint64_t>(size_, kBlock)));
  std::uint64_t end = 0, seen = 0;  // behind the latest end of a line
  for (std::uint64_t at = 0; at < size_ && seen < lines;) {
    if (at - end >= kFarthestBack) return TooFar(kOneLine);
    const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(size_ - at, block.size()));
    if (!ReadAt(descriptor_, at, block.data(), count)) return cannot("read");
    const std::string_view text(block.data(), count);
    for (std::size_t newline = text.find('\n'); newline != text.npos && seen < lines;
         newline = text.find('\n', newline + 1)) {
      ++seen;
      end = at + newline + 1;
    }
    at += count;
  }
  if (seen == 0 && size_ > 0 && lines > 0)
    return {StatusCode::kDataLoss, "'" + path_ +
                                       "' has no end of a line, so it is no log of this run; put the run's own there, "
                                       "or take it away"};
  lines_ = seen;
  if (seen + 1 == lines && end < size_) {  // an editor took the last end of a line away
    Append("\n");
    Flush();
    return status_;
  }
  if (end < size_ && !CutTo(descriptor_, end)) return cannot("cut");
  size_ = end;
  return Status::Ok();
}

Status OutputFile::CutLinesWhile(const std::function<bool(std::string_view line)>& goes) {
  Flush();
  CONSAC_RETURN_IF_ERROR(CutToLine(size_));
  if (descriptor_ < 0) return Status::Ok();
  std::string held;  // what is in the file from `begin` to `end`
  std::uint64_t begin = size_, end = size_;
  while (end > 0) {
    const std::size_t newline = held.size() < 2 ? held.npos : held.rfind('\n', held.size() - 2);
    if (newline == held.npos && begin > 0) {
      if (size_ - begin >= kFarthestBack)
        return TooFar(end == size_ ? kOneLine : "of lines that come after its checkpoint");
      // As much again each time, so that a long line is moved seldom.
      const std::uint64_t count = std::min<std::uint64_t>(begin, std::max(kBlock, held.size()));
      std::string before(static_cast<std::size_t>(count), '\0');
      if (!ReadAt(descriptor_, begin - count, before.data(), before.size())) break;
      held.insert(0, before);
      begin -= count;
      continue;
    }
    const std::size_t first = newline == held.npos ? 0 : newline + 1;
    if (!goes(std::string_view(held).substr(first, held.size() - first - 1))) break;
    end -= held.size() - first;
    held.resize(first);
  }
  if (end < size_ && CutTo(descriptor_, end)) size_ = end;
  return Status::Ok();
}

Result<std::string> OutputFile::FirstLine() const {
  std::string line;
  std::vector<char> block(kBlock);
  for (std::uint64_t at = 0; descriptor_ >= 0 && at < size_;) {
    if (at >= kFarthestBack) return TooFar(kOneLine);
    const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(size_ - at, block.size()));
    if (!ReadAt(descriptor_, at, block.data(), count)) break;
    const std::size_t newline = std::string_view(block.data(), count).find('\n');
    line.append(block.data(), std::min(newline, count));
    if (newline != std::string_view::npos) return line;
    at += count;
  }
  return std::string();
}

}  // namespace consac::learn
