// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacSensorComponent.h"
#include "UObject/ObjectPtr.h"
#include "ConsacCameraSensorComponent.generated.h"

class USceneCaptureComponent2D;
class UTextureRenderTarget2D;

/** A picture as on a screen, as whole numbers from 0 to 255; the exposure is the project's, found over several pictures where it
 *  is automatic. Costly: it is read back from the graphics card. No picture is drawn but those that are asked for, and the game
 *  waits for the card once for all cameras of a decision. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Camera Sensor"))
class CONSAC_API UConsacCameraSensorComponent : public UConsacSensorComponent
{
	GENERATED_BODY()

public:
	UConsacCameraSensorComponent();

	/** Columns of the picture. Until the training begins it may be changed, in play too. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="1024"))
	int32 Width = 84;

	/** Rows of the picture; likewise. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="1024"))
	int32 Height = 84;

	/** One brightness for each point, instead of red, green and blue. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	bool bGray = true;

	virtual FConsacSpace GetSpace() const override;
	virtual FString GetFault() const override;
	virtual void Prepare() override;
	virtual void Sense(TArray<float>& Values) override;
	virtual void BeginPlay() override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;

private:
	UPROPERTY(Transient, DuplicateTransient)
	TObjectPtr<USceneCaptureComponent2D> Capture;

	UPROPERTY(Transient, DuplicateTransient)
	TObjectPtr<UTextureRenderTarget2D> Target;

	void FitTarget();
	static void ReadAll();

	TArray<FColor> Colours; // as read last
	bool bDrawn = false;    // and not read yet
	bool bRead = false;     // and not sensed yet
};
