#include "row_segments.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <utility>

#include "consac/base/file.h"
#include "consac/base/hash.h"
#include "consac/base/names.h"
#include "consac/run/shortage.h"
#include "run_files.h"

namespace consac::run {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;    // that are copied, checked and written at a time
constexpr std::int64_t kSmallBytes = std::int64_t{4} << 20;  // smaller segments are written again with what follows
constexpr char kMagic[8] = {'C', 'O', 'N', 'S', 'R', 'O', 'W', '1'};

/// What a segment's file begins with. Pieces follow: CRC-32C of the rows, then the rows.
struct SegmentHeader {
  char magic[8];
  std::uint64_t row_bytes;
  std::int64_t begin, end;
};

std::int64_t RowsOfPiece(std::size_t row_bytes) {
  return static_cast<std::int64_t>(std::max<std::size_t>(kPieceBytes / row_bytes, 1));
}

void Mix(std::uint64_t* digest, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) *digest = (*digest ^ ((value >> (8 * i)) & 0xff)) * 1099511628211ull;
}

std::uint64_t BeginDigest(const SegmentHeader& header) {
  std::uint64_t digest = 14695981039346656037ull;
  Mix(&digest, header.row_bytes);
  Mix(&digest, static_cast<std::uint64_t>(header.begin));
  Mix(&digest, static_cast<std::uint64_t>(header.end));
  return digest;
}

std::span<const std::byte> BytesOf(const auto& object) {
  return std::as_bytes(std::span(&object, 1));
}

Result<Segment> WriteSegment(const std::string& file, const FolderCheck& folder, const StateRows& rows,
                             std::int64_t begin, std::int64_t end) {
  SegmentHeader header{{}, rows.row_bytes(), begin, end};
  std::memcpy(header.magic, kMagic, sizeof(kMagic));
  AtomicFile out;
  CONSAC_RETURN_IF_ERROR(out.Open(file, folder));
  CONSAC_RETURN_IF_ERROR(out.Write(BytesOf(header)));
  std::uint64_t digest = BeginDigest(header);
  const std::int64_t most = RowsOfPiece(header.row_bytes);
  std::vector<std::byte> piece(static_cast<std::size_t>(std::min(most, end - begin)) * header.row_bytes);
  for (std::int64_t at = begin; at < end; at += most) {
    const std::int64_t count = std::min(most, end - at);
    const std::span<std::byte> bytes(piece.data(), static_cast<std::size_t>(count) * header.row_bytes);
    rows.CopyRows(at, count, bytes.data());
    const std::uint32_t check = Crc32c(bytes);
    Mix(&digest, check);
    CONSAC_RETURN_IF_ERROR(out.Write(BytesOf(check)));
    CONSAC_RETURN_IF_ERROR(out.Write(bytes));
  }
  CONSAC_RETURN_IF_ERROR(out.Commit());
  return Segment{begin, end, digest};
}

/// kFailedPrecondition where the system does not let it be read: it may be whole.
Status Unreadable(const FileReader& in, const Status& why) {
  return in.refused() ? Status{StatusCode::kFailedPrecondition, why.message()} : why;
}

/// Calls take(first row, count, rows) for every piece, checked; false from it ends the reading.
Status ReadSegment(const std::string& file, const Segment& segment, std::size_t row_bytes,
                   const std::function<bool(std::int64_t, std::int64_t, const std::byte*)>& take) {
  const Status damaged = {StatusCode::kDataLoss, "'" + file + "' is damaged"};
  FileReader in;
  const auto read = [&in](std::span<std::byte> bytes) { return Unreadable(in, in.Read(bytes)); };
  CONSAC_RETURN_IF_ERROR(Unreadable(in, in.Open(file)));
  SegmentHeader header{};
  CONSAC_RETURN_IF_ERROR(read(std::as_writable_bytes(std::span(&header, 1))));
  if (std::memcmp(header.magic, kMagic, sizeof(kMagic)) != 0 || header.begin != segment.begin ||
      header.end != segment.end || header.row_bytes == 0 || (row_bytes != 0 && header.row_bytes != row_bytes) ||
      header.row_bytes > (std::uint64_t{1} << 32) || header.end < header.begin) {
    return damaged;
  }
  std::uint64_t digest = BeginDigest(header);
  const std::int64_t most = RowsOfPiece(header.row_bytes);
  std::vector<std::byte> piece;
  for (std::int64_t at = header.begin; at < header.end; at += most) {
    const std::int64_t count = std::min(most, header.end - at);
    std::uint32_t check = 0;
    piece.resize(static_cast<std::size_t>(count) * header.row_bytes);
    CONSAC_RETURN_IF_ERROR(read(std::as_writable_bytes(std::span(&check, 1))));
    CONSAC_RETURN_IF_ERROR(read(std::as_writable_bytes(std::span(piece))));
    if (Crc32c(piece) != check) return damaged;
    Mix(&digest, check);
    if (take && !take(at, count, piece.data())) break;
  }
  if (!take && digest != segment.digest) return damaged;
  return Status::Ok();
}

