#pragma once
// What the shim has and Unreal has not: games that a test starts, ticks and stops, and the deletion of what is left.

#include <string>
#include <vector>

#include "Engine/GameInstance.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"

namespace Shim {

/// Objects that are alive.
std::size_t Objects();
/// Deletes every object that is not the world's or the game's of a running Game.
void Collect();
/// The latest lines of the log, oldest first; emptied by ForgetLog.
const std::vector<std::string>& Log();
void ForgetLog();

/// "Play" pressed, until the destructor: a game with its subsystems and its world.
class Game {
 public:
  Game();
  ~Game();
  Game(const Game&) = delete;
  Game& operator=(const Game&) = delete;
  /// The world.
  UWorld& world() { return *world_; }
  /// An actor that begins to play.
  template <class T>
  T* Spawn(const FVector& location = FVector()) {
    return world_->SpawnActor<T>(location, FRotator());
  }
  /// An actor whose properties are set before it begins to play.
  template <class T, class Set>
  T* SpawnWith(const Set& set) {
    T* made = NewObject<T>(world_);
    set(*made);
    Enter(*world_, *made, FVector());
    return made;
  }
  /// One frame.
  void Tick(float seconds = 1.0f / 60.0f);
  /// A component on an actor, which begins to play with it or at once.
  template <class T>
  T* AddComponent(AActor& actor) {
    T* made = NewObject<T>(&actor);
    actor.ShimAddSubobject(made);
    if (actor.shim_begun_) made->RegisterComponent();
    return made;
  }

 private:
  UGameInstance* game_;
  UWorld* world_;
};

}  // namespace Shim
