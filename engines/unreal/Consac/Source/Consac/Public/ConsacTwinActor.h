// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "GameFramework/Actor.h"
#include "UObject/ObjectPtr.h"
#include "ConsacTwinActor.generated.h"

class UConsacTwinComponent;

/** A robot in a level: an actor with a Consac Twin. */
UCLASS(Blueprintable, ClassGroup=(Consac), meta=(DisplayName="Consac Twin Actor"))
class CONSAC_API AConsacTwinActor : public AActor
{
	GENERATED_BODY()

public:
	AConsacTwinActor();

	/** Its robot. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Twin")
	TObjectPtr<UConsacTwinComponent> Robot;
};