/// What CheckpointWriter put under path + "/segments" and "/digests".
std::vector<Segment> SegmentsFrom(std::span<const std::int64_t> bounds, std::span<const std::uint64_t> digests) {
  std::vector<Segment> all;
  for (std::size_t i = 0; i < digests.size() && 2 * i + 1 < bounds.size(); ++i)
    all.push_back({bounds[2 * i], bounds[2 * i + 1], digests[i]});
  return all;
}

template <class T>
std::vector<T> NumbersOf(const StateField& field) {
  std::vector<T> numbers(field.bytes.size() / sizeof(T));
  if (!numbers.empty()) std::memcpy(numbers.data(), field.bytes.data(), numbers.size() * sizeof(T));
  return numbers;
}

}  // namespace

std::string RowSegments::FileOf(const std::string& path, const Segment& segment) const {
  std::string rows = path;
  std::replace(rows.begin(), rows.end(), '/', '.');
  const auto number = [](std::int64_t row) {
    const std::string digits = std::to_string(row);
    return std::string(digits.size() < 12 ? 12 - digits.size() : 0, '0') + digits;
  };
  return FileNameOf(rows + "_" + number(segment.begin) + "_" + number(segment.end), kSegmentEnd);
}

// A small segment is written again together with what follows it, unless that is less: so their number stays small, and
// each row is written a few times at most.
Status RowSegments::Write(const std::string& path, StateRows& rows, std::vector<Segment>* all) {
  std::vector<Segment>& list = segments_[path];
  const std::int64_t first = rows.first_row(), end = rows.end_row();
  std::erase_if(list, [&](const Segment& segment) { return segment.end <= first; });
  std::int64_t begin = list.empty() ? first : list.back().end;
  const auto bytes = static_cast<std::int64_t>(rows.row_bytes());
  std::vector<Segment> kept = list;
  while (begin < end && !kept.empty() && (kept.back().end - kept.back().begin) * bytes < kSmallBytes &&
         kept.back().end - kept.back().begin <= end - begin) {
    begin = std::max(kept.back().begin, first);
    kept.pop_back();
  }
  if (begin < end) {
    const std::string file = FileOf(path, {begin, end, 0});
    Result<Segment> segment = WriteSegment(folder_ + "/" + file, check_, rows, begin, end);
    if (!segment.ok()) return segment.status();
    written_.insert(file);
    kept.push_back(*segment);
  }
  list = std::move(kept);
  *all = list;
  return Status::Ok();
}

Status RowSegments::Read(const std::string& path, std::int64_t end, StateRows& rows, const std::vector<Segment>& all) {
  const std::size_t row_bytes = rows.row_bytes();
  const Status misfit = {StatusCode::kDataLoss,
                         "the rows of '" + path + "' do not fit; resume with the settings of the first run"};
  for (const Segment& segment : all) {
    bool fits = true;
    CONSAC_RETURN_IF_ERROR(
        ReadSegment(folder_ + "/" + FileOf(path, segment), segment, row_bytes,
                    [&](std::int64_t at, std::int64_t count, const std::byte* piece) {
                      const std::int64_t skipped = std::clamp<std::int64_t>(rows.end_row() - at, 0, count);
                      fits = at <= rows.end_row() &&
                             rows.TakeRows(count - skipped, piece + static_cast<std::size_t>(skipped) * row_bytes);
                      return fits;
                    }));
    if (!fits) return misfit;
  }
  if (rows.end_row() != end) return misfit;
  segments_[path] = committed_[path] = all;
  return Status::Ok();
}

