#pragma once
#include <type_traits>

#include "UObject/Object.h"

/// Becomes null when its object goes.
template <class T>
class TWeakObjectPtr {
 public:
  TWeakObjectPtr() = default;
  TWeakObjectPtr(std::nullptr_t) {}
  TWeakObjectPtr(T* object) : shim_token_(object != nullptr ? Shim::TokenOf(object) : nullptr) {}
  bool IsValid() const { return shim_token_ != nullptr && *shim_token_ != nullptr && !(*shim_token_)->ShimDead(); }
  T* Get() const { return Get(false); }
  /// Also one that is garbage and not collected yet.
  T* Get(bool even_if_garbage) const {
    const bool there = shim_token_ != nullptr && *shim_token_ != nullptr;
    return there && (even_if_garbage || IsValid()) ? static_cast<T*>(*shim_token_) : nullptr;
  }
  T* operator->() const { return Get(); }
  friend bool operator==(const TWeakObjectPtr& a, const TWeakObjectPtr& b) { return a.shim_token_ == b.shim_token_; }

 private:
  std::shared_ptr<UObject*> shim_token_;
};
