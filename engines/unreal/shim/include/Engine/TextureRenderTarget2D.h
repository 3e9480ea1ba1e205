#pragma once
#include "TextureResource.h"
#include "UObject/Object.h"

enum ETextureRenderTargetFormat { RTF_RGBA16f, RTF_RGBA8 };

class UTextureRenderTarget2D : public UObject {
  SHIM_CLASS(UTextureRenderTarget2D, UObject)
  FTextureRenderTargetResource* GameThread_GetRenderTargetResource() { return &shim_resource_; }
  int32 SizeX = 0, SizeY = 0;
  /// 0: linear, as every target is made.
  float TargetGamma = 0.0f;
  /// For the shim: what was drawn.
  TArray<FColor> shim_pixels_;
  FTextureRenderTargetResource shim_resource_{this};
};
