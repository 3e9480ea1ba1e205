#pragma once
#include "UObject/Object.h"
#include "UObject/ObjectMacros.h"

/// Neither null nor destroyed.
inline bool IsValid(const UObject* object) {
  return object != nullptr && !object->ShimDead();
}

namespace Shim {
/// Constructors that are at work.
inline int constructing = 0;
/// Whether the game is a packaged one: what only a text names was not packed.
inline bool packaged = true;
}  // namespace Shim

template <class T>
T* NewObject(UObject* outer = nullptr, FName name = NAME_None, EObjectFlags flags = RF_NoFlags) {
  check(name == NAME_None && (flags == RF_NoFlags || flags == RF_Transient));
  ++Shim::constructing;
  T* made = new T();
  --Shim::constructing;
  Shim::Adopt(made, outer);
  made->PostInitProperties();
  return made;
}

template <class T>
T* LoadObject(UObject* outer, const TCHAR* name) {
  check(name != nullptr);
  return Shim::packaged ? nullptr : NewObject<T>(outer);
}
