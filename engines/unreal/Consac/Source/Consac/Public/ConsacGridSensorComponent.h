// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacSensorComponent.h"
#include "Containers/EnumAsByte.h"
#include "Engine/EngineTypes.h"
#include "ConsacGridSensorComponent.generated.h"

/** What is in the cells of a grid around the component, seen from above and turned with it: a picture of Rows, Columns and channels, for
 *  networks that see pictures. A row is further ahead the lower its number; columns go from left to right. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Grid Sensor"))
class CONSAC_API UConsacGridSensorComponent : public UConsacSensorComponent
{
	GENERATED_BODY()

public:
	UConsacGridSensorComponent();

	/** Cells from front to back. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="256"))
	int32 Rows = 11;

	/** Cells from left to right. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="256"))
	int32 Columns = 11;

	/** Length of a cell's sides, in centimetres. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1"))
	float CellSize = 100.0f;

	/** Height of a cell, in centimetres. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1"))
	float CellHeight = 100.0f;

	/** What is seen: whatever blocks or overlaps this channel. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	TEnumAsByte<ECollisionChannel> Channel = ECC_Pawn;

	/** A channel of the picture each: 1 where the cell has an actor with this tag. None: one channel, 1 where there is anything. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	TArray<FName> DetectableTags;

	virtual FConsacSpace GetSpace() const override;
	virtual void Sense(TArray<float>& Values) override;
};
