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

/// Walks over state in one of three ways; see StateWriter, StateReader, StateHasher.
class Archive {
 public:
  virtual ~Archive() = default;

  /// True while fields are being overwritten from a checkpoint.
  virtual bool loading() const = 0;
  /// The first thing that did not fit; ok so far otherwise. After a failure nothing further is read.
  const Status& status() const { return status_; }

  /// Fails a load whose field `name` has a value that the object cannot have; call right after the field.
  void Check(std::string_view name, bool sane) {
    if (!loading() || sane) return;
    Fail({StatusCode::kDataLoss, "state field '" + prefix_ + std::string(name) +
                                     "' is out of its range; the checkpoint was changed by somebody else's hand"});
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
  /// Remembers the first failure.
  void Fail(Status status) {
    if (status_.ok()) status_ = std::move(status);
  }

 private:
  void Fixed(std::string_view name, DType dtype, void* data, std::size_t count) {
    if (status_.ok()) OnField(prefix_ + std::string(name), dtype, data, count);
  }
  std::uint64_t CountOf(std::string_view name, DType dtype) {
    return status_.ok() ? OnCount(prefix_ + std::string(name), dtype) : 0;
  }
  std::size_t Enter(std::string_view name) {
    const std::size_t mark = prefix_.size();
    prefix_.append(name).push_back('/');
    return mark;
  }

  std::string prefix_;
  Status status_;
};

/// Collects fields into a StateMap.
class StateWriter final : public Archive {
 public:
  bool loading() const override { return false; }
  /// What was collected.
  StateMap& fields() { return fields_; }

 protected:
  void OnField(std::string_view path, DType dtype, void* data, std::size_t count) override;
  std::uint64_t OnCount(std::string_view path, DType dtype) override;

 private:
  StateMap fields_;
};

/// Overwrites fields from a StateMap, which must outlive it. A missing field or other length fails with its path.
class StateReader final : public Archive {
 public:
  /// Reads from `fields`.
  explicit StateReader(const StateMap& fields) : fields_(fields) {}
  bool loading() const override { return true; }

 protected:
  void OnField(std::string_view path, DType dtype, void* data, std::size_t count) override;
  std::uint64_t OnCount(std::string_view path, DType dtype) override;

 private:
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
