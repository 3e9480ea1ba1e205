#pragma once
// One list of state per object. An object names its fields once, in `void Visit(Archive&)`; the same list then
// writes a checkpoint, reads it back, and hashes the state. Fields become named tensors ("learner/optimiser/m"),
// so a checkpoint is an ordinary model file (see model/model_file.h).

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "consac/base/dtype.h"
#include "consac/base/status.h"

namespace consac {

class Archive;

/// An object that lists its state.
template <class T>
concept Visitable = requires(T& object, Archive& archive) {
  object.Visit(archive);
};

/// A named, typed, one-dimensional piece of state.
struct StateField {
  DType dtype = DType::kF32;     ///< element type
  std::vector<std::byte> bytes;  ///< [count] elements, host byte order
};

/// All fields of an object by path.
using StateMap = std::map<std::string, StateField, std::less<>>;

/// State that is too large to copy: rows that are written once, counted for ever and dropped from the front. Whoever
/// saves them streams those that are new since it did so last.
class StateRows {
 public:
  virtual ~StateRows() = default;
  /// Bytes of one row as it is saved; constant for life.
  virtual std::size_t row_bytes() const = 0;
  /// Number of the oldest row that is kept.
  virtual std::int64_t first_row() const = 0;
  /// Number of the row to come; rows [first_row, end_row) are kept.
  virtual std::int64_t end_row() const = 0;
  /// Writes rows [from, from + count), which are kept, to `to`, [count, row_bytes].
  virtual void CopyRows(std::int64_t from, std::int64_t count, std::byte* to) const = 0;
  /// Forgets all rows; those of [first, end) follow by TakeRows. False when it has no room for so many.
  [[nodiscard]] virtual bool BeginRows(std::int64_t first, std::int64_t end) = 0;
  /// The next `count` rows, [count, row_bytes]. False when it cannot have one of them.
  [[nodiscard]] virtual bool TakeRows(std::int64_t count, const std::byte* rows) = 0;
};

/// Walks over state in one of three ways; see StateWriter, StateReader, StateHasher. Its virtual functions and theirs
/// are inline: core is compiled without RTTI, and who derives from them may not be.
class Archive {
 public:
  virtual ~Archive() = default;

  /// True while fields are being overwritten from a checkpoint.
  virtual bool loading() const = 0;
  /// The first thing that did not fit; ok so far otherwise. After a failure nothing further is read.
  const Status& status() const { return status_; }

  /// Fails a load whose field `name` has a value that the object cannot have; call right after the field.
  void Check(std::string_view name, bool sane) {
    if (loading() && !sane) FailRange(name, "is out of its range");
  }

  /// The same for a whole number that may be from `least` to `most`: the failure says which it is.
  void CheckWithin(std::string_view name, std::int64_t value, std::int64_t least, std::int64_t most);
  /// Fails a load for what lies beside the checkpoint and is not what its fields say.
  void Refuse(Status why) {
    if (loading()) Fail(std::move(why));
  }

  /// One number or enum.
  template <class T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void operator()(std::string_view name, T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t raw = value ? 1 : 0;  // a bool that holds any other byte may not be looked at
      Fixed(name, DType::kBool, &raw, 1);
      Check(name, raw <= 1);
      value = raw == 1;
    } else if constexpr (std::is_enum_v<T>) {
      auto raw = static_cast<std::underlying_type_t<T>>(value);
      Fixed(name, DTypeOf<decltype(raw)>::value, &raw, 1);
      value = static_cast<T>(raw);
    } else {
      Fixed(name, DTypeOf<T>::value, &value, 1);
    }
  }
  /// A fixed run of numbers; a checkpoint of another length is an error.
  template <class T>
  requires(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) void operator()(std::string_view name,
                                                                                std::span<T> values) {
    Fixed(name, DTypeOf<T>::value, values.data(), values.size());
  }
  /// A run of numbers whose length is part of the state.
  template <class T>
  requires(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) void operator()(std::string_view name,
                                                                                std::vector<T>& values) {
    std::uint64_t count = values.size();
    if (loading()) {
      count = CountOf(name, DTypeOf<T>::value);
      if (!status_.ok()) return;
      values.resize(static_cast<std::size_t>(count));
    }
    Fixed(name, DTypeOf<T>::value, values.data(), values.size());
  }
  /// A text.
  void operator()(std::string_view name, std::string& text);
  /// Another object, under its own name.
  template <Visitable T>
  void operator()(std::string_view name, T& object) {
    const std::size_t mark = Enter(name);
    object.Visit(*this);
    prefix_.resize(mark);
  }
  /// Rows that a saver may stream; without one they are fields like all others.
  void operator()(std::string_view name, StateRows& rows) {
    if (status_.ok()) OnRows(prefix_ + std::string(name), rows);
  }
  /// Many objects; their number is fixed by construction.
  template <Visitable T>
  void operator()(std::string_view name, std::vector<T>& objects) {
    const std::size_t mark = Enter(name);
    for (std::size_t i = 0; i < objects.size(); ++i) (*this)(std::to_string(i), objects[i]);
    prefix_.resize(mark);
  }

