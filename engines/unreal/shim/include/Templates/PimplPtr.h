#pragma once
#include <memory>

#include "Shim/Macros.h"

/// Hidden state whose type is complete only where it is made.
template <class T>
class TPimplPtr {
 public:
  TPimplPtr() = default;
  bool IsValid() const { return state_ != nullptr; }
  T* Get() const { return state_.get(); }
  T* operator->() const {
    check(state_ != nullptr);
    return state_.get();
  }
  T& operator*() const {
    check(state_ != nullptr);
    return *state_;
  }

 private:
  template <class U>
  friend TPimplPtr<U> MakePimpl();
  std::shared_ptr<T> state_;  // keeps the right destructor, as Unreal's does
};

template <class T>
TPimplPtr<T> MakePimpl() {
  static_assert(alignof(T) <= 16,
                "the engine keeps hidden state at multiples of 16 bytes, and refuses to compile what needs more");
  TPimplPtr<T> made;
  made.state_ = std::make_shared<T>();
  return made;
}
