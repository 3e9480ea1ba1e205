#pragma once
#include "CoreMinimal.h"
#include "UObject/Class.h"

class UObject;
class UWorld;
class FObjectInitializer {};
/// Makes an object without state, of which Hot Reload takes the table of virtual functions; it is destroyed at once.
class FVTableHelper {};
template <class T>
class TObjectPtr;

namespace Shim {
/// What an object keeps alive: its reflected members that are, or hold, a TObjectPtr.
class References {
 public:
  template <class T>
  void Add(const T& member) {
    if constexpr (requires { member.ShimReferences(*this); }) member.ShimReferences(*this);
  }
  template <class T>
  void Add(const TObjectPtr<T>& member) {
    // An Unreal class has one base: the object is at the same place.
    slots_.push_back(reinterpret_cast<UObject**>(const_cast<TObjectPtr<T>*>(&member)));
  }
  template <class T>
  void Add(const std::vector<T*>& objects) {
    for (T* object : objects) found_.push_back(reinterpret_cast<UObject*>(object));
  }
  template <class T>
  void Add(const TArray<T>& members) {
    for (const T& member : members) Add(member);
  }
  const std::vector<UObject*>& found() const { return found_; }
  /// Members, which become null when their object is destroyed.
  const std::vector<UObject**>& slots() const { return slots_; }

 private:
  std::vector<UObject*> found_;
  std::vector<UObject**> slots_;
};

/// The runtime takes the object over; Collect deletes it one day.
void Adopt(UObject* object, UObject* outer);
}  // namespace Shim

/// Every object. Owned by the runtime (Shim/Runtime.h), never by its maker.
class UObject {
 public:
  UObject();
  explicit UObject(FVTableHelper&) : UObject() {}
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

  /// Its package is to be saved; so says the editor.
  bool MarkPackageDirty() const {
    shim_dirty_ = true;
    return true;
  }
  virtual void PostEditChange() { ++shim_edited_; }

  /// For the shim.
  void ShimRename(FName name) { shim_name_ = name; }
  FName ShimName() const { return shim_name_; }
  mutable bool shim_dirty_ = false;
  int shim_edited_ = 0;
  UObject* ShimOuter() const { return shim_outer_; }
  bool ShimDead() const { return shim_dead_; }
  void ShimKill() { shim_dead_ = true; }
  bool ShimBegunDestroy() const { return shim_begun_destroy_; }
  const std::shared_ptr<UObject*>& ShimToken() const { return shim_token_; }
  virtual void ShimAddSubobject(UObject* object) { shim_subobjects_.push_back(object); }
  /// Says what it keeps alive.
  virtual void ShimReferences(Shim::References& references) const { static_cast<void>(references); }
  const std::vector<UObject*>& ShimSubobjects() const { return shim_subobjects_; }

 private:
  friend void Shim::Adopt(UObject*, UObject*);
  std::shared_ptr<UObject*> shim_token_;
  UObject* shim_outer_ = nullptr;
  std::vector<UObject*> shim_subobjects_;
  FName shim_name_;
  int shim_number_ = 0;
  bool shim_dead_ = false;
  bool shim_begun_destroy_ = false;
};

/// What GENERATED_BODY gives a class of Unreal's own; the generator gives the plugin's the same.
#define SHIM_CLASS(type, base)                           \
 public:                                                 \
  using Super = base;                                    \
  type() = default;                                      \
  explicit type(FVTableHelper& helper) : base(helper) {} \
  using ThisClass = type;                                \
  static UClass* StaticClass() {                         \
    static UClass made(#type, base::StaticClass());      \
    return &made;                                        \
  }                                                      \
  UClass* ShimClass() const override {                   \
    return StaticClass();                                \
  }
