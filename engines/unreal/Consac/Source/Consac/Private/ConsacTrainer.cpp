// Copyright CONSAC authors. MIT License.
#include "ConsacTrainer.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacFarewell.h"
#include "ConsacHyperparametersBase.h"
#include "ConsacLog.h"
#include "ConsacStats.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainerState.h"
#include "Engine/EngineBaseTypes.h"
#include "Engine/World.h"
#include "Logging/LogMacros.h"
#include "Misc/App.h"
#include "Templates/PimplPtr.h"
#include "UObject/ObjectMacros.h"
#include "UObject/UObjectGlobals.h"
#include "UObject/WeakObjectPtrTemplates.h"

namespace ConsacPlugin
{

// The longest wait of a tick or a stop, as a property says it.
static double SecondsOf(float Property)
{
	return std::isfinite(Property) ? std::clamp(static_cast<double>(Property), 0.0, 60.0) : 0.0;
}

// A list, which is empty afterwards.
static std::vector<TWeakObjectPtr<UConsacAgentComponent>> Taken(std::vector<TWeakObjectPtr<UConsacAgentComponent>>& List)
{
	return std::exchange(List, {});
}

// The first failure of two.
static consac::Status FirstFailure(const consac::Status& One, const consac::Status& Other)
{
	return One.ok() ? Other : One;
}

// Where a folder that a property names is; nowhere where it names none.
static std::string FolderOf(const FString& Property)
{
	return Property.IsEmpty() ? std::string() : ToFolder(Property);
}

}

AConsacTrainer::AConsacTrainer()
	: State(MakePimpl<FConsacTrainerState>())
{
	PrimaryActorTick.bCanEverTick = true;
	PrimaryActorTick.bTickEvenWhenPaused = true; // to tell the trainer so
#if WITH_EDITORONLY_DATA
	bIsSpatiallyLoaded = false; // wherever the player is
#endif
}

void AConsacTrainer::Report(const FString& Error)
{
	ConsacPlugin::LogError(Error);
	OnTrainerError.Broadcast(Error);
}

void AConsacTrainer::StartTraining(EConsacResult& Result, FString& Error)
{
	// While a stop is under way what is to follow it is noted. Before the first tick agents of the same level may not play yet.
	const bool bEarly = !State->bStopWanted && !State->bTicked;
	const consac::Status Status = State->bStopWanted || bEarly ? State->MayBegin(*this) : State->Begin(*this);
	State->bStartWanted = State->bStopWanted && Status.ok();
	State->bAsked = State->bAsked || (bEarly && Status.ok());
	State->bStarted = Status.ok() ? !bEarly : State->bStarted;
	ConsacPlugin::Answer(Status, Result, Error);
}

void AConsacTrainer::StopTraining()
{
	State->bStarted = true; // nothing begins by itself any more
	State->bStartWanted = State->bAsked = false; // that was before
	Stop();
}

void AConsacTrainer::Stop()
{
	State->bStopWanted = true;
	if (State->bBusy)
	{
		return;
	}
	const double Until = consac::Now() + ConsacPlugin::SecondsOf(MaxWaitSeconds);
	State->bBusy = true; // whoever hears of the end may call anything: it is done after this
	TellCompleted(Until - consac::Now());
	State->bBusy = false;
	const std::string Kept = State->Driver && !State->bCompleted ? ConsacPlugin::FolderOf(SaveFolder) : std::string();
	const std::string Records = State->Driver ? ConsacPlugin::FolderOf(RecordFolder) : std::string();
	const std::string Fault = State->End(Kept, Records, Until - consac::Now());
	if (!Fault.empty())
	{
		Report(ConsacPlugin::FromUtf8(Fault)); // whoever hears it may call anything
	}
	StartNoted();
}

// What was to begin after the stop.
void AConsacTrainer::StartNoted()
{
	if (!std::exchange(State->bStartWanted, false) || State->Driver)
	{
		return;
	}
	const consac::Status Status = State->Begin(*this);
	if (!Status.ok())
	{
		Report(ConsacPlugin::FromUtf8(Status.message()));
	}
}

void AConsacTrainer::SaveModel(const FString& Behaviour, const FString& Path, EConsacResult& Result, FString& Error)
{
	consac::Status Status(consac::StatusCode::kFailedPrecondition, "nothing is being trained in this game");
	if (State->Driver)
	{
		const std::string Name = ConsacPlugin::ToUtf8(Behaviour);
		const std::vector<consac::BehaviourSpec>& Behaviours = State->Herd->World().spec().behaviours;
		Status = consac::Status(consac::StatusCode::kNotFound, "there is no behaviour '" + Name + "'");
		for (std::size_t B = 0; B < Behaviours.size(); ++B)
		{
			if (Behaviours[B].name == Name)
			{
				Status = State->Driver->SaveModel(B, ConsacPlugin::ToNewFile(Path));
			}
		}
	}
	ConsacPlugin::Answer(Status, Result, Error);
}

