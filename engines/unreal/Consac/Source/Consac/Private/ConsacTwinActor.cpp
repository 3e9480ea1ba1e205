// Copyright CONSAC authors. MIT License.
#include "ConsacTwinActor.h"

#include "ConsacTwinComponent.h"

AConsacTwinActor::AConsacTwinActor()
{
	Robot = CreateDefaultSubobject<UConsacTwinComponent>(TEXT("Robot"));
	SetRootComponent(Robot);
}
