#pragma once
#include "UObject/Object.h"

enum ETextureRenderTargetFormat { RTF_RGBA16f, RTF_RGBA8 };

class UTextureRenderTarget2D : public UObject {
  SHIM_CLASS(UTextureRenderTarget2D, UObject)
  /// For the shim: what was drawn.
  int32 shim_width_ = 0, shim_height_ = 0;
  TArray<FColor> shim_pixels_;
};
