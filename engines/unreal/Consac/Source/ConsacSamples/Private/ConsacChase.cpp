// Copyright CONSAC authors. MIT License.
#include "ConsacChase.h"

#include <algorithm>
#include <cmath>

#include "Components/StaticMeshComponent.h"
#include "ConsacAgentComponent.h"
#include "ConsacBlueprintLibrary.h"
#include "ConsacTrainer.h"
#include "ConsacTypes.h"
#include "Engine/StaticMesh.h"
#include "Engine/World.h"
#include "UObject/ConstructorHelpers.h"
#include "UObject/UObjectGlobals.h"

namespace ConsacChaseRules
{
constexpr double Stride = 50.0;  // of a chaser in a decision, in centimetres
constexpr double Reach = 100.0;  // from so near it catches
}

AConsacChaser::AConsacChaser()
{
	Agent = CreateDefaultSubobject<UConsacAgentComponent>(TEXT("Agent"));
	Mesh = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Mesh"));
	SetRootComponent(Mesh);
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Cube(TEXT("/Engine/BasicShapes/Cube.Cube"));
	Mesh->SetStaticMesh(Cube.Object);
	Agent->Behaviour = TEXT("chaser");
	Agent->MaxEpisodeSteps = 200;
	FConsacEntry Seen;
	Seen.Name = FName(TEXT("runner"));
	Seen.Space = UConsacBlueprintLibrary::MakeBoxSpace(2, -3.0f, 3.0f);
	Agent->Observations.Add(Seen);
	FConsacEntry Done;
	Done.Name = FName(TEXT("walk"));
	Done.Space = UConsacBlueprintLibrary::MakeDiscreteSpace(5);
	Agent->Actions.Add(Done);
}

void AConsacChaser::Join(AConsacChase* NewChase, int32 NewSeed)
{
	Chase = NewChase;
	Random = FRandomStream(NewSeed);
}

void AConsacChaser::BeginPlay()
{
	Super::BeginPlay();
	if (bBound) // its level was hidden and is shown again
	{
		return;
	}
	bBound = true;
	Agent->OnEpisodeBegin.AddDynamic(this, &AConsacChaser::Restart);
	Agent->OnObserve.AddDynamic(this, &AConsacChaser::Observe);
	Agent->OnAction.AddDynamic(this, &AConsacChaser::Walk);
}

void AConsacChaser::Restart(UConsacAgentComponent*, int64 EpisodeSeed)
{
	if (EpisodeSeed >= 0)
	{
		Random = FRandomStream(static_cast<int32>(EpisodeSeed & 0x7fffffff));
	}
	const float Half = IsValid(Chase.Get()) ? Chase->HalfWidth : 0.0f;
	Place = FVector(static_cast<double>(Random.FRandRange(-Half, Half)), static_cast<double>(Random.FRandRange(-Half, Half)), 0.0);
	SetActorLocation(Place);
}

void AConsacChaser::Observe(UConsacAgentComponent* Which)
{
	const FVector Runner = IsValid(Chase.Get()) ? Chase->GetRunnerPlace() : FVector::ZeroVector;
	const double Half = IsValid(Chase.Get()) ? static_cast<double>(Chase->HalfWidth) : 1.0;
	TArray<float> Seen;
	Seen.Add(static_cast<float>((Runner.X - Place.X) / Half));
	Seen.Add(static_cast<float>((Runner.Y - Place.Y) / Half));
	Which->SetObservationNumbers(FName(TEXT("runner")), Seen);
}

void AConsacChaser::Walk(UConsacAgentComponent* Which)
{
	if (!IsValid(Chase.Get()))
	{
		return;
	}
	const int32 Choice = Which->GetActionChoice(FName(TEXT("walk")));
	const double Half = static_cast<double>(Chase->HalfWidth);
	const FVector Runner = Chase->GetRunnerPlace();
	const double Before = std::hypot(Runner.X - Place.X, Runner.Y - Place.Y);
	Place.X = std::clamp(Place.X + (Choice == 1 ? ConsacChaseRules::Stride : Choice == 2 ? -ConsacChaseRules::Stride : 0.0), -Half, Half);
	Place.Y = std::clamp(Place.Y + (Choice == 3 ? ConsacChaseRules::Stride : Choice == 4 ? -ConsacChaseRules::Stride : 0.0), -Half, Half);
	SetActorLocation(Place);
	const double After = std::hypot(Runner.X - Place.X, Runner.Y - Place.Y);
	Which->AddReward(static_cast<float>((Before - After) / ConsacChaseRules::Stride) * 0.1f);
	if (After < ConsacChaseRules::Reach)
	{
		Which->AddReward(1.0f);
		Which->EndEpisode(EConsacEpisodeEnd::Terminated);
		Chase->Caught();
	}
}

AConsacChase::AConsacChase()
{
	PrimaryActorTick.bCanEverTick = true;
	RunnerMesh = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Runner"));
	SetRootComponent(RunnerMesh);
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Sphere(TEXT("/Engine/BasicShapes/Sphere.Sphere"));
	RunnerMesh->SetStaticMesh(Sphere.Object);
}

void AConsacChase::BeginPlay()
{
	Super::BeginPlay();
	if (IsValid(Trainer.Get())) // its level was hidden and is shown again; what it made belongs to the world
	{
		return;
	}
	UWorld* World = GetWorld();
	const FRotator Straight(0.0, 0.0, 0.0);
	Trainer = World->SpawnActor<AConsacTrainer>(FVector(0.0, 0.0, 0.0), Straight);
	for (int32 Number = 0; Number < Chasers; ++Number)
	{
		AConsacChaser* Chaser = World->SpawnActor<AConsacChaser>(FVector(0.0, 0.0, 0.0), Straight);
		Chaser->Join(this, Number + 1);
	}
}

void AConsacChase::Tick(float DeltaSeconds)
{
	Super::Tick(DeltaSeconds);
	Angle += static_cast<double>(DeltaSeconds) * 0.5;
	SetActorLocation(GetRunnerPlace());
}

FVector AConsacChase::GetRunnerPlace() const
{
	const double Radius = 0.6 * static_cast<double>(HalfWidth);
	return FVector(Radius * std::cos(Angle), Radius * std::sin(Angle), 0.0);
}

void AConsacChase::Caught()
{
	++Catches;
}

int32 AConsacChase::GetCatches() const
{
	return Catches;
}
