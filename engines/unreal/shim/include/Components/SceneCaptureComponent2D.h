#pragma once
#include "Components/SceneComponent.h"
#include "UObject/ObjectPtr.h"

class UTextureRenderTarget2D;

enum ESceneCaptureSource { SCS_FinalColorLDR };

class USceneCaptureComponent2D : public USceneComponent {
  SHIM_CLASS(USceneCaptureComponent2D, USceneComponent)
  void CaptureScene();
  TObjectPtr<UTextureRenderTarget2D> TextureTarget;
  bool bCaptureEveryFrame = true;
  ESceneCaptureSource CaptureSource = SCS_FinalColorLDR;
};
