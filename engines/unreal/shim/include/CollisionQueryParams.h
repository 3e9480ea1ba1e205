#pragma once
#include <vector>

#include "CoreMinimal.h"
#include "Engine/EngineTypes.h"

class AActor;

namespace Shim {
/// Channels that what a world's shim_trace_ finds blocks.
inline std::vector<ECollisionChannel> blocked_channels = {ECC_Pawn, ECC_Visibility};
}  // namespace Shim

struct FCollisionQueryParams {
  void AddIgnoredActor(const AActor* actor) { shim_ignored_ = actor; }
  const AActor* ShimIgnored() const { return shim_ignored_; }

 private:
  const AActor* shim_ignored_ = nullptr;
};
