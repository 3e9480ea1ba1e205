#pragma once
#include <functional>

#include "CoreMinimal.h"

/// What an entry of a menu does.
class FExecuteAction {
 public:
  template <class O>
  static FExecuteAction CreateRaw(O* object, void (O::*function)()) {
    FExecuteAction made;
    made.shim_call_ = [object, function] { (object->*function)(); };
    return made;
  }
  std::function<void()> shim_call_;
};
struct FUIAction {
  FUIAction(const FExecuteAction& execute) : shim_execute_(execute) {}
  FExecuteAction shim_execute_;
};
