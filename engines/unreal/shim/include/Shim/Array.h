#pragma once
// TArray with signed sizes; TMap and TSet as names alone.

#include <algorithm>
#include <initializer_list>
#include <type_traits>
#include <utility>
#include <vector>

#include "Shim/Macros.h"

template <class T>
std::remove_reference_t<T>&& MoveTemp(T&& value) {
  static_assert(std::is_lvalue_reference_v<T> && !std::is_const_v<std::remove_reference_t<T>>,
                "MoveTemp takes a variable that is not const");
  return static_cast<std::remove_reference_t<T>&&>(value);
}

/// An index beyond the array ends the test, as Unreal's own check does.
template <class T>
class TArray {
  static_assert(!std::is_same_v<T, bool>, "a TArray<bool> is not in the table of symbols");

 public:
  TArray() = default;
  TArray(std::initializer_list<T> items) : items_(items) {}
  int32 Num() const { return static_cast<int32>(items_.size()); }
  bool IsEmpty() const { return items_.empty(); }
  T* GetData() { return items_.data(); }
  const T* GetData() const { return items_.data(); }
  T& operator[](int32 index) {
    check(index >= 0 && index < Num());
    return items_[static_cast<std::size_t>(index)];
  }
  const T& operator[](int32 index) const {
    check(index >= 0 && index < Num());
    return items_[static_cast<std::size_t>(index)];
  }
  int32 Add(const T& item) {
    items_.push_back(item);
    return Num() - 1;
  }
  int32 AddUnique(const T& item) {
    const auto at = std::find(items_.begin(), items_.end(), item);
    return at != items_.end() ? static_cast<int32>(at - items_.begin()) : Add(item);
  }
  void Append(const TArray& other) { items_.insert(items_.end(), other.items_.begin(), other.items_.end()); }
  void Append(std::initializer_list<T> items) { items_.insert(items_.end(), items); }
  bool Contains(const T& item) const { return std::find(items_.begin(), items_.end(), item) != items_.end(); }
  int32 Remove(const T& item) { return static_cast<int32>(std::erase(items_, item)); }
  T& Last() { return (*this)[Num() - 1]; }
  template <class Predicate>
  int32 RemoveAll(const Predicate& goes) {
    return static_cast<int32>(std::erase_if(items_, goes));
  }
  void Reserve(int32 count) { items_.reserve(static_cast<std::size_t>(count)); }
  void Reset(int32 = 0) { items_.clear(); }
  void SetNum(int32 count) { items_.resize(static_cast<std::size_t>(count)); }
  void SetNumUninitialized(int32 count) { items_.resize(static_cast<std::size_t>(count)); }
  T* begin() { return items_.data(); }
  T* end() { return items_.data() + items_.size(); }
  const T* begin() const { return items_.data(); }
  const T* end() const { return items_.data() + items_.size(); }

 private:
  std::vector<T> items_;
};

template <class K, class V>
class TMap {};
template <class T>
class TSet {};
