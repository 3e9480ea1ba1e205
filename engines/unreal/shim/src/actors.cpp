// Actors and components of the shim: where they are, to whom they belong.
#include <algorithm>
#include <cmath>

#include "CollisionQueryParams.h"
#include "CollisionShape.h"
#include "Engine/HitResult.h"
#include "Engine/OverlapResult.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"
#include "Shim/Play.h"

UWorld* AActor::GetWorld() const {
  return shim_world_;
}

AActor* UActorComponent::GetOwner() const {
  UObject* outer = ShimOuter();
  while (outer != nullptr && !outer->ShimClass()->ShimIsA(AActor::StaticClass())) outer = outer->ShimOuter();
  return static_cast<AActor*>(outer);
}

UWorld* UActorComponent::GetWorld() const {
  return GetOwner() != nullptr ? GetOwner()->GetWorld() : nullptr;
}

void UActorComponent::RegisterComponent() {
  AActor* owner = GetOwner();
  if (owner == nullptr) return;
  std::vector<UActorComponent*>& all = owner->shim_components_;
  if (std::find(all.begin(), all.end(), this) == all.end()) all.push_back(this);
  if (shim_begun_ || !owner->shim_begun_) return;
  shim_begun_ = true;
  BeginPlay();
}

void UActorComponent::DestroyComponent(bool) {
  Shim::Destroy(*this);
}

FVector USceneComponent::GetComponentLocation() const {
  const FVector at = GetOwner() != nullptr ? GetOwner()->GetActorLocation() : FVector::ZeroVector;
  return FVector(at.X + shim_location_.X, at.Y + shim_location_.Y, at.Z + shim_location_.Z);
}

FTransform USceneComponent::GetComponentTransform() const {
  FVector p = shim_location_;
  FQuat q = shim_rotation_;
  for (const USceneComponent* at = shim_parent_; at != nullptr; at = at->shim_parent_) {
    const FQuat& t = at->shim_rotation_;
    // t * p * inverse(t), as everybody turns a vector.
    const FVector u(t.Y * p.Z - t.Z * p.Y + t.W * p.X, t.Z * p.X - t.X * p.Z + t.W * p.Y,
                    t.X * p.Y - t.Y * p.X + t.W * p.Z);
    p = FVector(at->shim_location_.X + p.X + 2.0 * (t.Y * u.Z - t.Z * u.Y),
                at->shim_location_.Y + p.Y + 2.0 * (t.Z * u.X - t.X * u.Z),
                at->shim_location_.Z + p.Z + 2.0 * (t.X * u.Y - t.Y * u.X));
    q = FQuat(t.W * q.X + t.X * q.W + t.Y * q.Z - t.Z * q.Y, t.W * q.Y - t.X * q.Z + t.Y * q.W + t.Z * q.X,
              t.W * q.Z + t.X * q.Y - t.Y * q.X + t.Z * q.W, t.W * q.W - t.X * q.X - t.Y * q.Y - t.Z * q.Z);
  }
  FTransform made;
  made.SetLocation(p);
  made.SetRotation(q);
  return made;
}

FVector USceneComponent::GetForwardVector() const {
  const double yaw = 2.0 * std::atan2(shim_rotation_.Z, shim_rotation_.W);
  return FVector(std::cos(yaw), std::sin(yaw), 0.0);
}

FVector USceneComponent::GetRightVector() const {
  const FVector forward = GetForwardVector();
  return FVector(-forward.Y, forward.X, 0.0);
}

bool UWorld::OverlapMultiByChannel(TArray<FOverlapResult>& found, const FVector& place, const FQuat&,
                                   ECollisionChannel channel, const FCollisionShape& shape,
                                   const FCollisionQueryParams& parameters) const {
  found.Reset();
  const std::vector<ECollisionChannel>& blocked = Shim::blocked_channels;
  if (std::find(blocked.begin(), blocked.end(), channel) == blocked.end()) return false;
  for (AActor* actor : shim_actors_) {
    const FVector at = actor->GetActorLocation(), half = shape.shim_half_;
    const bool within =
        std::abs(at.X - place.X) < half.X && std::abs(at.Y - place.Y) < half.Y && std::abs(at.Z - place.Z) < half.Z;
    if (within && actor != parameters.ShimIgnored()) {
      FOverlapResult one;
      one.shim_actor_ = actor;
      found.Add(one);
    }
  }
  return !found.IsEmpty();
}

bool UWorld::LineTraceSingleByChannel(FHitResult& hit, const FVector& start, const FVector& end,
                                      ECollisionChannel channel, const FCollisionQueryParams&) const {
  const std::vector<ECollisionChannel>& blocked = Shim::blocked_channels;
  return std::find(blocked.begin(), blocked.end(), channel) != blocked.end() && shim_trace_ &&
         shim_trace_(hit, start, end);
}
