#pragma once
#include <cstddef>

/// A member that keeps its object alive. Null at first.
template <class T>
class TObjectPtr {
 public:
  TObjectPtr() = default;
  TObjectPtr(std::nullptr_t) {}
  TObjectPtr(T* object) : object_(object) {}
  T* Get() const { return object_; }
  T* operator->() const { return object_; }
  T& operator*() const { return *object_; }
  operator T*() const { return object_; }

 private:
  T* object_ = nullptr;
};
