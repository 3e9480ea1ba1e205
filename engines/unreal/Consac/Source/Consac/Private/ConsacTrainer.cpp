// Copyright CONSAC authors. MIT License.
#include "ConsacTrainer.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacFarewell.h"
#include "ConsacHyperparametersBase.h"
#include "ConsacLog.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainerState.h"
#include "Engine/EngineBaseTypes.h"
#include "Engine/World.h"
#include "Logging/LogMacros.h"
#include "Templates/PimplPtr.h"
#include "UObject/ObjectMacros.h"
#include "UObject/UObjectGlobals.h"
#include "UObject/WeakObjectPtrTemplates.h"

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
	const double Until = consac::Now() + ConsacPlugin::ToSeconds(MaxWaitSeconds);
	State->bBusy = true; // whoever hears of the end may call anything: it is done after this
	TellCompleted(Until - consac::Now());
	State->bBusy = false;
	const std::string Kept = State->Driver && !State->bCompleted ? ConsacPlugin::ToFolderOrNone(SaveFolder) : std::string();
	const std::string Records = State->Driver ? ConsacPlugin::ToFolderOrNone(RecordFolder) : std::string();
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
	return State->Driver ? State->Progress() : State->Last;
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
	const std::string Laws = ConsacPlugin::ToParameterLaws(EnvironmentParameters);
	if (!Laws.empty())
	{
		Arguments.Append({ TEXT("--set"), ConsacPlugin::FromUtf8("environment_parameters=" + Laws) });
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
