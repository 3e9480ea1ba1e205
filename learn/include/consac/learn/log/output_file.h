#pragma once
// A file that grows by whole records. A failed write (disk full) loses records, never half of one: the file is cut
// back to its last whole record, and a later write tries again. Whoever writes goes on, and says so once.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"

namespace consac::learn {

/// What becomes of a file that exists.
enum class OpenMode : std::uint8_t { kTruncate, kAppend };

/// Buffered, append-only. Not thread-safe.
class OutputFile {
 public:
  /// Makes or opens `path`; the error names it.
  static Result<std::unique_ptr<OutputFile>> Open(const std::string& path, OpenMode mode);
  /// Flushes and closes.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Adds one record. Writes only when the buffer is full; never allocates for records of at most kBufferBytes.
  void Append(std::string_view record);
  /// Hands the buffer to the system.
  void Flush();
  /// Puts `text` in the place of all that is in the file; the file is as before when that fails.
  /// kDataLoss where another file stands under that name by now: that one is left alone.
  Status Replace(std::string_view text);
  /// Flushes, then cuts the file to `bytes` and on to the end of the last line before; a shorter file is left alone.
  /// kDataLoss where kFarthestBack have no end of a line: then it is no file of ours, and stays as it is.
  Status CutToLine(std::uint64_t bytes);
  /// Flushes, then cuts the file behind its first `lines` lines, or behind the last whole one of fewer. Goes by lines
  /// and not by bytes, so that a file which an editor saved with other ends of lines loses none. kDataLoss where it has
  /// no end of a line at all, and stays as it is.
  Status CutAfterLines(std::uint64_t lines);
  /// Flushes, then cuts whole lines off the end, the last one first, as long as `goes`(line) says so. kDataLoss as
  /// above, also where kFarthestBack of them go.
  Status CutLinesWhile(const std::function<bool(std::string_view line)>& goes);
  /// The first line, without its end; "" where there is none. kDataLoss where it is longer than kFarthestBack.
  Result<std::string> FirstLine() const;

  /// Bytes in the file, without the buffer.
  std::uint64_t size() const { return size_; }
  /// Ends of lines in the file, without the buffer: of one that was empty when it was opened, or since CutAfterLines.
  std::uint64_t lines() const { return lines_; }
  /// Its path.
  const std::string& path() const { return path_; }
  /// The first failed write; ok so far otherwise.
  const Status& status() const { return status_; }

  /// Room for records before they are written.
  static constexpr std::size_t kBufferBytes = std::size_t{1} << 16;
  /// No more is read of a file to go on in it: what a power cut leaves at its end is less.
  static constexpr std::uint64_t kFarthestBack = std::uint64_t{64} << 20;

 private:
  OutputFile(std::string path, int descriptor, std::uint64_t size);
  Status TooFar(const char* what) const;

  std::string path_;
  int descriptor_;  // -1: it could not be opened again
  std::uint64_t size_, lines_ = 0;
  std::vector<char> buffer_;  // capacity kBufferBytes from the start
  Status status_;
};

}  // namespace consac::learn
