#pragma once
#include "UObject/UObjectGlobals.h"

namespace Shim {
/// A thing of the project that a constructor named, and that is packed with a game for it.
UObject* Packed(const TCHAR* path, UObject* (*make)());
}  // namespace Shim

struct ConstructorHelpers {
  /// In constructors alone; keeps what it found.
  template <class T>
  struct FObjectFinder {
    explicit FObjectFinder(const TCHAR* path)
        : Object(static_cast<T*>(Shim::Packed(path, []() -> UObject* { return NewObject<T>(); }))) {
      check(Shim::constructing > 0);
    }
    T* Object;
  };
};
