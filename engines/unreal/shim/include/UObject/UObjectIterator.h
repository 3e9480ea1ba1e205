#pragma once
#include <vector>

#include "UObject/UObjectGlobals.h"

namespace Shim {
/// Every object, those that are dead and not collected too.
std::vector<UObject*> AllObjects();
/// A place in a list, which is true until its end.
class Iteration {
 public:
  explicit operator bool() const { return shim_at_ < shim_found_.size(); }

 protected:
  std::vector<UObject*> shim_found_;
  std::size_t shim_at_ = 0;
};
}  // namespace Shim

/// Goes through all objects of a class.
template <class T>
class TObjectIterator : public Shim::Iteration {
 public:
  TObjectIterator() {
    for (UObject* object : Shim::AllObjects())
      if (object->ShimClass()->ShimIsA(T::StaticClass())) shim_found_.push_back(object);
  }
  TObjectIterator& operator++() {
    ++shim_at_;
    return *this;
  }
  T* operator*() const { return static_cast<T*>(shim_found_[shim_at_]); }
};
