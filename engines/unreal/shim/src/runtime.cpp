// Objects, worlds and games of the shim.
#include "Shim/Runtime.h"

#include <algorithm>
#include <cmath>

#include "CollisionQueryParams.h"
#include "Containers/Ticker.h"
#include "Engine/Engine.h"
#include "Engine/HitResult.h"

bool ShimGenerated();  // by generate.py: every subsystem, the address of every node

namespace {
std::vector<UObject*>& Heap() {
  static std::vector<UObject*> heap;
  return heap;
}
std::vector<UGameInstanceSubsystem* (*)()>& SubsystemMakers() {
  static std::vector<UGameInstanceSubsystem* (*)()> makers;
  return makers;
}
UEngine engine;
}  // namespace

UEngine* GEngine = &engine;

UObject::UObject() : shim_token_(std::make_shared<UObject*>(this)) {}
UObject::~UObject() {
  *shim_token_ = nullptr;
}

UClass* UObject::StaticClass() {
  static UClass made("UObject", nullptr);
  return &made;
}

UWorld* UObject::GetWorld() const {
  return shim_outer_ != nullptr ? shim_outer_->GetWorld() : nullptr;
}

FString UObject::GetName() const {
  return FString((Shim::Wide(ShimClass()->ShimName() + 1) + u"_" + Shim::Wide(std::to_string(shim_number_))).c_str());
}

namespace Shim {

std::shared_ptr<UObject*> TokenOf(const UObject* object) {
  return object->ShimToken();
}

void Adopt(UObject* object, UObject* outer) {
  static int count = 0;
  object->shim_outer_ = outer;
  object->shim_number_ = ++count;
  Heap().push_back(object);
}

std::size_t Objects() {
  return Heap().size();
}

void Collect() {
  // Unreal keeps what can be reached; here everything goes that no running world holds.
  const auto keeps = [](const UObject* object) {
    for (; object != nullptr; object = object->ShimOuter()) {
      if (object->ShimDead()) return false;
      if (object->ShimClass()->ShimIsA(UGameInstance::StaticClass())) return true;
    }
    return false;
  };
  const auto gone = std::stable_partition(Heap().begin(), Heap().end(), keeps);
  const std::vector<UObject*> dead(gone, Heap().end());
  Heap().erase(gone, Heap().end());
  for (UObject* object : dead) {
    object->ShimKill();
    object->BeginDestroy();
    check(object->ShimBegunDestroy());
  }
  for (UObject* object : dead) delete object;
}

int AddSubsystem(UGameInstanceSubsystem* (*make)()) {
  SubsystemMakers().push_back(make);
  return 0;
}

void Enter(UWorld& world, AActor& actor, const FVector& location) {
  actor.shim_world_ = &world;
  actor.SetActorLocation(location);
  world.shim_actors_.push_back(&actor);
  if (world.shim_begun_) BeginPlay(actor);
}

void BeginPlay(AActor& actor) {
  if (actor.shim_begun_) return;
  actor.shim_begun_ = true;
  for (std::size_t k = 0; k < actor.shim_components_.size(); ++k) actor.shim_components_[k]->RegisterComponent();
  actor.BeginPlay();
}

static void EndPlay(AActor& actor, EEndPlayReason::Type reason) {
  if (actor.shim_begun_) {
    actor.shim_begun_ = false;
    actor.EndPlay(reason);
    for (UActorComponent* component : actor.shim_components_) {
      if (component->shim_begun_) component->EndPlay(reason);
      component->shim_begun_ = false;
    }
  }
  actor.ShimKill();
  for (UActorComponent* component : actor.shim_components_) component->ShimKill();
}

void Destroy(AActor& actor) {
  if (actor.ShimDead()) return;
  EndPlay(actor, EEndPlayReason::Destroyed);
  std::erase(actor.shim_world_->shim_actors_, &actor);
}

void Destroy(UActorComponent& component) {
  if (component.ShimDead()) return;
  if (component.shim_begun_) component.EndPlay(EEndPlayReason::Destroyed);
  component.shim_begun_ = false;
  component.ShimKill();
  std::erase(component.GetOwner()->shim_components_, &component);
}

Game::Game() : game_(NewObject<UGameInstance>()), world_(NewObject<UWorld>(game_)) {
  check(ShimGenerated());
  FSubsystemCollectionBase collection;
  for (UGameInstanceSubsystem* (*make)() : SubsystemMakers()) {
    UGameInstanceSubsystem* subsystem = make();
    Adopt(subsystem, game_);
    subsystem->shim_game_ = game_;
    game_->shim_subsystems_.push_back(subsystem);
    subsystem->Initialize(collection);
  }
  world_->shim_game_ = game_;
  world_->shim_begun_ = true;
}

Game::~Game() {
  while (!world_->shim_actors_.empty()) {
    AActor* actor = world_->shim_actors_.back();
    world_->shim_actors_.pop_back();
    EndPlay(*actor, EEndPlayReason::EndPlayInEditor);
  }
  for (UGameInstanceSubsystem* subsystem : game_->shim_subsystems_) subsystem->Deinitialize();
  game_->ShimKill();
  Collect();
}

void Game::Tick(float seconds) {
  if (!world_->shim_paused_) world_->shim_seconds_ += static_cast<double>(seconds);
  const std::vector<AActor*> actors = world_->shim_actors_;
  for (const ETickingGroup group : {TG_PrePhysics, TG_PostPhysics}) {
    for (AActor* actor : actors) {
      if (!actor->ShimDead() && actor->PrimaryActorTick.ShimTicks(group, world_->shim_paused_)) actor->Tick(seconds);
      const std::vector<UActorComponent*> components = actor->shim_components_;
      for (UActorComponent* component : components) {
        FActorComponentTickFunction& tick = component->PrimaryComponentTick;
        if (!component->ShimDead() && tick.ShimTicks(group, world_->shim_paused_))
          component->TickComponent(seconds, ShimAllTicks, &tick);
      }
    }
  }
  FTSTicker::GetCoreTicker().ShimTick(seconds);
}

}  // namespace Shim

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
  const AActor* owner = GetOwner();
  if (shim_begun_ || owner == nullptr || !owner->shim_begun_) return;
  shim_begun_ = true;
  BeginPlay();
}

FVector USceneComponent::GetComponentLocation() const {
  const FVector at = GetOwner() != nullptr ? GetOwner()->GetActorLocation() : FVector();
  return FVector(at.X + shim_location_.X, at.Y + shim_location_.Y, at.Z + shim_location_.Z);
}

FVector USceneComponent::GetForwardVector() const {
  const double yaw = 2.0 * std::atan2(shim_rotation_.Z, shim_rotation_.W);
  return FVector(std::cos(yaw), std::sin(yaw), 0.0);
}

FVector USceneComponent::GetRightVector() const {
  const FVector forward = GetForwardVector();
  return FVector(-forward.Y, forward.X, 0.0);
}

bool UWorld::LineTraceSingleByChannel(FHitResult& hit, const FVector& start, const FVector& end, ECollisionChannel,
                                      const FCollisionQueryParams&) const {
  return shim_trace_ && shim_trace_(hit, start, end);
}
