#include "consac/base/archive.h"

#include <algorithm>
#include <cstring>

namespace consac {

void Archive::operator()(std::string_view name, std::string& text) {
  std::vector<std::uint8_t> bytes(text.begin(), text.end());
  (*this)(name, bytes);
  if (loading() && status_.ok()) text.assign(bytes.begin(), bytes.end());
}

void Archive::FailRange(std::string_view name, const std::string& how) {
  Fail({StatusCode::kDataLoss, "state field '" + prefix_ + std::string(name) + "' " + how +
                                   "; the checkpoint was changed by somebody else's hand"});
}

void Archive::CheckWithin(std::string_view name, std::int64_t value, std::int64_t least, std::int64_t most) {
  if (!loading() || (value >= least && value <= most)) return;
  FailRange(name, "is " + std::to_string(value) + " and can only be from " + std::to_string(least) + " to " +
                      std::to_string(most));
}

void Archive::FailRows(const std::string& path) {
  Fail({StatusCode::kDataLoss,
        "the rows of '" + path +
            "' do not fit; resume with the settings of the first run (or the checkpoint was changed by somebody "
            "else's hand)"});
}

std::int64_t Archive::BeginRowsOf(const std::string& path, StateRows& rows) {
  std::int64_t first = rows.first_row(), end = rows.end_row();
  OnField(path + "/first", DType::kI64, &first, 1);
  OnField(path + "/end", DType::kI64, &end, 1);
  if (!status_.ok()) return -1;
  if (loading() && (first < 0 || end < first || !rows.BeginRows(first, end))) {
    FailRows(path);
    return -1;
  }
  return end - first;
}

void Archive::RowsAsFields(const std::string& path, StateRows& rows) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  std::int64_t left = BeginRowsOf(path, rows);
  if (left <= 0) return;
  const auto most = static_cast<std::int64_t>(std::max<std::size_t>(kPiece / rows.row_bytes(), 1));
  std::vector<std::byte> piece(static_cast<std::size_t>(std::min(most, left)) * rows.row_bytes());
  for (std::int64_t i = 0, at = rows.first_row(); left > 0 && status_.ok(); ++i) {
    const std::int64_t count = std::min(most, left);
    if (!loading()) rows.CopyRows(at, count, piece.data());
    OnField(path + "/" + std::to_string(i), DType::kU8, piece.data(),
            static_cast<std::size_t>(count) * rows.row_bytes());
    if (!status_.ok()) return;
    if (loading() && !rows.TakeRows(count, piece.data())) return FailRows(path);
    at += count;
    left -= count;
  }
}

void StateWriter::Put(std::string_view path, DType dtype, const void* data, std::size_t count) {
  StateField field;
  field.dtype = dtype;
  const auto* first = static_cast<const std::byte*>(data);
  if (count > 0) field.bytes.assign(first, first + count * SizeOf(dtype));
  if (!fields_.emplace(std::string(path), std::move(field)).second) {
    Fail({StatusCode::kInternal,
          "state field '" + std::string(path) + "' is listed twice; give each field its own name"});
  }
}

void StateReader::Take(std::string_view path, DType dtype, void* data, std::size_t count) {
  const auto found = fields_.find(path);
  if (found == fields_.end()) {
    Fail({StatusCode::kDataLoss,
          "state has no field '" + std::string(path) + "'; it was written by another version or for another run"});
    return;
  }
  const StateField& field = found->second;
  if (field.dtype != dtype || field.bytes.size() != count * SizeOf(dtype)) {
    Fail({StatusCode::kDataLoss, "state field '" + std::string(path) + "' holds " +
                                     std::to_string(field.bytes.size() / SizeOf(field.dtype)) + " x " +
                                     std::string(NameOf(field.dtype)) + ", expected " + std::to_string(count) + " x " +
                                     std::string(NameOf(dtype)) + "; resume with the settings of the first run"});
    return;
  }
  if (count > 0) std::memcpy(data, field.bytes.data(), field.bytes.size());
}

std::uint64_t StateReader::Count(std::string_view path, DType dtype) {
  const auto found = fields_.find(path);
  if (found == fields_.end() || found->second.dtype != dtype) {
    Fail({StatusCode::kDataLoss,
          "state has no field '" + std::string(path) + "' of type " + std::string(NameOf(dtype))});
    return 0;
  }
  return found->second.bytes.size() / SizeOf(dtype);
}

void StateHasher::Mix(const void* data, std::size_t bytes) {
  const auto* first = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < bytes; ++i) hash_ = (hash_ ^ first[i]) * 1099511628211ull;
}

void StateHasher::OnField(std::string_view path, DType dtype, void* data, std::size_t count) {
  Mix(path.data(), path.size());
  Mix(&dtype, sizeof(dtype));
  if (count > 0) Mix(data, count * SizeOf(dtype));
}

std::uint64_t StateHasher::OnCount(std::string_view, DType) {
  return 0;
}

}  // namespace consac
