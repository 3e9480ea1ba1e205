#pragma once
/// What may be said of an object that is made.
enum EObjectFlags { RF_NoFlags = 0, RF_Public = 1, RF_Standalone = 2, RF_Transient = 0x40 };
constexpr EObjectFlags operator|(EObjectFlags a, EObjectFlags b) {
  return static_cast<EObjectFlags>(static_cast<int>(a) | static_cast<int>(b));
}
