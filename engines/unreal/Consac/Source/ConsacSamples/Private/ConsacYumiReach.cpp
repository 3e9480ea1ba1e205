// Copyright CONSAC authors. MIT License.
#include "ConsacYumiReach.h"

#include "Components/StaticMeshComponent.h"
#include "ConsacAgentComponent.h"
#include "ConsacTwinComponent.h"
#include "ConsacTypes.h"
#include "ConsacYumiReachComponent.h"
#include "Engine/StaticMesh.h"
#include "UObject/ConstructorHelpers.h"

AConsacYumiReach::AConsacYumiReach()
{
	Robot = CreateDefaultSubobject<UConsacTwinComponent>(TEXT("Robot"));
	SetRootComponent(Robot);
	Agent = CreateDefaultSubobject<UConsacAgentComponent>(TEXT("Agent"));
	Agent->Behaviour = TEXT("default"); // as in the program's models of one agent
	UConsacYumiReachComponent::SetUpReachAgent(Agent);
	Task = CreateDefaultSubobject<UConsacYumiReachComponent>(TEXT("Task"));
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Cube(TEXT("/Engine/BasicShapes/Cube.Cube"));
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Sphere(TEXT("/Engine/BasicShapes/Sphere.Sphere"));
	GoalMesh = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Goal"));
	GoalMesh->SetupAttachment(Robot);
	GoalMesh->SetStaticMesh(Sphere.Object);
	GoalMesh->SetRelativeScale3D(FVector(0.1, 0.1, 0.1)); // of a sphere of a metre: 5 cm around the goal
	for (int32 Number = 1; Number <= 7; ++Number)
	{
		FConsacTwinMesh Row;
		Row.Link = FName(*FString::Printf(TEXT("yumi_link_%d_r"), Number));
		Row.Mesh = Cube.Object;
		Row.Place.SetScale3D(FVector(0.08, 0.08, 0.08));
		Robot->Meshes.Add(Row);
	}
}

void AConsacYumiReach::BeginPlay()
{
	Super::BeginPlay();
	if (bBound) // its level was hidden and is shown again
	{
		return;
	}
	bBound = true;
	Agent->OnEpisodeBegin.AddDynamic(this, &AConsacYumiReach::Restart);
	Agent->OnObserve.AddDynamic(this, &AConsacYumiReach::Observe);
	Agent->OnAction.AddDynamic(this, &AConsacYumiReach::Reach);
}

void AConsacYumiReach::Restart(UConsacAgentComponent*, int64 EpisodeSeed)
{
	Task->BeginReach(EpisodeSeed);
	GoalMesh->SetRelativeLocationAndRotation(Task->GetReachGoal(), FQuat(0.0, 0.0, 0.0, 1.0));
}

void AConsacYumiReach::Observe(UConsacAgentComponent* Which)
{
	for (const FConsacEntry& Entry : Which->Observations)
	{
		Which->SetObservationNumbers(Entry.Name, Task->GetReachObservation(Entry.Name));
	}
}

void AConsacYumiReach::Reach(UConsacAgentComponent* Which)
{
	float Reward = 0.0f;
	if (Task->StepReach(Which->GetActionNumbers(Which->Actions[0].Name), Reward))
	{
		Which->AddReward(Reward);
	}
}