FConsacProgress AConsacTrainer::GetTrainerProgress() const
{
	return State->Driver ? ConsacPlugin::ToProgress(State->Driver->progress()) : State->Last;
}

bool AConsacTrainer::IsTraining() const
{
	return State->Driver != nullptr;
}

int32 AConsacTrainer::GetTrainerPort() const
{
	return State->Driver ? State->Driver->port() : 0;
}

void AConsacTrainer::AgentCame(UConsacAgentComponent* Agent)
{
	if (State->Driver && Agent->GetWorld() == GetWorld())
	{
		State->Newcomers.push_back(Agent);
	}
}

void AConsacTrainer::BeginPlay()
{
	// First, so that its own Event Begin Play may call Start Training.
	UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this);
	State->bOver = false;
	if (Subsystem != nullptr && !State->IsAway(*this))
	{
		Subsystem->AddTrainer(this);
		if (Subsystem->GetTrainer() != this)
		{
			UE_LOG(LogConsac, Display, TEXT("%s waits for its turn: another Consac Trainer drives the agents of this world"), *GetName());
		}
	}
	Super::BeginPlay();
}

void AConsacTrainer::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	// First, so that whoever hears of a model that could not be kept starts nothing here any more.
	if (UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this))
	{
		Subsystem->RemoveTrainer(this);
	}
	State->bOver = true;
	State->bStartWanted = State->bAsked = State->bTicked = false;
	Stop();
	State->bStarted = false;
	Super::EndPlay(EndPlayReason);
}

void AConsacTrainer::Tick(float DeltaSeconds)
{
	const bool bPaused = GetWorld() != nullptr && GetWorld()->IsPaused();
	if (State->Driver && State->bPaused != bPaused)
	{
		State->bPaused = bPaused;
		State->Driver->SetPaused(bPaused);
	}
	if (bPaused)
	{
		State->SetSpeed(false); // nothing moves: no card is to draw it 100,000 times a second
		return;
	}
	Super::Tick(DeltaSeconds);
	State->bTicked = true;
	StartInTurn();
	Advance();
	const bool bTrains = State->bMet && !State->bCompleted && (Mode == EConsacMode::Serve || Mode == EConsacMode::Train);
	State->SetSpeed(State->Driver && bFullSpeed && bTrains);
	if (State->Driver)
	{
		Show();
	}
}

// Begins by itself once, or because Start Training was called before the first tick, when it is its turn; while no agent is there, or another game of this computer has the port, it is tried
// again every second, and each reason is told once.
void AConsacTrainer::StartInTurn()
{
	const UConsacSubsystem* Subsystem = (bAutoStart || State->bAsked) && !State->bStarted ? UConsacSubsystem::Of(this) : nullptr;
	if (Subsystem == nullptr || Subsystem->GetTrainer() != this || consac::Now() < State->TryAgainAt)
	{
		return;
	}
	const bool bNobody = Subsystem->GetAgents().IsEmpty();
	const consac::Status Status = State->Begin(*this);
	const bool bLater = bNobody || Status.code() == consac::StatusCode::kAlreadyExists;
	State->bStarted = !bLater;
	State->TryAgainAt = bLater ? consac::Now() + 1.0 : 0.0;
	const bool bNew = std::exchange(State->Told, Status.message()) != Status.message();
	if (!Status.ok() && bNew)
	{
		Report(ConsacPlugin::FromUtf8(bNobody ? Status.message() + "; it begins by itself once one has come" : Status.message()));
	}
}

void AConsacTrainer::Advance()
{
	// Events of agents may call Stop Training or End Play: what they work on stays until this has come to its end.
	State->bBusy = true;
	TellCompleted(0.0);
	for (const TWeakObjectPtr<UConsacAgentComponent>& Newcomer : ConsacPlugin::Taken(State->Newcomers))
	{
		UConsacAgentComponent* Agent = Newcomer.Get();
		if (State->Driver && IsValid(Agent) && Agent->HasBegunPlay()) // it may have ended to play since
		{
			const consac::Status Status = State->Herd->Join(*Agent);
			if (!Status.ok())
			{
				Report(ConsacPlugin::FromUtf8(Status.message()));
			}
		}
	}
	const int32 Steps = State->Driver && State->Herd->Period() == 1 && MaxStepsPerTick > 1 ? MaxStepsPerTick : 1;
	const bool bWaits = bLockStep || FApp::IsUnattended();
	const double Until = consac::Now() + (bWaits ? ConsacPlugin::SecondsOf(MaxWaitSeconds) : 0.0); // of all steps together
	for (int32 Step = 0; Step < Steps && State->Driver && !State->bStopWanted; ++Step)
	{
		if (!DoStep(Until))
		{
			break;
		}
	}
	State->bBusy = false;
	if (State->bStopWanted)
	{
		Stop();
	}
}

