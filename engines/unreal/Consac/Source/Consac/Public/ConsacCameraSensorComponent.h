// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacSensorComponent.h"
#include "UObject/ObjectPtr.h"
#include "ConsacCameraSensorComponent.generated.h"

class USceneCaptureComponent2D;
class UTextureRenderTarget2D;

/** A picture, as whole numbers from 0 to 255. Costly: every picture is read back from the
 *  graphics card, though no picture is drawn but those that are asked for, and all of them before the first is read. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Camera Sensor"))
class CONSAC_API UConsacCameraSensorComponent : public UConsacSensorComponent
{
	GENERATED_BODY()

public:
	UConsacCameraSensorComponent();

	/** Columns of the picture. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="1024"))
	int32 Width = 84;

	/** Rows of the picture. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="1024"))
	int32 Height = 84;

	/** One brightness for each point, instead of red, green and blue. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	bool bGray = true;

	virtual FConsacSpace GetSpace() const override;
	virtual void Prepare() override;
	virtual void Sense(TArray<float>& Values) override;
	virtual void BeginPlay() override;

private:
	UPROPERTY()
	TObjectPtr<USceneCaptureComponent2D> Capture;

	UPROPERTY()
	TObjectPtr<UTextureRenderTarget2D> Target;

	bool bDrawn = false; // and not read yet
};
