#pragma once
#include "Components/SceneComponent.h"
#include "UObject/ObjectPtr.h"

class AActor : public UObject {
  SHIM_CLASS(AActor, UObject)
  virtual void EndPlay(const EEndPlayReason::Type reason) { static_cast<void>(reason); }
  virtual void Tick(float seconds) { static_cast<void>(seconds); }
  UWorld* GetWorld() const override;
  FVector GetActorLocation() const { return shim_location_; }
  FQuat GetActorQuat() const { return shim_rotation_; }
  bool SetActorLocation(const FVector& location) {
    shim_location_ = location;
    return true;
  }
  bool SetRootComponent(USceneComponent* root) {
    RootComponent = root;
    return true;
  }
  /// What the editor's lists call it; in an editor alone.
  void SetActorLabel(const FString& label) { shim_label_ = label; }
  FString GetActorLabel() const { return shim_label_.IsEmpty() ? GetName() : shim_label_; }
  bool ActorHasTag(FName tag) const { return Tags.Contains(tag); }
  TArray<FName> Tags;
  USceneComponent* GetRootComponent() const { return RootComponent; }
  void AddInstanceComponent(UActorComponent* component) { static_cast<void>(component); }
  template <class T>
  T* FindComponentByClass() const {
    for (UActorComponent* component : shim_components_) {
      if (component->ShimClass()->ShimIsA(T::StaticClass())) return static_cast<T*>(component);
    }
    return nullptr;
  }
  template <class T>
  void GetComponents(TArray<T*>& found) const {
    found.Reset();
    for (UActorComponent* component : shim_components_) {
      if (component->ShimClass()->ShimIsA(T::StaticClass())) found.Add(static_cast<T*>(component));
    }
  }
  FActorComponentTickFunction PrimaryActorTick;

  /// For the shim.
  void ShimAddSubobject(UObject* object) override {
    if (object->ShimClass()->ShimIsA(UActorComponent::StaticClass())) {
      shim_components_.push_back(static_cast<UActorComponent*>(object));
    }
  }
  void ShimReferences(Shim::References& references) const override {
    references.Add(shim_components_);
    references.Add(RootComponent);
  }
  UWorld* shim_world_ = nullptr;
  std::vector<UActorComponent*> shim_components_;
  FVector shim_location_ = FVector::ZeroVector;
  FQuat shim_rotation_ = FQuat::Identity;
  FRotator shim_turned_{0.0, 0.0, 0.0};  // as it was spawned
  FString shim_label_;
  bool shim_begun_ = false;
  std::function<void()> shim_event_begin_play_;  // of a Blueprint made from it
  /// Whether a partitioned world unloads it where no player is near.
  bool ShimStreamsByPlace() const { return bIsSpatiallyLoaded; }

 protected:
#if WITH_EDITORONLY_DATA
  uint8 bIsSpatiallyLoaded : 1 = 1;
#endif
  friend void Shim::BeginPlay(AActor&);
  virtual void BeginPlay() {
    if (shim_event_begin_play_) shim_event_begin_play_();
  }
  TObjectPtr<USceneComponent> RootComponent;
};
