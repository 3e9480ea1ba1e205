#pragma once
class UClass;

template <class T>
class TSubclassOf {
 public:
  TSubclassOf() = default;
  TSubclassOf(UClass* cls) : shim_class_(cls) {}
  UClass* Get() const { return shim_class_; }

 private:
  UClass* shim_class_ = nullptr;
};
