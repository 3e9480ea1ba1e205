#pragma once
#include "CoreMinimal.h"

class UTextureRenderTarget2D;

/// A picture on the graphics card.
class FRHITexture {
 public:
  explicit FRHITexture(UTextureRenderTarget2D* shim_target) : shim_target_(shim_target) {}
  UTextureRenderTarget2D* shim_target_;
};

struct FReadSurfaceDataFlags {};

/// What a command of the rendering thread does things with.
class FRHICommandListImmediate {
 public:
  void ReadSurfaceData(FRHITexture* texture, FIntRect part, TArray<FColor>& colours, FReadSurfaceDataFlags flags);
};
