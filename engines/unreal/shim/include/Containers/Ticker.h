#pragma once
#include "CoreMinimal.h"

/// A function of an object that is called in every frame, or after so many seconds and again, until it says false.
class FTickerDelegate {
 public:
  template <class O>
  static FTickerDelegate CreateUObject(O* object, bool (O::*function)(float)) {
    FTickerDelegate made;
    made.shim_token_ = Shim::TokenOf(object);
    made.shim_call_ = [object, function](float seconds) { return (object->*function)(seconds); };
    return made;
  }
  /// Of any object, which must have been removed before it goes.
  template <class O>
  static FTickerDelegate CreateRaw(O* object, bool (O::*function)(float)) {
    FTickerDelegate made;
    made.shim_call_ = [object, function](float seconds) { return (object->*function)(seconds); };
    return made;
  }

 private:
  friend class FTSTicker;
  std::shared_ptr<UObject*> shim_token_;  // null: of no object of the engine
  std::function<bool(float)> shim_call_;
  float shim_delay_ = 0.0f, shim_waited_ = 0.0f;
};

class FTSTicker {
 public:
  using FDelegateHandle = std::weak_ptr<FTickerDelegate>;
  static FTSTicker& GetCoreTicker();
  FDelegateHandle AddTicker(const FTickerDelegate& delegate, float delay = 0.0f);
  static void RemoveTicker(FDelegateHandle handle);
  /// For the shim: one frame.
  void ShimTick(float seconds);
  /// For tests: how many are there.
  std::size_t ShimCount() const { return shim_calls_.size(); }

 private:
  std::vector<std::shared_ptr<FTickerDelegate>> shim_calls_;
};
