#pragma once
#include "CoreMinimal.h"

class UObject;
class UWorld;
class FObjectInitializer {};

/// A class as a value: whom it derives from.
class UClass {
 public:
  UClass(const char* shim_name, const UClass* shim_base) : shim_name_(shim_name), shim_base_(shim_base) {}
  const char* ShimName() const { return shim_name_; }
  bool ShimIsA(const UClass* other) const {
    return this == other || (shim_base_ != nullptr && shim_base_->ShimIsA(other));
  }

 private:
  const char* shim_name_;
  const UClass* shim_base_;
};

namespace Shim {
/// The runtime takes the object over; Collect deletes it one day.
void Adopt(UObject* object, UObject* outer);
}  // namespace Shim

/// Every object. Owned by the runtime (Shim/Runtime.h), never by its maker.
class UObject {
 public:
  UObject();
  virtual ~UObject();
  UObject(const UObject&) = delete;
  UObject& operator=(const UObject&) = delete;
  static UClass* StaticClass();
  virtual UClass* ShimClass() const { return StaticClass(); }
  virtual void BeginDestroy() { shim_begun_destroy_ = true; }
  virtual void PostInitProperties() {}
  virtual UWorld* GetWorld() const;
  FString GetName() const;
  template <class T>
  T* CreateDefaultSubobject(FName name) {
    check(!(name == NAME_None));
    T* made = new T();
    Shim::Adopt(made, this);
    ShimAddSubobject(made);
    return made;
  }

  /// For the shim.
  UObject* ShimOuter() const { return shim_outer_; }
  bool ShimDead() const { return shim_dead_; }
  void ShimKill() { shim_dead_ = true; }
  bool ShimBegunDestroy() const { return shim_begun_destroy_; }
  const std::shared_ptr<UObject*>& ShimToken() const { return shim_token_; }
  virtual void ShimAddSubobject(UObject*) {}

 private:
  friend void Shim::Adopt(UObject*, UObject*);
  std::shared_ptr<UObject*> shim_token_;
  UObject* shim_outer_ = nullptr;
  int shim_number_ = 0;
  bool shim_dead_ = false;
  bool shim_begun_destroy_ = false;
};

/// What GENERATED_BODY gives a class of Unreal's own; the generator gives the plugin's the same.
#define SHIM_CLASS(type, base)                      \
 public:                                            \
  using Super = base;                               \
  using ThisClass = type;                           \
  static UClass* StaticClass() {                    \
    static UClass made(#type, base::StaticClass()); \
    return &made;                                   \
  }                                                 \
  UClass* ShimClass() const override {              \
    return StaticClass();                           \
  }
