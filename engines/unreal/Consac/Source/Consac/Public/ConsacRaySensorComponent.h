// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacSensorComponent.h"
#include "Containers/EnumAsByte.h"
#include "Engine/EngineTypes.h"
#include "ConsacRaySensorComponent.generated.h"

/** How far it is to the next thing, in several directions: 0 here, 1 nothing within the length of a ray. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Ray Sensor"))
class CONSAC_API UConsacRaySensorComponent : public UConsacSensorComponent
{
	GENERATED_BODY()

public:
	UConsacRaySensorComponent();

	/** How many rays, spread evenly around the component's forward direction. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="1024"))
	int32 Rays = 8;

	/** Angle between the first ray and the last, in degrees; 360: all around. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="0", ClampMax="360"))
	float SpreadDegrees = 360.0f;

	/** Length of a ray, in centimetres. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1"))
	float Length = 1000.0f;

	/** What a ray ends at: whatever blocks this channel. Pawn, what a character would run into: walls, things and other characters.
	 *  Visibility goes through characters, unless their collision was changed. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	TEnumAsByte<ECollisionChannel> Channel = ECC_Pawn;

	virtual FConsacSpace GetSpace() const override;
	virtual void Sense(TArray<float>& Values) override;
};
