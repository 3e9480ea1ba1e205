// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "GameFramework/GameModeBase.h"
#include "ConsacSampleGameMode.generated.h"

/** Puts a sample into any map: the road, or with -ConsacSample=chase on the command line the chase. */
UCLASS(ClassGroup=(Consac), meta=(DisplayName="Consac Sample Game Mode"))
class CONSACSAMPLES_API AConsacSampleGameMode : public AGameModeBase
{
	GENERATED_BODY()

public:
	virtual void BeginPlay() override;
};
