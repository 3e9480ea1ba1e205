// Copyright CONSAC authors. MIT License.
#include "ConsacLane.h"

#include <algorithm>
#include <cstdlib>

#include "Components/SceneComponent.h"
#include "Components/StaticMeshComponent.h"
#include "ConsacAgentComponent.h"
#include "ConsacBlueprintLibrary.h"
#include "ConsacTypes.h"
#include "Engine/StaticMesh.h"
#include "UObject/ConstructorHelpers.h"

namespace ConsacLaneRules
{
constexpr int32 Last = 40;       // places are 0 to 40, a metre apart, around the actor's own
constexpr int32 CoinMoves = 50;  // steps after which the coin moves by itself
constexpr int32 Episode = 100;   // steps; the highest reward of an episode, too
}

AConsacLane::AConsacLane()
{
	Agent = CreateDefaultSubobject<UConsacAgentComponent>(TEXT("Agent"));
	Root = CreateDefaultSubobject<USceneComponent>(TEXT("Root"));
	WalkerMesh = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Walker"));
	CoinMesh = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Coin"));
	SetRootComponent(Root);
	WalkerMesh->SetupAttachment(Root);
	CoinMesh->SetupAttachment(Root);
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Cube(TEXT("/Engine/BasicShapes/Cube.Cube"));
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Sphere(TEXT("/Engine/BasicShapes/Sphere.Sphere"));
	WalkerMesh->SetStaticMesh(Cube.Object);
	CoinMesh->SetStaticMesh(Sphere.Object);
	CoinMesh->SetRelativeScale3D(FVector(0.6, 0.6, 0.6));
	Draw();
	Agent->MaxEpisodeSteps = ConsacLaneRules::Episode;
	FConsacEntry Seen;
	Seen.Name = FName(TEXT("places"));
	Seen.Space = UConsacBlueprintLibrary::MakeBoxSpace(2, 0.0f, static_cast<float>(ConsacLaneRules::Last));
	Agent->Observations.Add(Seen);
	FConsacEntry Done;
	Done.Name = FName(TEXT("walk"));
	Done.Space = UConsacBlueprintLibrary::MakeDiscreteSpace(3);
	Agent->Actions.Add(Done);
}

void AConsacLane::BeginPlay()
{
	Super::BeginPlay();
	if (bBound) // its level was hidden and is shown again
	{
		return;
	}
	bBound = true;
	Random = FRandomStream(Seed);
	Agent->OnEpisodeBegin.AddDynamic(this, &AConsacLane::Restart);
	Agent->OnObserve.AddDynamic(this, &AConsacLane::Observe);
	Agent->OnAction.AddDynamic(this, &AConsacLane::Walk);
}

void AConsacLane::Restart(UConsacAgentComponent*, int64 EpisodeSeed)
{
	if (EpisodeSeed >= 0)
	{
		Random = FRandomStream(static_cast<int32>(EpisodeSeed & 0x7fffffff));
	}
	Walker = Random.RandRange(0, ConsacLaneRules::Last);
	PlaceCoin();
	Draw();
}

void AConsacLane::Observe(UConsacAgentComponent* Which)
{
	TArray<float> Places;
	Places.Add(static_cast<float>(Walker));
	Places.Add(static_cast<float>(Coin));
	Which->SetObservationNumbers(FName(TEXT("places")), Places);
}

void AConsacLane::Walk(UConsacAgentComponent* Which)
{
	const int32 Before = std::abs(Coin - Walker);
	Walker += Which->GetActionChoice(FName(TEXT("walk"))) - 1;
	Which->AddReward(std::abs(Coin - Walker) < Before ? 1.0f : 0.0f);
	if (Walker < 0 || Walker > ConsacLaneRules::Last)
	{
		Which->EndEpisode(EConsacEpisodeEnd::Terminated); // it left the road
	}
	Walker = std::clamp(Walker, 0, ConsacLaneRules::Last);
	++SinceCoin;
	Coins += Walker == Coin ? 1 : 0;
	if (Walker == Coin || SinceCoin >= ConsacLaneRules::CoinMoves)
	{
		PlaceCoin();
	}
	Draw();
}

// Anywhere but where the walker stands: there it would be collected before it was seen.
void AConsacLane::PlaceCoin()
{
	Coin = Random.RandRange(0, ConsacLaneRules::Last - 1);
	Coin += Coin >= Walker ? 1 : 0;
	SinceCoin = 0;
}

void AConsacLane::Draw()
{
	constexpr double Metre = 100.0;
	constexpr double Middle = 0.5 * ConsacLaneRules::Last;
	WalkerMesh->SetRelativeLocationAndRotation(FVector(Metre * (Walker - Middle), 0.0, 50.0), FQuat::Identity);
	CoinMesh->SetRelativeLocationAndRotation(FVector(Metre * (Coin - Middle), 0.0, 150.0), FQuat::Identity);
}

int32 AConsacLane::GetCoins() const
{
	return Coins;
}
