#pragma once
#include "UObject/Object.h"

/// Null where the object is of another class.
template <class T>
T* Cast(UObject* object) {
  return object != nullptr && object->ShimClass()->ShimIsA(T::StaticClass()) ? static_cast<T*>(object) : nullptr;
}