 protected:
  /// Reads, writes or hashes `count` elements at `data`.
  virtual void OnField(std::string_view path, DType dtype, void* data, std::size_t count) = 0;
  /// Elements that the checkpoint holds under `path`; fails the archive when it holds none.
  virtual std::uint64_t OnCount(std::string_view path, DType dtype) = 0;
  /// Reads, writes or hashes rows; as fields "path/first", "path/end" and "path/0", "path/1", ... of some rows each.
  virtual void OnRows(const std::string& path, StateRows& rows) { RowsAsFields(path, rows); }
  /// Reads what BeginRows needs and calls it; returns how many rows are to follow, or -1 after a failure.
  std::int64_t BeginRowsOf(const std::string& path, StateRows& rows);
  /// A row that the object cannot have.
  void FailRows(const std::string& path);
  /// Remembers the first failure.
  void Fail(Status status) {
    if (status_.ok()) status_ = std::move(status);
  }

 private:
  void FailRange(std::string_view name, const std::string& how);
  void Fixed(std::string_view name, DType dtype, void* data, std::size_t count) {
    if (status_.ok()) OnField(prefix_ + std::string(name), dtype, data, count);
  }
  std::uint64_t CountOf(std::string_view name, DType dtype) {
    return status_.ok() ? OnCount(prefix_ + std::string(name), dtype) : 0;
  }
  void RowsAsFields(const std::string& path, StateRows& rows);
  std::size_t Enter(std::string_view name) {
    const std::size_t mark = prefix_.size();
    prefix_.append(name).push_back('/');
    return mark;
  }

  std::string prefix_;
  Status status_;
};

/// Collects fields into a StateMap. Derive from it to put rows elsewhere.
class StateWriter : public Archive {
 public:
  bool loading() const override { return false; }
  /// What was collected.
  StateMap& fields() { return fields_; }

 protected:
  void OnField(std::string_view path, DType dtype, void* data, std::size_t count) override {
    Put(path, dtype, data, count);
  }
  std::uint64_t OnCount(std::string_view, DType) override { return 0; }

 private:
  void Put(std::string_view path, DType dtype, const void* data, std::size_t count);

  StateMap fields_;
};

/// Overwrites fields from a StateMap, which must outlive it. Derive from it to get rows from elsewhere.
/// A missing field or other length fails with its path.
class StateReader : public Archive {
 public:
  /// Reads from `fields`.
  explicit StateReader(const StateMap& fields) : fields_(fields) {}
  bool loading() const override { return true; }

 protected:
  void OnField(std::string_view path, DType dtype, void* data, std::size_t count) override {
    Take(path, dtype, data, count);
  }
  std::uint64_t OnCount(std::string_view path, DType dtype) override { return Count(path, dtype); }

 private:
  void Take(std::string_view path, DType dtype, void* data, std::size_t count);
  std::uint64_t Count(std::string_view path, DType dtype);

  const StateMap& fields_;
};

/// Hashes paths, types and bytes (FNV-1a, 64 bits): two objects with equal hashes hold the same state.
class StateHasher final : public Archive {
 public:
  bool loading() const override { return false; }
  /// The hash so far.
  std::uint64_t hash() const { return hash_; }

 protected:
  void OnField(std::string_view path, DType dtype, void* data, std::size_t count) override;
  std::uint64_t OnCount(std::string_view path, DType dtype) override;

 private:
  void Mix(const void* data, std::size_t bytes);
  std::uint64_t hash_ = 14695981039346656037ull;
};

/// The hash of one object's state.
template <Visitable T>
std::uint64_t HashState(T& object) {
  StateHasher hasher;
  object.Visit(hasher);
  return hasher.hash();
}

}  // namespace consac
