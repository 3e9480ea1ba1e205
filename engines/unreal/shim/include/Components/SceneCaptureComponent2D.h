#pragma once
#include <string>

#include "Components/SceneComponent.h"
#include "UObject/ObjectPtr.h"

class UTextureRenderTarget2D;

enum ESceneCaptureSource { SCS_FinalColorLDR };

class USceneCaptureComponent2D : public USceneComponent {
  SHIM_CLASS(USceneCaptureComponent2D, USceneComponent)
  void CaptureScene();
  TObjectPtr<UTextureRenderTarget2D> TextureTarget;
  bool bCaptureEveryFrame = true;
  bool bCaptureOnMovement = true;
  bool bAlwaysPersistRenderingState = false;
  /// For tests: what was asked of the graphics card, in order; C a capture, R a picture read back, W a wait for all
  /// that was asked for.
  static inline std::string shim_asked_;
  ESceneCaptureSource CaptureSource = SCS_FinalColorLDR;
};
