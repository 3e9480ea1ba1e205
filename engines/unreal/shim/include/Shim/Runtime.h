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
/// Deletes every object that no running game, its worlds and their actors reach by reflected members, and that is not
/// Held.
void Collect();
/// What a variable of a graph does: keeps its object alive for as long as it lives itself.
class Held {
 public:
  Held();
  ~Held();
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  void Hold(UObject* object) { object_ = object; }
  UObject* object() const { return object_; }

 private:
  UObject* object_ = nullptr;
};
/// Every reflected class of the plugin once, as Hot Reload makes it, and destroyed again; how many there are.
int HotReload();
/// Keeps a class for HotReload.
int AddReflected(void (*make_and_destroy)());
/// How an object of a reflected class is made, and takes over what of another one is saved.
struct Copier {
  UObject* (*make)(UObject* outer);
  void (*load)(UObject& into, const UObject& saved);
};
int AddCopier(const UClass* cls, Copier copier);
/// The latest lines of the log, oldest first; emptied by ForgetLog.
const std::vector<std::string>& Log();
/// Those of them that hold `part`.
std::vector<std::string> LogLines(const std::string& part);
void ForgetLog();

/// "Play" pressed, until the destructor: a game with its subsystems and its world. Several may run in one process. The
/// default objects of the project's settings must stay as they are meanwhile.
class Game {
 public:
  explicit Game(ENetMode mode = NM_Standalone);
  /// Play In Editor: a copy of a level that is open there, in which all of its actors begin to play.
  explicit Game(const UWorld& level);
  ~Game();
  Game(const Game&) = delete;
  Game& operator=(const Game&) = delete;
  /// The world.
  UWorld& world() { return *world_; }
  /// An actor that begins to play.
  template <class T>
  T* Spawn(const FVector& location = FVector::ZeroVector) {
    return world_->SpawnActor<T>(location, FRotator(0.0, 0.0, 0.0));
  }
  /// An actor whose properties are set before it begins to play.
  template <class T, class Set>
  T* SpawnWith(const Set& set) {
    T* made = NewObject<T>(world_);
    set(*made);
    Enter(*world_, *made, FVector::ZeroVector);
    return made;
  }
  /// Another world beside it, which is the one from now on; the one of before goes on until CloseWorld.
  UWorld& OpenWorld();
  /// A world's end. Whoever still keeps a part of it alive ends the test, as Unreal ends the game.
  void CloseWorld(UWorld& world);
  /// To another level: the world ends, then the next begins.
  void Travel();
  /// One frame of every world.
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
  UWorld* world_ = nullptr;
  ENetMode mode_;
  float physics_seconds_;
};

}  // namespace Shim
