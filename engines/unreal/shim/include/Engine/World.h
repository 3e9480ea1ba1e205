#pragma once
#include "Containers/EnumAsByte.h"
#include "Engine/EngineBaseTypes.h"
#include "Engine/EngineTypes.h"
#include "Shim/Play.h"
#include "Subsystems/WorldSubsystem.h"
#include "UObject/ObjectPtr.h"
#include "UObject/UObjectGlobals.h"

class AActor;
class APlayerController;
class AWorldSettings;
class UGameInstance;
struct FCollisionQueryParams;
struct FCollisionShape;
struct FOverlapResult;
struct FHitResult;

/// The world of a running game.
class UWorld : public UObject {
  SHIM_CLASS(UWorld, UObject)
  UGameInstance* GetGameInstance() const { return shim_game_; }
  template <class T>
  T* GetSubsystem() const {
    for (UWorldSubsystem* subsystem : shim_subsystems_) {
      if (subsystem->ShimClass()->ShimIsA(T::StaticClass())) return static_cast<T*>(subsystem);
    }
    return nullptr;
  }
  ENetMode GetNetMode() const { return shim_net_mode_; }
  AWorldSettings* GetWorldSettings() const { return shim_settings_; }
  APlayerController* GetFirstPlayerController() const { return shim_player_; }
  TEnumAsByte<EWorldType::Type> WorldType = EWorldType::None;
  double GetTimeSeconds() const { return shim_seconds_; }
  bool IsPaused() const { return shim_paused_; }
  bool LineTraceSingleByChannel(FHitResult& hit, const FVector& start, const FVector& end, ECollisionChannel channel,
                                const FCollisionQueryParams& parameters) const;
  /// Actors of the world are points here, in boxes that are not turned.
  bool OverlapMultiByChannel(TArray<FOverlapResult>& found, const FVector& place, const FQuat& turned,
                             ECollisionChannel channel, const FCollisionShape& shape,
                             const FCollisionQueryParams& parameters) const;
  template <class T>
  T* SpawnActor(const FVector& location, const FRotator& rotation) {
    T* made = NewObject<T>(this);
    made->shim_turned_ = rotation;
    Shim::Enter(*this, *made, location);
    return made;
  }
  void ShimReferences(Shim::References& references) const override {
    references.Add(shim_subsystems_);
    references.Add(shim_actors_);
    references.Add(shim_settings_);
    references.Add(shim_player_);
  }
  UWorld* GetWorld() const override { return const_cast<UWorld*>(this); }

  /// For the shim and tests.
  UGameInstance* shim_game_ = nullptr;
  TObjectPtr<AWorldSettings> shim_settings_;
  TObjectPtr<APlayerController> shim_player_;  // of those that play in the editor
  double shim_seconds_ = 0.0;
  std::vector<UWorldSubsystem*> shim_subsystems_;
  ENetMode shim_net_mode_ = NM_Standalone;
  bool shim_begun_ = false;
  bool shim_paused_ = false;
  std::vector<AActor*> shim_actors_;
  std::function<bool(FHitResult&, const FVector&, const FVector&)> shim_trace_;
};

class FWorldDelegates {
 public:
  static inline TMulticastDelegate<void(UWorld*, ELevelTick, float)> OnWorldTickStart;
  static inline TMulticastDelegate<void(UWorld*, ELevelTick, float)> OnWorldPostActorTick;
};
