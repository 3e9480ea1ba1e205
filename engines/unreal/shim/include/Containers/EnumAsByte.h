#pragma once
#include "CoreMinimal.h"

/// An enum of C in one byte.
template <class ShimEnum>
class TEnumAsByte {
 public:
  TEnumAsByte() = default;
  TEnumAsByte(ShimEnum value) : value_(static_cast<uint8>(value)) {}
  operator ShimEnum() const { return static_cast<ShimEnum>(value_); }

 private:
  uint8 value_ = 0;
};
