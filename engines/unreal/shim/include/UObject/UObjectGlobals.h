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

namespace Shim {
/// The object of that name directly within another one; null where there is none.
UObject* Find(const UObject* outer, FName name);
/// For MakeUniqueObjectName.
FName UniqueName(const UObject* outer, FName name);
}  // namespace Shim

template <class T>
T* FindObject(UObject* outer, const TCHAR* name) {
  UObject* found = Shim::Find(outer, FName(name));
  return found != nullptr && found->ShimClass()->ShimIsA(T::StaticClass()) ? static_cast<T*>(found) : nullptr;
}

/// One of a name that is taken would take the other's place, and whoever refers to that would hold a ruin.
template <class T>
T* NewObject(UObject* outer = nullptr, FName name = NAME_None, EObjectFlags flags = RF_NoFlags) {
  check(name == NAME_None || Shim::Find(outer, name) == nullptr);
  ++Shim::constructing;
  T* made = new T();
  --Shim::constructing;
  static_cast<void>(flags);
  Shim::Adopt(made, outer);
  made->ShimRename(name);
  made->PostInitProperties();
  return made;
}

/// That name, or one made of it that no object within `outer` has, be it destroyed and not collected yet.
FName MakeUniqueObjectName(UObject* outer, const UClass* cls, FName name = NAME_None);

template <class T>
T* LoadObject(UObject* outer, const TCHAR* name) {
  check(name != nullptr);
  return Shim::packaged ? nullptr : NewObject<T>(outer);
}