Status RowSegments::Check(const StateMap& state) const {
  constexpr std::string_view kEnd = "/segments";
  for (const auto& [name, field] : state) {
    if (!name.ends_with(kEnd) || field.dtype != DType::kI64) continue;
    const std::string path = name.substr(0, name.size() - kEnd.size());
    const auto digests = state.find(path + "/digests");
    if (digests == state.end()) continue;
    for (const Segment& segment :
         SegmentsFrom(NumbersOf<std::int64_t>(field), NumbersOf<std::uint64_t>(digests->second)))
      CONSAC_RETURN_IF_ERROR(ReadSegment(folder_ + "/" + FileOf(path, segment), segment, 0, {}));
  }
  return Status::Ok();
}

std::set<std::string> RowSegments::FilesOf(const SegmentsByPath& segments) const {
  std::set<std::string> files;
  for (const auto& [path, list] : segments) {
    for (const Segment& segment : list) files.insert(FileOf(path, segment));
  }
  return files;
}

void RowSegments::Remove(const std::set<std::string>& files) const {
  Folder folder;
  if (files.empty() || !folder.Open(folder_, check_).ok()) return;
  for (const std::string& file : files) folder.Remove(file);
}

void RowSegments::Committed() {
  written_.clear();
  committed_ = SegmentsByPath(segments_);  // a copy first: memory may be short, and half of it would be wrong
}

void RowSegments::RemoveUnneeded(const std::string& checkpoint, std::int64_t keep) {
  std::set<std::string> unneeded;
  for (const std::string& file : FilesIn(folder_)) {
    if (IsSegment(file)) unneeded.insert(file);
  }
  // Which of those that were there before the checkpoints of earlier sessions need is not known: all, for a while.
  if (!looked_) earlier_ = unneeded;
  looked_ = true;
  if (held_.empty() || held_.back().checkpoint != checkpoint) {  // else it has taken its own place
    held_.push_back({checkpoint, {}});
    ++checkpoints_;
  }
  held_.back().files = FilesOf(committed_);
  while (held_.size() > static_cast<std::size_t>(keep)) held_.pop_front();
  if (checkpoints_ >= keep) earlier_.clear();
  for (const std::string& file : FilesOfHeld()) unneeded.erase(file);
  Remove(unneeded);
}

std::set<std::string> RowSegments::FilesOfHeld() const {
  std::set<std::string> files = earlier_;
  for (const Held& held : held_) files.insert(held.files.begin(), held.files.end());
  return files;
}

// Of the same rows as a standing checkpoint's a file has that one's contents, and stays.
void RowSegments::Abandon() {
  if (written_.empty()) return;
  SegmentsByPath committed = committed_;  // memory may be what was short: all of it is taken back, or nothing
  segments_ = std::move(committed);
  std::set<std::string> unneeded = std::exchange(written_, {});
  for (const std::string& file : FilesOf(committed_)) unneeded.erase(file);
  for (const std::string& file : FilesOfHeld()) unneeded.erase(file);
  Remove(unneeded);
}

CheckpointWriter::~CheckpointWriter() {
  const Status gone = Guarded([this] {
    segments_.Abandon();
    return Status::Ok();
  });
  if (!gone.ok()) Log(LogLevel::kError, gone.message());
}

void CheckpointWriter::OnRows(const std::string& path, StateRows& rows) {
  if (BeginRowsOf(path, rows) < 0) return;
  std::vector<Segment> all;
  if (const Status written = segments_.Write(path, rows, &all); !written.ok()) return Fail(written);
  std::vector<std::int64_t> bounds;
  std::vector<std::uint64_t> digests;
  for (const Segment& segment : all) {
    bounds.insert(bounds.end(), {segment.begin, segment.end});
    digests.push_back(segment.digest);
  }
  OnField(path + "/segments", DType::kI64, bounds.data(), bounds.size());
  OnField(path + "/digests", DType::kU64, digests.data(), digests.size());
}

void CheckpointReader::OnRows(const std::string& path, StateRows& rows) {
  if (BeginRowsOf(path, rows) < 0) return;
  std::int64_t end = 0;
  OnField(path + "/end", DType::kI64, &end, 1);
  std::vector<std::int64_t> bounds(static_cast<std::size_t>(OnCount(path + "/segments", DType::kI64)));
  std::vector<std::uint64_t> digests(static_cast<std::size_t>(OnCount(path + "/digests", DType::kU64)));
  OnField(path + "/segments", DType::kI64, bounds.data(), bounds.size());
  OnField(path + "/digests", DType::kU64, digests.data(), digests.size());
  if (!status().ok()) return;
  if (const Status read = segments_.Read(path, end, rows, SegmentsFrom(bounds, digests)); !read.ok()) Fail(read);
}

}  // namespace consac::run