bool AConsacTrainer::DoStep(double Until)
{
	using consac::host::Cue;
	FConsacHerd& Herd = *State->Herd;
	consac::Status Status;
	if (Herd.IsActing())
	{
		if (++State->TicksPassed < Herd.Period())
		{
			return false;
		}
		Status = Herd.Settle();
	}
	Status = ConsacPlugin::FirstFailure(Status, State->Poll(Until - consac::Now()));
	if (Herd.World().cue() == Cue::kReset)
	{
		Status = ConsacPlugin::FirstFailure(Status, Herd.Begin());
		Status = ConsacPlugin::FirstFailure(Status, State->Poll(Until - consac::Now()));
	}
	if (!Status.ok())
	{
		Report(ConsacPlugin::FromUtf8(Status.message()));
	}
	if (!State->Driver->finished())
	{
		State->bCompleted = false; // a further trainer has come
	}
	else if (!State->bCompleted)
	{
		Complete();
	}
	if (Herd.World().cue() != Cue::kAct || State->bStopWanted)
	{
		return false;
	}
	State->TicksPassed = 0;
	Herd.Act(Mode == EConsacMode::ByHand);
	return true;
}

void AConsacTrainer::Complete()
{
	State->bCompleted = State->bUntold = true;
	const std::string Folder = ConsacPlugin::FolderOf(SaveFolder);
	const std::string Fault = Folder.empty() ? Folder : State->Keep(Folder);
	if (!Fault.empty())
	{
		Report(ConsacPlugin::FromUtf8(Fault));
	}
	TellCompleted(0.0);
}

// Once the models are written, which no tick waits for: whoever hears of it may load them.
void AConsacTrainer::TellCompleted(double MostSeconds)
{
	if (!State->bUntold || !State->HasKept(MostSeconds))
	{
		return;
	}
	State->bUntold = false;
	const std::string Fault = State->LeaveKeeping();
	if (!Fault.empty())
	{
		Report(ConsacPlugin::FromUtf8(Fault));
	}
	OnTrainingCompleted.Broadcast();
}

void AConsacTrainer::Show()
{
	const FConsacProgress Progress = GetTrainerProgress();
	ConsacPlugin::ShowStats(Progress);
	const double Now = consac::Now();
	if (LogSeconds > 0.0f && Now - State->LoggedAt >= static_cast<double>(LogSeconds))
	{
		State->LoggedAt = Now;
		UE_LOG(LogConsac, Log, TEXT("%s: step %lld of %lld, %.0f steps/s, %.3f ms a step, %lld episodes, mean reward %.3f"), *Progress.State, Progress.Steps,
			Progress.TotalSteps, Progress.StepsPerSecond, Progress.PollMilliseconds, Progress.Episodes, Progress.MeanEpisodeReward);
	}
}

void AConsacTrainer::StartProgram()
{
	FConsacProgramSettings Settings = Program;
	Settings.Host = Host;
	Settings.Port = Port != 0 ? Port : GetTrainerPort();
	TArray<FString> Arguments;
	if (IsValid(Hyperparameters.Get()))
	{
		TArray<FConsacHyperparameter> Rows;
		Hyperparameters->Collect(Rows);
		const FString Algorithm = Hyperparameters->GetAlgorithm();
		if (!Settings.Algorithm.IsEmpty() && Settings.Algorithm != Algorithm)
		{
			Report(FString::Printf(TEXT("Program asks for the algorithm %s, Hyperparameters are those of %s; leave one of them empty, or let both be the same"),
				*Settings.Algorithm, *Algorithm));
			return;
		}
		Settings.Algorithm = Algorithm;
		for (const FConsacHyperparameter& Row : Rows)
		{
			Arguments.Append({ TEXT("--set"), FString::Printf(TEXT("%s=%s"), *Row.Name, *Row.Value) });
		}
	}
	if (!Token.IsEmpty())
	{
		Arguments.Append({ TEXT("--token"), Token });
	}
	if (!IsValid(RunningProgram.Get()))
	{
		RunningProgram = NewObject<UConsacTrainerProgram>(this, NAME_None, RF_Transient); // no part of the level that an editor saves
	}
	FString Error;
	if (!RunningProgram->Start(Settings, Arguments, Error))
	{
		OnTrainerError.Broadcast(Error);
	}
}

void AConsacTrainer::StopProgram()
{
	if (IsValid(RunningProgram.Get()))
	{
		RunningProgram->Stop();
	}
}

void AConsacTrainer::BeginDestroy()
{
	if (State.IsValid()) // a temporary object of Hot Reload has none
	{
		State->End(std::string(), std::string(), 0.0);
	}
	Super::BeginDestroy();
}
