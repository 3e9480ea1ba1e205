#pragma once
// How much an object's state is. Private to run.

#include <cstddef>

#include "consac/base/archive.h"

namespace consac::run {

/// Of the learners of one checkpoint, together: what is read again.
inline constexpr std::size_t kMostStateBytes = (std::size_t{1} << 31) - (std::size_t{32} << 20);

/// Adds up the bytes of an object's state, and its fields. Of rows that are streamed (row_segments.h) one counts: they
/// go by in pieces.
class StateSize final : public Archive {
 public:
  bool loading() const override { return false; }
  std::size_t bytes() const { return bytes_; }
  std::size_t fields() const { return fields_; }

 protected:
  void OnField(std::string_view, DType dtype, void*, std::size_t count) override {
    bytes_ += count * SizeOf(dtype);
    ++fields_;
  }
  std::uint64_t OnCount(std::string_view, DType) override { return 0; }
  void OnRows(const std::string&, StateRows& rows) override { bytes_ += rows.row_bytes(); }

 private:
  std::size_t bytes_ = 0, fields_ = 0;
};

}  // namespace consac::run
