#pragma once
#include "UObject/Object.h"

/// Neither null nor destroyed.
inline bool IsValid(const UObject* object) {
  return object != nullptr && !object->ShimDead();
}

template <class T>
T* NewObject(UObject* outer = nullptr) {
  T* made = new T();
  Shim::Adopt(made, outer);
  made->PostInitProperties();
  return made;
}

template <class T>
T* LoadObject(UObject* outer, const TCHAR* name) {
  check(name != nullptr);
  return NewObject<T>(outer);
}
