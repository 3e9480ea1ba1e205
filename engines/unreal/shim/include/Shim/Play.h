#pragma once
// What an actor goes through.

#include "CoreMinimal.h"

class AActor;
class UActorComponent;
class UWorld;

namespace Shim {
/// It is in the world; begins to play if the world does.
void Enter(UWorld& world, AActor& actor, const FVector& location);
/// One after another: components, then the actor. Twice does nothing.
void BeginPlay(AActor& actor);
/// It leaves the world and is dead; its memory stays until Collect.
void Destroy(AActor& actor);
/// Its level is streamed out: it ends to play and belongs to nobody; its memory stays until Collect.
void StreamOut(AActor& actor);
/// Destroys one of its components.
void Destroy(UActorComponent& component);
/// Its level is hidden: it ends to play, and begins again with BeginPlay when the level is shown.
void Hide(AActor& actor);
}  // namespace Shim

namespace EEndPlayReason {
enum Type { Destroyed, LevelTransition, EndPlayInEditor, RemovedFromWorld };
}
