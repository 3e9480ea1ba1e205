#pragma once
#include "Engine/TextureRenderTarget2D.h"
#include "Kismet/BlueprintFunctionLibrary.h"

class UKismetRenderingLibrary : public UBlueprintFunctionLibrary {
  SHIM_CLASS(UKismetRenderingLibrary, UBlueprintFunctionLibrary)
  static UTextureRenderTarget2D* CreateRenderTarget2D(UObject* context, int32 width, int32 height,
                                                      ETextureRenderTargetFormat format);
};
