// Copyright CONSAC authors. MIT License.
#include "ConsacTrainer.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacHerd.h"
#include "ConsacHyperparametersBase.h"
#include "ConsacLog.h"
#include "ConsacStats.h"
#include "ConsacStepGuard.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainerDrivers.h"
#include "Engine/World.h"
#include "Logging/LogMacros.h"
#include "Misc/App.h"
#include "Templates/PimplPtr.h"
#include "UObject/UObjectGlobals.h"
#include "UObject/WeakObjectPtrTemplates.h"

struct FConsacTrainerState
{
	// In this order: the driver goes before the world that it drives.
	std::unique_ptr<FConsacHerd> Herd;
	std::unique_ptr<consac::host::Driver> Driver;
	std::unique_ptr<FConsacStepGuard> Guard;
	int32 TicksPassed = 0;
	bool bOwnsTheWorld = false;  // the subsystem knows no other trainer
	bool bStarted = false;       // Start Training was tried
	bool bCompleted = false;
	bool bBusy = false;          // agents' events are under way
	bool bStopWanted = false;    // one of them has called Stop Training
	bool bPaused = false;        // the driver was told so
	std::vector<TWeakObjectPtr<UConsacAgentComponent>> Newcomers;
	double LoggedAt = 0.0;
	FConsacProgress Last;        // of what has ended

	void Drop()
	{
		if (Driver)
		{
			Last = ConsacPlugin::ToProgress(Driver->progress());
		}
		Driver.reset();
		Herd.reset();
		Guard.reset();
		Newcomers.clear();
		bStopWanted = false;
		bPaused = false;
	}
};

namespace ConsacPlugin
{

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

}

AConsacTrainer::AConsacTrainer()
	: State(MakePimpl<FConsacTrainerState>())
{
	PrimaryActorTick.bCanEverTick = true;
	PrimaryActorTick.bTickEvenWhenPaused = true; // to tell the trainer so
}

void AConsacTrainer::Report(const FString& Error)
{
	UE_LOG(LogConsac, Error, TEXT("%s"), *Error);
	OnTrainerError.Broadcast(Error);
}

void AConsacTrainer::StartTraining(EConsacResult& Result, FString& Error)
{
	UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this);
	State->bStarted = true;
	consac::Status Status;
	TArray<UConsacAgentComponent*> Agents;
	if (Subsystem == nullptr || !State->bOwnsTheWorld)
	{
		Status = consac::Status(consac::StatusCode::kFailedPrecondition, "the game does not run, or another Consac Trainer drives its agents");
	}
	else if (State->Driver)
	{
		Status = consac::Status(consac::StatusCode::kFailedPrecondition, "the training has begun already; Stop Training ends it");
	}
	else
	{
		for (UConsacAgentComponent* Agent : Subsystem->GetAgents())
		{
			if (Agent->GetWorld() == GetWorld())
			{
				Agents.Add(Agent);
			}
		}
	}
	if (Status.ok() && Agents.IsEmpty())
	{
		Status = consac::Status(consac::StatusCode::kFailedPrecondition, "there is no actor with a Consac Agent");
	}
	if (Status.ok())
	{
		std::unique_ptr<FConsacHerd> Herd = std::make_unique<FConsacHerd>();
		Status = Herd->Gather(Agents, RoomForAgents);
		ConsacPlugin::FDriverResult Driver = Status.ok() ? ConsacPlugin::DriverFor(*this, Herd->World()) : ConsacPlugin::FDriverResult(Status);
		Status = Driver.status();
		if (Driver.ok())
		{
			State->Herd = std::move(Herd);
			State->Driver = std::move(*Driver);
			State->TicksPassed = 0;
			State->bCompleted = false;
		}
	}
	if (ConsacPlugin::Answer(Status, Result, Error))
	{
		if (!RecordFolder.IsEmpty())
		{
			State->Herd->Record();
		}
		if (bFixedStep && std::isfinite(FixedStepSeconds) && FixedStepSeconds > 0.0f)
		{
			State->Guard = std::make_unique<FConsacStepGuard>(static_cast<double>(FixedStepSeconds));
		}
	}
}

void AConsacTrainer::StopTraining()
{
	if (State->bBusy)
	{
		State->bStopWanted = true;
		return;
	}
	FString Fault;
	if (State->Driver && !State->bCompleted)
	{
		Fault = KeepModels(TEXT(".stopped.consac"));
	}
	if (State->Driver && !RecordFolder.IsEmpty())
	{
		const consac::Status Status = State->Herd->SaveRecords(ConsacPlugin::ToFolder(RecordFolder));
		Fault = Status.ok() ? Fault : ConsacPlugin::FromUtf8(Status.message());
	}
	State->Drop();
	if (!Fault.IsEmpty())
	{
		Report(Fault); // last: whoever hears it may call anything
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
	Super::BeginPlay();
	UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this);
	State->bOwnsTheWorld = Subsystem != nullptr && Subsystem->AddTrainer(this);
	if (!State->bOwnsTheWorld)
	{
		Report(TEXT("there are two Consac Trainers; this one does nothing"));
	}
}

