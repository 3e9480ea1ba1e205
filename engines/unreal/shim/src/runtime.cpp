// Objects, worlds and games of the shim.
#include "Shim/Runtime.h"

#include <algorithm>
#include <map>
#include <set>

#include "Components/StaticMeshComponent.h"
#include "Containers/Ticker.h"
#include "Editor.h"
#include "Editor/EditorEngine.h"
#include "Engine/Engine.h"
#include "Engine/StaticMesh.h"
#include "GameFramework/PlayerController.h"
#include "GameFramework/WorldSettings.h"
#include "HAL/IConsoleManager.h"
#include "Kismet/BlueprintAsyncActionBase.h"
#include "Misc/App.h"
#include "Misc/CoreDelegates.h"
#include "PhysicsEngine/PhysicsSettings.h"
#include "UObject/ConstructorHelpers.h"
#include "UObject/UObjectIterator.h"

FName MakeUniqueObjectName(UObject* outer, const UClass*, FName name) {
  return Shim::UniqueName(outer, name);
}

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
std::vector<UWorldSubsystem* (*)()>& WorldSubsystemMakers() {
  static std::vector<UWorldSubsystem* (*)()> makers;
  return makers;
}
UEngine engine;
}  // namespace

UEngine* GEngine = &engine;
static UEditorEngine editor;
UEditorEngine* GEditor = &editor;

float UEditorEngine::ShimFrameLimit() {
  constexpr float kUnlessSaid = 120.0f;
  const float said = IConsoleManager::Get().FindConsoleVariable(TEXT("t.MaxFPS"))->GetFloat();
  return said > 0.0f ? said : kUnlessSaid;
}

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
  if (!(shim_name_ == NAME_None)) return shim_name_.ToString();
  return FString((Shim::Wide(ShimClass()->ShimName() + 1) + u"_" + Shim::Wide(std::to_string(shim_number_))).c_str());
}

namespace Shim {

std::vector<UObject*> AllObjects() {
  return Heap();
}

static std::map<const UClass*, Copier>& Copiers() {
  static std::map<const UClass*, Copier> copiers;
  return copiers;
}

int AddCopier(const UClass* cls, Copier copier) {
  Copiers().emplace(cls, copier);
  return 0;
}

/// What of an object is saved, its bases' too.
static void Load(UObject& into, const UObject& saved) {
  for (const auto& [cls, copier] : Copiers())
    if (saved.ShimClass()->ShimIsA(cls)) copier.load(into, saved);
}

/// A copy of an actor as a level keeps it: what is the engine's own is there, and no more of it.
static AActor* CopyOf(const AActor& saved, UWorld& world) {
  const auto copier = Copiers().find(saved.ShimClass());
  UObject* made = copier != Copiers().end() ? copier->second.make(&world) : NewObject<AActor>(&world);
  AActor* actor = static_cast<AActor*>(made);
  Load(*actor, saved);
  actor->shim_turned_ = saved.shim_turned_;
  actor->shim_label_ = saved.shim_label_;
  const std::size_t parts = std::min(actor->shim_components_.size(), saved.shim_components_.size());
  for (std::size_t k = 0; k < parts; ++k) Load(*actor->shim_components_[k], *saved.shim_components_[k]);
  References references;
  actor->ShimReferences(references);
  for (UObject** slot : references.slots())
    for (std::size_t k = 0; k < parts; ++k)
      if (*slot == saved.shim_components_[k]) *slot = actor->shim_components_[k];
  return actor;
}

std::shared_ptr<UObject*> TokenOf(const UObject* object) {
  return object->ShimToken();
}

void Adopt(UObject* object, UObject* outer) {
  static int count = 0;
  object->shim_outer_ = outer;
  object->shim_number_ = ++count;
  Heap().push_back(object);
}

UObject* Find(const UObject* outer, FName name) {
  for (UObject* object : Heap())
    if (object->ShimOuter() == outer && object->ShimName() == name && !object->ShimDead()) return object;
  return nullptr;
}

FName UniqueName(const UObject* outer, FName name) {
  const auto taken = [&](FName wanted) {
    return std::any_of(Heap().begin(), Heap().end(), [&](const UObject* object) {
      return object->ShimOuter() == outer && object->ShimName() == wanted;
    });
  };
  FName unique = name;
  for (int number = 0; unique == NAME_None || taken(unique); ++number)
    unique = FName(*FString((std::u16string(*name.ToString()) + u"_" + Wide(std::to_string(number))).c_str()));
  return unique;
}

std::size_t Objects() {
  return Heap().size();
}

namespace {

std::vector<UGameInstance*>& Games() {
  static std::vector<UGameInstance*> games;
  return games;
}
std::vector<const Held*>& AllHeld() {
  static std::vector<const Held*> held;
  return held;
}
std::vector<void (*)()>& Reflected() {
  static std::vector<void (*)()> classes;
  return classes;
}

/// What is alive, and the members that hold something that is not.
class Marks {
 public:
  void Mark(UObject* object) {
    if (object == nullptr || Dead(object) || !marked_.insert(object).second) return;
    todo_.push_back(object);
    while (!todo_.empty()) {
      const UObject* next = todo_.back();
      todo_.pop_back();
      References references;
      next->ShimReferences(references);
      Reach(next->ShimOuter());
      for (UObject* found : next->ShimSubobjects()) Reach(found);
      for (UObject* found : references.found()) Reach(found);
      for (UObject** slot : references.slots()) {
        Reach(*slot);
        if (*slot != nullptr && Dead(*slot)) *slot = nullptr;
      }
    }
  }
  bool Has(const UObject* object) const { return marked_.contains(object); }

