// Copyright CONSAC authors. MIT License.
#include "ConsacRoad.h"

#include <algorithm>
#include <cstdlib>

#include "Components/SceneComponent.h"
#include "Components/StaticMeshComponent.h"
#include "ConsacBlueprintLibrary.h"
#include "ConsacEnvironmentComponent.h"
#include "ConsacModel.h"
#include "ConsacSampleLog.h"
#include "Engine/StaticMesh.h"
#include "Logging/LogMacros.h"
#include "UObject/ConstructorHelpers.h"

namespace ConsacRoadRules
{
constexpr int32 Last = 40;       // places are 0 to 40
constexpr int32 Start = 10;      // of the first episode
constexpr int32 CoinMoves = 50;  // steps after which the coin moves by itself
}

AConsacRoad::AConsacRoad()
{
	PrimaryActorTick.bCanEverTick = true;
	Environment = CreateDefaultSubobject<UConsacEnvironmentComponent>(TEXT("Environment"));
	Root = CreateDefaultSubobject<USceneComponent>(TEXT("Root"));
	WalkerMesh = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Walker"));
	CoinMesh = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Coin"));
	SetRootComponent(Root);
	WalkerMesh->SetupAttachment(Root);
	CoinMesh->SetupAttachment(Root);
	// Found here, so that they are packed with the game.
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Cube(TEXT("/Engine/BasicShapes/Cube.Cube"));
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Sphere(TEXT("/Engine/BasicShapes/Sphere.Sphere"));
	WalkerMesh->SetStaticMesh(Cube.Object);
	CoinMesh->SetStaticMesh(Sphere.Object);
	CoinMesh->SetRelativeScale3D(FVector(0.5, 0.5, 0.5));
}

void AConsacRoad::BeginPlay()
{
	Super::BeginPlay();
	Random = FRandomStream(Seed);

	EConsacResult Result = EConsacResult::Success;
	FString Error;
	UConsacModel* Model = nullptr;
	if (!ModelPath.IsEmpty())
	{
		UConsacBlueprintLibrary::LoadConsacModel(this, ModelPath, Result, Model, Error);
	}
	// In loop mode a tick waits for the trainer; in tick mode never.
	Environment->LoopWaitSeconds = StepsPerTick > 1 ? 1.0f : 0.0f;
	if (Result == EConsacResult::Success)
	{
		Environment->SetupEnvironment(UConsacBlueprintLibrary::MakeBoxSpace(2, 0.0f, 40.0f), UConsacBlueprintLibrary::MakeDiscreteSpace(3), TrainingLength,
			TEXT("road"), Result, Error, TEXT("127.0.0.1"), Port);
	}
	if (Result == EConsacResult::Success && !ModelPath.IsEmpty())
	{
		Environment->ModelConnection(Model, Result, Error);
	}
	bBegun = Result == EConsacResult::Success;
	if (!bBegun)
	{
		UE_LOG(LogConsacSamples, Error, TEXT("the road does not begin: %s"), *Error);
	}
}

void AConsacRoad::Tick(float DeltaSeconds)
{
	Super::Tick(DeltaSeconds);
	EConsacConnection Connection = EConsacConnection::Failed;
	FString Error;
	if (!bBegun || Environment->IsTrainingCompleted()) // what Begin Play could not do, no port is opened for
	{
		return;
	}
	Environment->TrainingConnection(Connection, Error);
	for (int32 Step = 0; Connection == EConsacConnection::Connected && Step < StepsPerTick; ++Step)
	{
		if (!PlayOnce())
		{
			break;
		}
	}
	Draw();
}

// One Training; false when the loop of this tick has come to its end.
bool AConsacRoad::PlayOnce()
{
	EConsacTraining Training = EConsacTraining::Failed;
	FConsacAction Action;
	FString Error;
	TArray<float> Observation;
	Observation.Add(static_cast<float>(Walker));
	Observation.Add(static_cast<float>(Coin));
	Environment->Train(Observation, Reward, bDone, Training, Action, Error);
	switch (Training)
	{
	case EConsacTraining::Step:
		Walk(Action.Choice);
		return true;
	case EConsacTraining::Reset:
		Restart();
		return true;
	default:
		return false;
	}
}

void AConsacRoad::Walk(int32 Choice)
{
	const int32 Before = std::abs(Coin - Walker);
	Walker += std::clamp(Choice, 0, 2) - 1;
	Reward = std::abs(Coin - Walker) < Before ? 1.0f : 0.0f;
	bDone = Walker < 0 || Walker > ConsacRoadRules::Last;
	Walker = std::clamp(Walker, 0, ConsacRoadRules::Last);
	++SinceCoin;
	Collected += Walker == Coin ? 1 : 0;
	if (Walker == Coin || SinceCoin >= ConsacRoadRules::CoinMoves)
	{
		PlaceCoin();
	}
}

void AConsacRoad::Restart()
{
	Walker = Episodes == 0 ? ConsacRoadRules::Start : Random.RandRange(0, ConsacRoadRules::Last);
	++Episodes;
	Reward = 0.0f;
	bDone = false;
	PlaceCoin();
}

// Anywhere but where the actor stands: there it would be collected before it was seen.
void AConsacRoad::PlaceCoin()
{
	Coin = Random.RandRange(0, ConsacRoadRules::Last - 1);
	Coin += Coin >= Walker ? 1 : 0;
	SinceCoin = 0;
}

void AConsacRoad::Draw()
{
	WalkerMesh->SetRelativeLocationAndRotation(FVector(100.0 * Walker, 0.0, 50.0), FQuat::Identity);
	CoinMesh->SetRelativeLocationAndRotation(FVector(100.0 * Coin, 0.0, 150.0), FQuat::Identity);
}

int32 AConsacRoad::GetWalkerPlace() const
{
	return Walker;
}

int32 AConsacRoad::GetCoinPlace() const
{
	return Coin;
}

int32 AConsacRoad::GetCoinsCollected() const
{
	return Collected;
}
