#pragma once
#include <memory>

#include "Shim/Macros.h"

/// A shared object that is there.
template <class T>
class TSharedRef {
 public:
  template <class U>
  requires std::is_convertible_v<U*, T*> TSharedRef(const TSharedRef<U>& other) : shim_(other.shim_) {}
  explicit TSharedRef(std::shared_ptr<T> shim_object) : shim_(std::move(shim_object)) { check(shim_ != nullptr); }
  T* operator->() const { return shim_.get(); }
  T& operator*() const { return *shim_; }
  std::shared_ptr<T> shim_;
};

/// A shared object that may not be there.
template <class T>
class TSharedPtr {
 public:
  TSharedPtr() = default;
  TSharedPtr(std::nullptr_t) {}
  template <class U>
  requires std::is_convertible_v<U*, T*> TSharedPtr(const TSharedRef<U>& other) : shim_(other.shim_) {}
  template <class U>
  requires std::is_convertible_v<U*, T*> TSharedPtr(const TSharedPtr<U>& other) : shim_(other.shim_) {}
  explicit TSharedPtr(std::shared_ptr<T> shim_object) : shim_(std::move(shim_object)) {}
  bool IsValid() const { return shim_ != nullptr; }
  T* operator->() const {
    check(shim_ != nullptr);
    return shim_.get();
  }
  T& operator*() const { return *operator->(); }
  std::shared_ptr<T> shim_;
};

/// One that it does not keep.
template <class T>
class TWeakPtr {
 public:
  TWeakPtr() = default;
  TWeakPtr(const TSharedRef<T>& other) : shim_(other.shim_) {}
  TSharedPtr<T> Pin() const { return TSharedPtr<T>(shim_.lock()); }

 private:
  std::weak_ptr<T> shim_;
};
