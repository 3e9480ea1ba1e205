// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"

class UWorld;

/** A level that learns: eight walkers on roads, their trainer, a camera, a floor and light. */
namespace ConsacHelloLevel
{

/** Opens it in the editor, without a name, once the person has been asked about unsaved work. Null where that said Cancel, or a game plays.
 *  @param Told What to do next, or why there is none. */
UWorld* Open(FString& Told);

}
