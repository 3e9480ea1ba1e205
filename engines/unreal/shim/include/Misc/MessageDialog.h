#pragma once
#include <vector>

#include "CoreMinimal.h"

namespace EAppMsgType {
enum Type { Ok, YesNo };
}
namespace EAppReturnType {
enum Type { No, Yes, Ok };
}

/// A window with a message, and for tests those that were there.
struct FMessageDialog {
  static EAppReturnType::Type Open(EAppMsgType::Type type, const FText& message) {
    check(type == EAppMsgType::Ok);
    shim_told_.push_back(message.ShimToString());
    return EAppReturnType::Ok;
  }
  static inline std::vector<FString> shim_told_;
};
