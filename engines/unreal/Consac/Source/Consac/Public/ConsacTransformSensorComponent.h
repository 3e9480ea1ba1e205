// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacSensorComponent.h"
#include "GameFramework/Actor.h"
#include "UObject/ObjectPtr.h"
#include "ConsacTransformSensorComponent.generated.h"

/** Where something is: three numbers, and how it is turned: a quaternion of four. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Transform Sensor"))
class CONSAC_API UConsacTransformSensorComponent : public UConsacSensorComponent
{
	GENERATED_BODY()

public:
	UConsacTransformSensorComponent();

	/** Whose place; none: the owner's own. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	TObjectPtr<AActor> Of;

	/** Seen from the owner instead of from the world's origin: the difference of the two places. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	bool bFromOwner = false;

	/** Centimetres that count as 1. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="0.001"))
	float Scale = 100.0f;

	/** Whether the four numbers of the rotation follow. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	bool bRotation = true;

	virtual FConsacSpace GetSpace() const override;
	virtual void Sense(TArray<float>& Values) override;
};
