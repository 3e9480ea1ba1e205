// Copyright CONSAC authors. MIT License.
#include "ConsacWatch.h"

#include <algorithm>

#include "ConsacEnvironmentComponent.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainer.h"
#include "ConsacTypes.h"
#include "Editor.h"
#include "Editor/EditorEngine.h"
#include "Engine/EngineBaseTypes.h"
#include "Engine/EngineTypes.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"
#include "HAL/FileManager.h"
#include "HAL/PlatformTime.h"
#include "Misc/CoreDelegates.h"
#include "Misc/DateTime.h"
#include "Misc/Paths.h"
#include "UObject/UObjectGlobals.h"
#include "UObject/UObjectIterator.h"

namespace ConsacWatching
{

// The world of an object that is no template and no garbage, of that kind; null where it is in none.
static const UWorld* WorldOf(const UObject* Object, EWorldType::Type Kind)
{
	const UWorld* World = IsValid(Object) ? Object->GetWorld() : nullptr;
	return World != nullptr && World->WorldType == Kind ? World : nullptr;
}

// A world that plays in the editor, and no client of a network game, which trains nothing.
static const UWorld* PlayedBy(const UObject* Object)
{
	const UWorld* World = WorldOf(Object, EWorldType::PIE);
	return World != nullptr && World->GetNetMode() != NM_Client ? World : nullptr;
}

static FString InWords(EConsacMode Mode)
{
	switch (Mode)
	{
	case EConsacMode::Serve:
		return TEXT("Serve");
	case EConsacMode::Train:
		return TEXT("Train Inside");
	case EConsacMode::Act:
		return TEXT("Act");
	default:
		return TEXT("By Hand");
	}
}

static FConsacPanelTrainer Row(const AConsacTrainer& Trainer, const UConsacSubsystem& Subsystem)
{
	FConsacPanelTrainer Found;
	Found.Name = Trainer.GetActorLabel();
	Found.Mode = InWords(Trainer.Mode);
	Found.bRuns = Trainer.IsTraining();
	Found.bWaitsForTurn = Subsystem.GetTrainer() != &Trainer;
	Found.bFullSpeed = Trainer.bFullSpeed;
	Found.Port = Trainer.GetTrainerPort();
	Found.Agents = Subsystem.GetAgents().Num();
	Found.Progress = Trainer.GetTrainerProgress();
	return Found;
}

static FConsacPanelTrainer Row(const UConsacEnvironmentComponent& Environment)
{
	FConsacPanelTrainer Found;
	Found.Name = IsValid(Environment.GetOwner()) ? Environment.GetOwner()->GetActorLabel() : Environment.GetName();
	Found.Mode = TEXT("Consac Environment");
	Found.bGraph = true;
	Found.Port = Environment.GetTrainingPort();
	Found.bFullSpeed = Environment.bFullSpeed;
	Found.Agents = 1;
	Found.Progress = Environment.GetTrainingProgress();
	Found.bRuns = Found.Port != 0 || Found.Progress.Steps > 0;
	return Found;
}

}

FConsacWatch::FConsacWatch()
	: WorldBegins(FWorldDelegates::OnWorldTickStart.AddRaw(this, &FConsacWatch::BeginWorld))
	, WorldEnds(FWorldDelegates::OnWorldPostActorTick.AddRaw(this, &FConsacWatch::EndWorld))
	, FrameEnds(FCoreDelegates::OnEndFrame.AddRaw(this, &FConsacWatch::EndFrame))
{
}

FConsacWatch::~FConsacWatch()
{
	FWorldDelegates::OnWorldTickStart.Remove(WorldBegins);
	FWorldDelegates::OnWorldPostActorTick.Remove(WorldEnds);
	FCoreDelegates::OnEndFrame.Remove(FrameEnds);
}

void FConsacWatch::BeginWorld(UWorld* World, ELevelTick, float)
{
	if (ConsacWatching::WorldOf(World, EWorldType::PIE) != nullptr)
	{
		Clock.BeginWorld(FPlatformTime::Seconds());
	}
}

void FConsacWatch::EndWorld(UWorld* World, ELevelTick, float)
{
	if (ConsacWatching::WorldOf(World, EWorldType::PIE) != nullptr)
	{
		Clock.EndWorld(FPlatformTime::Seconds());
	}
}

void FConsacWatch::EndFrame()
{
	Clock.EndFrame(FPlatformTime::Seconds());
}

const FConsacPanelState& FConsacWatch::Look(bool bModels)
{
	constexpr double SecondsBetween = 5.0; // of looks for files
	State.Now = FPlatformTime::Seconds();
	State.NowUtc = FDateTime::UtcNow();
	State.bPlays = GEditor != nullptr && GEditor->PlayWorld != nullptr;
	const FConsacFrameTimes Times = Clock.Take();
	State.Times = Times.Frames > 0 || !State.bPlays ? Times : State.Times;
	LookAtTrainers();
	State.Faults = Log.GetFaults();
	if (bModels && (!bModelsKnown || State.Now - ModelsAt >= SecondsBetween))
	{
		LookForModels();
	}
	return State;
}

