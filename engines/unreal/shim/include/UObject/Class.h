#pragma once

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
