#pragma once
#include "RHICommandList.h"

class FTextureRenderTargetResource {
 public:
  explicit FTextureRenderTargetResource(UTextureRenderTarget2D* shim_target) : shim_texture_(shim_target) {}
  FRHITexture* GetRenderTargetTexture() { return &shim_texture_; }

 private:
  FRHITexture shim_texture_;
};
