#pragma once
#include "CoreMinimal.h"

class FCoreDelegates {
 public:
  static inline TMulticastDelegate<void()> OnEndFrame;
  static inline TMulticastDelegate<void()> OnPreExit;
};
