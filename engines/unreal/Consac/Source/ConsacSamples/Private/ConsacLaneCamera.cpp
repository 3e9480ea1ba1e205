// Copyright CONSAC authors. MIT License.
#include "ConsacLaneCamera.h"

#include "Engine/World.h"
#include "GameFramework/PlayerController.h"
#include "UObject/UObjectGlobals.h"

void AConsacLaneCamera::BeginPlay()
{
	Super::BeginPlay();
	APlayerController* Player = GetWorld()->GetFirstPlayerController();
	if (IsValid(Player)) // a dedicated server has none
	{
		Player->SetViewTarget(this);
	}
}