void AConsacTrainer::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	StopTraining();
	if (UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this))
	{
		Subsystem->RemoveTrainer(this);
	}
	State->bOwnsTheWorld = false;
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
		return;
	}
	Super::Tick(DeltaSeconds);
	if (!State->bStarted && bAutoStart && State->bOwnsTheWorld)
	{
		EConsacResult Result = EConsacResult::Failed;
		FString Error;
		StartTraining(Result, Error);
		if (Result == EConsacResult::Failed)
		{
			OnTrainerError.Broadcast(Error);
		}
	}
	Advance();
	if (State->Driver)
	{
		Show();
	}
}

void AConsacTrainer::Advance()
{
	// Events of agents may call Stop Training or End Play: what they work on stays until this has come to its end.
	State->bBusy = true;
	for (const TWeakObjectPtr<UConsacAgentComponent>& Newcomer : ConsacPlugin::Taken(State->Newcomers))
	{
		UConsacAgentComponent* Agent = Newcomer.Get();
		if (State->Driver && IsValid(Agent))
		{
			const consac::Status Status = State->Herd->Join(*Agent);
			if (!Status.ok())
			{
				Report(ConsacPlugin::FromUtf8(Status.message()));
			}
		}
	}
	const int32 Steps = State->Driver && State->Herd->Period() == 1 && MaxStepsPerTick > 1 ? MaxStepsPerTick : 1;
	for (int32 Step = 0; Step < Steps && State->Driver && !State->bStopWanted; ++Step)
	{
		if (!DoStep())
		{
			break;
		}
	}
	State->bBusy = false;
	if (State->bStopWanted)
	{
		StopTraining();
	}
}

bool AConsacTrainer::DoStep()
{
	using consac::host::Cue;
	const bool bWaits = bLockStep || FApp::IsUnattended();
	const double Wait = bWaits && std::isfinite(MaxWaitSeconds) ? std::clamp(static_cast<double>(MaxWaitSeconds), 0.0, 60.0) : 0.0;
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
	Status = ConsacPlugin::FirstFailure(Status, State->Driver->Poll(Wait));
	if (Herd.World().cue() == Cue::kReset)
	{
		Status = ConsacPlugin::FirstFailure(Status, Herd.Begin());
		Status = ConsacPlugin::FirstFailure(Status, State->Driver->Poll(Wait));
	}
	if (!Status.ok())
	{
		Report(ConsacPlugin::FromUtf8(Status.message()));
	}
	if (State->Driver->finished() && !State->bCompleted)
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
	State->bCompleted = true;
	const FString Fault = KeepModels(TEXT(".consac"));
	if (!Fault.IsEmpty())
	{
		Report(Fault);
	}
	OnTrainingCompleted.Broadcast();
}

// What is wrong, or nothing. A model that has learned nothing yet is worth no file.
FString AConsacTrainer::KeepModels(const TCHAR* Ending)
{
	FString Fault;
	const std::vector<consac::BehaviourSpec>& Behaviours = State->Herd->World().spec().behaviours;
	for (std::size_t B = 0; !SaveFolder.IsEmpty() && B < Behaviours.size(); ++B)
	{
		if (!State->Driver->learned(B))
		{
			continue;
		}
		const std::string File = ConsacPlugin::ToFolder(SaveFolder) + "/" + Behaviours[B].name + ConsacPlugin::ToUtf8(Ending);
		const consac::Status Status = State->Driver->SaveModel(B, File);
		if (!Status.ok())
		{
			Fault = ConsacPlugin::FromUtf8(Status.message());
		}
		else
		{
			UE_LOG(LogConsac, Display, TEXT("what was learned is in %s"), *ConsacPlugin::FromUtf8(File));
		}
	}
	return Fault;
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
	Settings.Port = Port;
	TArray<FString> Arguments;
	if (IsValid(Hyperparameters.Get()))
	{
		TArray<FConsacHyperparameter> Rows;
		Hyperparameters->Collect(Rows);
		Settings.Algorithm = Settings.Algorithm.IsEmpty() ? Hyperparameters->GetAlgorithm() : Settings.Algorithm;
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
		RunningProgram = NewObject<UConsacTrainerProgram>(this);
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
	State->Drop();
	Super::BeginDestroy();
}
