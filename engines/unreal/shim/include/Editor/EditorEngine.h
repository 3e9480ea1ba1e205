#pragma once
#include "UObject/Object.h"
#include "UObject/ObjectPtr.h"

class UWorld;

/// The editor: it sleeps in the background unless somebody asks it not to.
class UEditorEngine : public UObject {
  SHIM_CLASS(UEditorEngine, UObject)
  class FShouldDisableCPUThrottling {
   public:
    static FShouldDisableCPUThrottling CreateStatic(bool (*function)()) {
      static int count = 0;
      FShouldDisableCPUThrottling made;
      made.shim_function_ = function;
      made.shim_handle_ = FDelegateHandle(++count);
      return made;
    }
    FDelegateHandle GetHandle() const { return shim_handle_; }
    /// For tests.
    bool ShimAsk() const { return shim_function_(); }

   private:
    bool (*shim_function_)() = nullptr;
    FDelegateHandle shim_handle_;
  };
  /// The first world that plays in the editor; none while nothing does.
  TObjectPtr<UWorld> PlayWorld;
  TArray<FShouldDisableCPUThrottling> ShouldDisableCPUThrottlingDelegates;
  /// For tests: the most frames that it draws in a second; a limit of 0 is none of its own, and it has another then.
  static float ShimFrameLimit();
  /// For tests: whether it sleeps when another program is in front.
  bool ShimSleeps() const {
    for (const FShouldDisableCPUThrottling& asked : ShouldDisableCPUThrottlingDelegates)
      if (asked.ShimAsk()) return false;
    return true;
  }
};