void FConsacWatch::LookAtTrainers()
{
	State.Trainers.Reset();
	State.bLevelHasTrainer = false;
	UObject* Leads = nullptr;
	TArray<FConsacPanelTrainer> Others;
	for (TObjectIterator<AConsacTrainer> It; It; ++It)
	{
		AConsacTrainer* Trainer = *It;
		State.bLevelHasTrainer = State.bLevelHasTrainer || ConsacWatching::WorldOf(Trainer, EWorldType::Editor) != nullptr;
		const UWorld* World = ConsacWatching::PlayedBy(Trainer);
		const UConsacSubsystem* Subsystem = World != nullptr ? World->GetSubsystem<UConsacSubsystem>() : nullptr;
		if (Subsystem == nullptr)
		{
			continue;
		}
		const FConsacPanelTrainer Row = ConsacWatching::Row(*Trainer, *Subsystem);
		(Row.bWaitsForTurn ? Others : State.Trainers).Add(Row);
		Leads = Leads == nullptr && !Row.bWaitsForTurn ? Trainer : Leads;
	}
	State.Trainers.Append(Others);
	for (TObjectIterator<UConsacEnvironmentComponent> It; It; ++It)
	{
		if (ConsacWatching::PlayedBy(*It) != nullptr)
		{
			State.Trainers.Add(ConsacWatching::Row(**It));
			Leads = Leads == nullptr ? *It : Leads;
		}
	}
	if (Leads == nullptr)
	{
		return; // the curve of what has ended stays
	}
	if (First.Get() != Leads)
	{
		First = Leads;
		State.Curve.Clear();
	}
	const FConsacProgress& Progress = State.Trainers[0].Progress;
	if (Progress.Episodes > 0)
	{
		State.Curve.Add(Progress.Steps, Progress.MeanEpisodeReward);
	}
}

void FConsacWatch::LookForModels()
{
	ModelsAt = State.Now;
	bModelsKnown = true;
	const FString Folder = FPaths::Combine(FPaths::ProjectSavedDir(), TEXT("Consac"));
	TArray<FString> Paths;
	IFileManager::Get().FindFilesRecursive(Paths, *Folder, TEXT("*.consac"), true, false);
	TArray<FConsacPanelModel> Found;
	for (const FString& Path : Paths)
	{
		FConsacPanelModel Model;
		Model.File = Path.RightChop(Folder.Len() + 1);
		Model.Changed = IFileManager::Get().GetTimeStamp(*Path);
		Model.Bytes = IFileManager::Get().FileSize(*Path);
		Found.Add(Model);
	}
	std::stable_sort(Found.GetData(), Found.GetData() + Found.Num(), [](const FConsacPanelModel& A, const FConsacPanelModel& B) { return A.Changed > B.Changed; });
	State.MoreModels = std::max(0, Found.Num() - FConsacPanelState::MostModels);
	Found.SetNum(Found.Num() - State.MoreModels);
	State.Models = MoveTemp(Found);
}

TArray<AConsacTrainer*> FConsacWatch::Driving(FString& Why) const
{
	TArray<AConsacTrainer*> Found;
	if (GEditor == nullptr || GEditor->PlayWorld == nullptr)
	{
		Why = TEXT("Nothing plays: press Play first.");
		return Found;
	}
	for (TObjectIterator<AConsacTrainer> It; It; ++It)
	{
		const UWorld* World = ConsacWatching::PlayedBy(*It);
		const UConsacSubsystem* Subsystem = World != nullptr ? World->GetSubsystem<UConsacSubsystem>() : nullptr;
		if (Subsystem != nullptr && Subsystem->GetTrainer() == *It)
		{
			Found.Add(*It);
		}
	}
	Why = Found.IsEmpty() ? TEXT("The game has no Consac Trainer. A graph with a Consac Environment starts and stops by its own nodes.") : TEXT("");
	return Found;
}

FString FConsacWatch::Start()
{
	FString Told;
	for (AConsacTrainer* Trainer : Driving(Told))
	{
		EConsacResult Result = EConsacResult::Failed;
		FString Error;
		Trainer->StartTraining(Result, Error);
		Told = Result == EConsacResult::Success ? FString::Printf(TEXT("%s begins."), *Trainer->GetActorLabel()) : FString::Printf(TEXT("%s does not begin: %s"), *Trainer->GetActorLabel(), *Error);
	}
	return Told;
}

FString FConsacWatch::Stop()
{
	FString Told;
	for (AConsacTrainer* Trainer : Driving(Told))
	{
		const bool bRan = Trainer->IsTraining();
		Trainer->StopTraining();
		Told = FString::Printf(TEXT("%s %s"), *Trainer->GetActorLabel(), bRan ? TEXT("is stopped. Start begins a new training.") : TEXT("did not train, and does not begin by itself any more."));
	}
	return Told;
}

FString FConsacWatch::StartProgram()
{
	FString Told;
	for (AConsacTrainer* Trainer : Driving(Told))
	{
		if (Trainer->Mode != EConsacMode::Serve)
		{
			Told = FString::Printf(TEXT("%s needs no program: its Mode is %s, not Serve."), *Trainer->GetActorLabel(), *ConsacWatching::InWords(Trainer->Mode));
			continue;
		}
		Trainer->StartProgram();
		Told = FString::Printf(TEXT("%s was asked to start its program; an error below says where that went wrong."), *Trainer->GetActorLabel());
	}
	return Told;
}

FString FConsacWatch::ImportModels()
{
	FString Told;
	for (AConsacTrainer* Trainer : Driving(Told))
	{
		Trainer->ImportModels();
		Told = FString::Printf(TEXT("The models of %s are below Content/Consac; an error below names those that are not."), *Trainer->GetActorLabel());
	}
	return Told;
}
