// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacSensorComponent.h"
#include "Containers/EnumAsByte.h"
#include "Engine/EngineTypes.h"
#include "ConsacRaySensorComponent.generated.h"

/** How far it is to the next thing, in several directions: 0 here, 1 nothing within the length of a ray; and what it is, by its tags. For each
 *  channel, fan and ray in this order: the distance, then a number for each tag. */
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

	/** How many such fans, one above the other. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="64"))
	int32 Fans = 1;

	/** Angle between the lowest fan and the highest, in degrees, around the horizontal of the component. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="0", ClampMax="180"))
	float FanSpreadDegrees = 60.0f;

	/** Length of a ray, in centimetres. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1"))
	float Length = 1000.0f;

	/** What a ray ends at: whatever blocks this channel. Pawn, what a character would run into: walls, things and other characters.
	 *  Visibility goes through characters, unless their collision was changed. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	TEnumAsByte<ECollisionChannel> Channel = ECC_Pawn;

	/** Layers more: all rays once again for each of these channels. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	TArray<TEnumAsByte<ECollisionChannel>> MoreChannels;

	/** For each of these a number more for each ray: 1 where what it ends at is an actor with this tag, otherwise 0. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	TArray<FName> DetectableTags;

	/** Draws the rays, red where they end at something: to look at, and left out of Shipping builds. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	bool bDraw = false;

	virtual FConsacSpace GetSpace() const override;
	virtual void Sense(TArray<float>& Values) override;

private:
	void CastRay(const FVector& Start, const FVector& End, ECollisionChannel Through, TArray<float>& Values) const;
};