 private:
  static bool Dead(const UObject* object) {
    for (; object != nullptr; object = object->ShimOuter())
      if (object->ShimDead()) return true;
    return false;
  }
  void Reach(UObject* object) {
    if (object != nullptr && !Dead(object) && marked_.insert(object).second) todo_.push_back(object);
  }
  std::set<const UObject*> marked_;
  std::vector<const UObject*> todo_;
};

}  // namespace

Held::Held() {
  AllHeld().push_back(this);
}
Held::~Held() {
  std::erase(AllHeld(), this);
}

UObject* Packed(const TCHAR* path, UObject* (*make)()) {
  static std::map<std::u16string, std::unique_ptr<UObject>> packed;
  std::unique_ptr<UObject>& thing = packed[path];
  if (thing == nullptr) {
    thing.reset(make());
    std::erase(Heap(), thing.get());
  }
  return thing.get();
}

void Collect() {
  Marks marks;
  for (UGameInstance* game : Games()) {
    std::erase_if(game->shim_registered_, [](const UObject* action) {
      return static_cast<const UBlueprintAsyncActionBase*>(action)->shim_ready_;
    });
    marks.Mark(game);
  }
  for (const Held* held : AllHeld()) marks.Mark(held->object());
  const auto gone =
      std::stable_partition(Heap().begin(), Heap().end(), [&](UObject* object) { return marks.Has(object); });
  const std::vector<UObject*> dead(gone, Heap().end());
  Heap().erase(gone, Heap().end());
  for (UObject* object : dead) {
    object->ShimKill();
    object->BeginDestroy();
    check(object->ShimBegunDestroy());
  }
  for (UObject* object : dead) delete object;
}

int AddReflected(void (*make_and_destroy)()) {
  Reflected().push_back(make_and_destroy);
  return 0;
}

int HotReload() {
  check(ShimGenerated());
  for (void (*make_and_destroy)() : Reflected()) make_and_destroy();
  return static_cast<int>(Reflected().size());
}

int AddSubsystem(UGameInstanceSubsystem* (*make)()) {
  SubsystemMakers().push_back(make);
  return 0;
}
int AddSubsystem(UWorldSubsystem* (*make)()) {
  WorldSubsystemMakers().push_back(make);
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

static void EndPlaying(AActor& actor, EEndPlayReason::Type reason) {
  if (!actor.shim_begun_) return;
  actor.shim_begun_ = false;
  actor.EndPlay(reason);
  const std::vector<UActorComponent*> components = actor.shim_components_;
  for (UActorComponent* component : components) {
    if (component->shim_begun_) component->EndPlay(reason);
    component->shim_begun_ = false;
  }
}

static void EndPlay(AActor& actor, EEndPlayReason::Type reason) {
  EndPlaying(actor, reason);
  actor.ShimKill();
  for (UActorComponent* component : actor.shim_components_) component->ShimKill();
}

void Destroy(AActor& actor) {
  if (actor.ShimDead()) return;
  EndPlay(actor, EEndPlayReason::Destroyed);
  std::erase(actor.shim_world_->shim_actors_, &actor);
}

void StreamOut(AActor& actor) {
  EndPlay(actor, EEndPlayReason::RemovedFromWorld);
  std::erase(actor.shim_world_->shim_actors_, &actor);
}

void Hide(AActor& actor) {
  EndPlaying(actor, EEndPlayReason::RemovedFromWorld);
}

void Destroy(UActorComponent& component) {
  if (component.ShimDead()) return;
  if (component.shim_begun_) component.EndPlay(EEndPlayReason::Destroyed);
  component.shim_begun_ = false;
  component.ShimKill();
  std::erase(component.GetOwner()->shim_components_, &component);
}

static void EndWorld(UWorld& world, EEndPlayReason::Type reason) {
  while (!world.shim_actors_.empty()) {
    AActor* actor = world.shim_actors_.back();
    world.shim_actors_.pop_back();
    EndPlay(*actor, reason);
  }
  for (UWorldSubsystem* subsystem : world.shim_subsystems_) subsystem->Deinitialize();
  world.ShimKill();
}

Game::Game(ENetMode mode)
    : game_(NewObject<UGameInstance>()), mode_(mode), physics_seconds_(UPhysicsSettings::Get()->MaxPhysicsDeltaTime) {
  check(ShimGenerated());
  Games().push_back(game_);
  FSubsystemCollectionBase collection;
  for (UGameInstanceSubsystem* (*make)() : SubsystemMakers()) {
    UGameInstanceSubsystem* subsystem = make();
    Adopt(subsystem, game_);
    subsystem->shim_game_ = game_;
    game_->shim_subsystems_.push_back(subsystem);
    subsystem->Initialize(collection);
  }
  OpenWorld();
}

Game::Game(const UWorld& level) : Game(NM_Standalone) {
  check(level.WorldType == EWorldType::Editor && GEditor->PlayWorld == nullptr);
  GEditor->PlayWorld = world_;
  world_->WorldType = EWorldType::PIE;
  world_->shim_player_ = NewObject<APlayerController>(world_);
  world_->shim_begun_ = false;
  for (const AActor* saved : level.shim_actors_) Enter(*world_, *CopyOf(*saved, *world_), saved->GetActorLocation());
  world_->shim_begun_ = true;
  const std::vector<AActor*> actors = world_->shim_actors_;
  for (AActor* actor : actors) BeginPlay(*actor);
}

UWorld& Game::OpenWorld() {
  world_ = NewObject<UWorld>(game_);
  world_->WorldType = EWorldType::Game;
  world_->shim_game_ = game_;
  world_->shim_net_mode_ = mode_;
  game_->shim_worlds_.push_back(world_);
  world_->shim_settings_ = NewObject<AWorldSettings>(world_);
  FSubsystemCollectionBase collection;
  for (UWorldSubsystem* (*make)() : WorldSubsystemMakers()) {
    UWorldSubsystem* subsystem = make();
    Adopt(subsystem, world_);
    check(subsystem->ShimSupports(EWorldType::Game) && !subsystem->ShimSupports(EWorldType::Editor));
    world_->shim_subsystems_.push_back(subsystem);
    subsystem->Initialize(collection);
  }
  world_->shim_begun_ = true;
  return *world_;
}

void Game::CloseWorld(UWorld& world) {
  const std::shared_ptr<UObject*> token = world.ShimToken();
  EndWorld(world, EEndPlayReason::LevelTransition);
  std::erase(game_->shim_worlds_, &world);
  Collect();
  check(*token == nullptr);
}

void Game::Travel() {
  UWorld& before = *world_;
  world_ = nullptr;
  CloseWorld(before);
  OpenWorld();
}

Game::~Game() {
  const std::vector<UWorld*> worlds = game_->shim_worlds_;
  for (UWorld* world : worlds)
    if (GEditor->PlayWorld == world) GEditor->PlayWorld = nullptr;
  for (UWorld* world : worlds) EndWorld(*world, EEndPlayReason::EndPlayInEditor);
  for (UGameInstanceSubsystem* subsystem : game_->shim_subsystems_) subsystem->Deinitialize();
  game_->ShimKill();
  std::erase(Games(), game_);
  Collect();
}

static void TickWorld(UWorld& world, float seconds) {
  const AWorldSettings& settings = *world.GetWorldSettings();
  if (FApp::UseFixedTimeStep()) seconds = static_cast<float>(FApp::GetFixedDeltaTime());
  seconds = std::clamp(seconds, settings.MinUndilatedFrameTime, settings.MaxUndilatedFrameTime);
  FWorldDelegates::OnWorldTickStart.Broadcast(&world, ShimAllTicks, seconds);
  if (!world.shim_paused_) world.shim_seconds_ += static_cast<double>(seconds);
  const std::vector<AActor*> actors = world.shim_actors_;
  for (const ETickingGroup group : {TG_PrePhysics, TG_PostPhysics}) {
    for (AActor* actor : actors) {
      const bool there = !actor->ShimDead() && actor->shim_begun_;
      if (there && actor->PrimaryActorTick.ShimTicks(group, world.shim_paused_)) actor->Tick(seconds);
      const std::vector<UActorComponent*> components = actor->shim_components_;
      for (UActorComponent* component : components) {
        FActorComponentTickFunction& tick = component->PrimaryComponentTick;
        if (!component->ShimDead() && tick.ShimTicks(group, world.shim_paused_))
          component->TickComponent(seconds, ShimAllTicks, &tick);
      }
    }
  }
  FWorldDelegates::OnWorldPostActorTick.Broadcast(&world, ShimAllTicks, seconds);
}

void Game::Tick(float seconds) {
  const std::vector<UWorld*> worlds = game_->shim_worlds_;
  for (UWorld* world : worlds) TickWorld(*world, seconds);
  FTSTicker::GetCoreTicker().ShimTick(seconds);
  FCoreDelegates::OnEndFrame.Broadcast();
  // The settings' default object is a file of the project: nobody changes it while a game runs.
  check(UPhysicsSettings::Get()->MaxPhysicsDeltaTime == physics_seconds_);
}

}  // namespace Shim

UWorld* UWorldSubsystem::GetWorld() const {
  return static_cast<UWorld*>(ShimOuter());
}

void UBlueprintAsyncActionBase::RegisterWithGameInstance(const UObject* context) {
  check(context != nullptr);
  const UWorld* world = context->GetWorld();
  if (world != nullptr) world->GetGameInstance()->shim_registered_.push_back(this);
}
