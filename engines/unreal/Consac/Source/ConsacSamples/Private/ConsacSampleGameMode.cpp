// Copyright CONSAC authors. MIT License.
#include "ConsacSampleGameMode.h"

#include "ConsacChase.h"
#include "ConsacRoad.h"
#include "ConsacTrainer.h"
#include "ConsacYumiReach.h"
#include "Engine/World.h"
#include "Misc/CommandLine.h"
#include "Misc/Parse.h"

void AConsacSampleGameMode::BeginPlay()
{
	Super::BeginPlay();
	FString Sample;
	FParse::Value(FCommandLine::Get(), TEXT("ConsacSample="), Sample);
	const FVector Origin(0.0, 0.0, 0.0);
	const FRotator Straight(0.0, 0.0, 0.0);
	if (Sample == FString(TEXT("chase")))
	{
		GetWorld()->SpawnActor<AConsacChase>(Origin, Straight);
	}
	else if (Sample == FString(TEXT("yumi")))
	{
		GetWorld()->SpawnActor<AConsacYumiReach>(Origin, Straight);
		GetWorld()->SpawnActor<AConsacTrainer>(Origin, Straight);
	}
	else
	{
		GetWorld()->SpawnActor<AConsacRoad>(Origin, Straight);
	}
}
