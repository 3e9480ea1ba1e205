// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Camera/CameraActor.h"
#include "ConsacLaneCamera.generated.h"

/** A camera through which the player looks from the start of play on. */
UCLASS(ClassGroup=(Consac), meta=(DisplayName="Consac Lane Camera"))
class CONSACSAMPLES_API AConsacLaneCamera : public ACameraActor
{
	GENERATED_BODY()

public:
	virtual void BeginPlay() override;
};
