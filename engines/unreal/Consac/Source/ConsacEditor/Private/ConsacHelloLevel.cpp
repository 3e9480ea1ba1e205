// Copyright CONSAC authors. MIT License.
#include "ConsacHelloLevel.h"

#include "Components/DirectionalLightComponent.h"
#include "Components/SkyAtmosphereComponent.h"
#include "Components/SkyLightComponent.h"
#include "Components/StaticMeshComponent.h"
#include "ConsacLane.h"
#include "ConsacLaneCamera.h"
#include "ConsacTrainer.h"
#include "Editor.h"
#include "Editor/EditorEngine.h"
#include "Engine/DirectionalLight.h"
#include "Engine/EngineTypes.h"
#include "Engine/SkyLight.h"
#include "Engine/StaticMesh.h"
#include "Engine/StaticMeshActor.h"
#include "Engine/World.h"
#include "FileHelpers.h"
#include "UObject/UObjectGlobals.h"

namespace ConsacHelloLevel
{

constexpr int32 Lanes = 8;
constexpr double Apart = 200.0;         // lanes, in centimetres
constexpr int64 TrainingSteps = 20000;  // of all walkers together

static void AddLight(UWorld& World)
{
	const FVector Above(0.0, 0.0, 1000.0);
	const FRotator Straight(0.0, 0.0, 0.0);
	ADirectionalLight* Sun = World.SpawnActor<ADirectionalLight>(Above, FRotator(-50.0, 40.0, 0.0));
	Sun->SetActorLabel(TEXT("Sun"));
	if (UDirectionalLightComponent* Rays = Sun->FindComponentByClass<UDirectionalLightComponent>())
	{
		Rays->bAtmosphereSunLight = true;
		Rays->SetMobility(EComponentMobility::Movable); // nothing is to be baked before it is lit
	}
	World.SpawnActor<ASkyAtmosphere>(Above, Straight)->SetActorLabel(TEXT("Sky"));
	ASkyLight* Sky = World.SpawnActor<ASkyLight>(Above, Straight);
	Sky->SetActorLabel(TEXT("Light Of The Sky"));
	if (USkyLightComponent* Glow = Sky->FindComponentByClass<USkyLightComponent>())
	{
		Glow->bRealTimeCapture = true;
		Glow->SetMobility(EComponentMobility::Movable); // which also takes up what was set
	}
}

static void AddFloor(UWorld& World)
{
	const FVector Below(0.0, 0.0, -10.0);
	AStaticMeshActor* Floor = World.SpawnActor<AStaticMeshActor>(Below, FRotator(0.0, 0.0, 0.0));
	Floor->SetActorLabel(TEXT("Floor"));
	if (UStaticMeshComponent* Slab = Floor->FindComponentByClass<UStaticMeshComponent>())
	{
		Slab->SetStaticMesh(LoadObject<UStaticMesh>(nullptr, TEXT("/Engine/BasicShapes/Cube.Cube"))); // of a metre
		Slab->SetRelativeScale3D(FVector(46.0, 20.0, 0.2));
	}
}

static void AddLanes(UWorld& World)
{
	for (int32 Number = 0; Number < Lanes; ++Number)
	{
		const FVector Place(0.0, Apart * (static_cast<double>(Number) - 0.5 * (Lanes - 1)), 0.0);
		AConsacLane* Lane = World.SpawnActor<AConsacLane>(Place, FRotator(0.0, 0.0, 0.0));
		Lane->Seed = Number + 1;
		Lane->SetActorLabel(FString::Printf(TEXT("Lane %d"), Number + 1));
	}
}

static void AddTrainer(UWorld& World)
{
	AConsacTrainer* Trainer = World.SpawnActor<AConsacTrainer>(FVector(0.0, 0.0, 200.0), FRotator(0.0, 0.0, 0.0));
	Trainer->SetActorLabel(TEXT("Trainer"));
	Trainer->Mode = EConsacMode::Train;
	Trainer->TotalSteps = TrainingSteps;
	Trainer->WhileLearning = EConsacWhileLearning::Wait; // a round of learning takes a frame or two, and no step is lost
	Trainer->SaveFolder = TEXT("hello");
}

UWorld* Open(FString& Told)
{
	if (GEditor == nullptr || GEditor->PlayWorld != nullptr)
	{
		Told = TEXT("A game plays: stop it, then make the hello level.");
		return nullptr;
	}
	if (!FEditorFileUtils::SaveDirtyPackages(true, true, true))
	{
		Told = TEXT("The level that was open stays open: saving was cancelled, or failed.");
		return nullptr;
	}
	UWorld* World = UEditorLoadingAndSavingUtils::NewBlankMap(false);
	if (World == nullptr)
	{
		Told = TEXT("The editor made no new level; its log says why.");
		return nullptr;
	}
	AddLight(*World);
	AddFloor(*World);
	AddLanes(*World);
	AddTrainer(*World);
	World->SpawnActor<AConsacLaneCamera>(FVector(0.0, -2300.0, 1500.0), FRotator(-32.0, 90.0, 0.0))->SetActorLabel(TEXT("Camera"));
	World->MarkPackageDirty();
	Told = TEXT("The hello level is open: eight walkers that learn to reach their coins.\n\n1. Press Play. They begin by chance; after some seconds they walk straight to the coins.\n2. The Consac panel (Tools > Consac > Consac Panel) has the curve of their reward.\n3. After 20,000 steps the model is Saved/Consac/hello/default.consac. Import Models in the panel makes it an asset; with Mode Act and that asset in Models the trainer plays it.\n4. To keep the level, save it: File > Save Current Level As.");
	return World;
}

}
