// Copyright CONSAC authors. MIT License.
#include "ConsacEnvironmentComponent.h"

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "ConsacModel.h"
#include "ConsacModelState.h"
#include "ConsacStats.h"
#include "ConsacStepGuard.h"
#include "Engine/EngineBaseTypes.h"
#include "Engine/World.h"
#include "Templates/PimplPtr.h"
#include "UObject/UObjectGlobals.h"

// What the next call of Training brings.
enum class EConsacExpected : uint8
{
	Nothing,     // nothing was asked for
	First,       // the first observation after a reset
	Outcome,     // what came of an action
	AfterEnding  // the first observation after an episode that ended with its action
};

struct FConsacEnvironmentState
{
	std::unique_ptr<consac::host::TickWorld> World;    // none before Setup Environment
	std::unique_ptr<consac::host::Driver> Driver;      // none before Training Connection or Model Connection
	consac::host::ServeOptions Options;
	consac::host::AgentId Agent = consac::host::kNoAgent;
	EConsacExpected Expected = EConsacExpected::Nothing;
	int64 Ended = 0;          // sessions of the driver that came to an end
	bool bConnected = false;  // the driver has asked for something
	bool bCompleted = false;  // until Setup Environment or Model Connection
	bool bPaused = false;     // the driver was told so
	bool bServes = false;     // a trainer decides, and no model
	std::unique_ptr<FConsacSpeedGuard> Speed;
	FConsacProgress Last;     // of what has ended

	void DropDriver()
	{
		if (Driver)
		{
			Last = ConsacPlugin::ToProgress(Driver->progress());
		}
		Driver.reset();
		if (World)
		{
			World->Abandon();
		}
		Expected = EConsacExpected::Nothing;
		Ended = 0;
		bConnected = false;
		bPaused = false;
		bServes = false;
		Speed.reset();
	}

	const consac::BehaviourSpec& Behaviour() const { return World->spec().behaviours[0]; }

	/** Polls and notes what came of it. */
	consac::Status Poll(double WaitSeconds)
	{
		const consac::Status Status = Driver->Poll(WaitSeconds);
		const bool bLeft = std::exchange(Ended, Driver->ended()) != Driver->ended();
		if (!Status.ok() || bLeft)
		{
			Expected = EConsacExpected::Nothing;
			bConnected = false;
		}
		bConnected = bConnected || World->cue() != consac::host::Cue::kWait;
		return Status;
	}
};

namespace ConsacPlugin
{

static consac::Status NotSetUp()
{
	return consac::Status(consac::StatusCode::kFailedPrecondition, "Setup Environment has not been called, or failed");
}

// Hands over what was expected. Leaves everything as it was when the observation does not fit.
static consac::Status HandOver(FConsacEnvironmentState& State, const TArray<float>& Observation, float Reward, bool bDone, bool& bEnding)
{
	using consac::host::Cue;
	consac::host::TickWorld& World = *State.World;
	const EConsacExpected Expected = State.Expected;
	const bool bAct = World.cue() == Cue::kAct && (Expected == EConsacExpected::Outcome || Expected == EConsacExpected::AfterEnding);
	const bool bFirst = World.cue() == Cue::kReset && Expected == EConsacExpected::First;
	bEnding = false;
	if (!bAct && !bFirst)
	{
		State.Expected = EConsacExpected::Nothing;
		return consac::Status::Ok();
	}
	CONSAC_RETURN_IF_ERROR(WriteRow(State.Behaviour().observation_layout, World.Observation(State.Agent), Observation.GetData(), Observation.Num()));
	if (Expected == EConsacExpected::Outcome)
	{
		World.AddReward(State.Agent, Reward);
		if (bDone)
		{
			World.EndEpisode(State.Agent, consac::host::EpisodeEnd::kTerminated);
		}
		if (World.Ending(State.Agent))
		{
			std::memcpy(World.FinalObservation(State.Agent), World.Observation(State.Agent), State.Behaviour().observation_layout.row_bytes);
			State.Expected = EConsacExpected::AfterEnding;
			bEnding = true;
			return consac::Status::Ok();
		}
	}
	State.Expected = EConsacExpected::Nothing;
	return World.Offer();
}

}

UConsacEnvironmentComponent::UConsacEnvironmentComponent()
	: State(MakePimpl<FConsacEnvironmentState>())
{
	// To tell the trainer that the game is paused, or goes on: a graph's own tick stands still then. And for full speed.
	PrimaryComponentTick.bCanEverTick = true;
	PrimaryComponentTick.bTickEvenWhenPaused = true;
}

void UConsacEnvironmentComponent::SetupEnvironment(const FConsacSpace& ObservationSpace, const FConsacSpace& ActionSpace, int64 TrainingLength,
	const FString& ModelName, EConsacResult& Result, FString& Error, const FString& Host, int32 Port)
{
	consac::Result<consac::Space> Seen = ConsacPlugin::ToSpace(ObservationSpace);
	consac::Result<consac::Space> Done = ConsacPlugin::ToSpace(ActionSpace);
	if (!Seen.ok() || !Done.ok())
	{
		ConsacPlugin::Answer(Seen.ok() ? Done.status() : Seen.status(), Result, Error);
		return;
	}
	if (TrainingLength < 0 || Port < 0 || Port > 65535)
	{
		ConsacPlugin::Answer(consac::Status(consac::StatusCode::kInvalidArgument,
			"a training length is 0 or more, a port 0 to 65535; given are " + std::to_string(TrainingLength) + " and " + std::to_string(Port)), Result, Error);
		return;
	}
	consac::host::Offering Offering;
	Offering.observations.push_back({ "observation", std::move(*Seen) });
	Offering.actions.push_back({ "action", std::move(*Done) });
	consac::host::TickWorldOptions Options;
	Options.offerings.push_back(std::move(Offering));
	consac::Result<std::vector<consac::ParameterSpec>> Parameters = ConsacPlugin::ToParameters(EnvironmentParameters);
	if (!ConsacPlugin::Answer(Parameters.status(), Result, Error))
	{
		return;
	}
	Options.parameters = std::move(*Parameters);
	Options.notes = true;
	consac::Result<std::unique_ptr<consac::host::TickWorld>> World = consac::host::TickWorld::Create(std::move(Options));
	if (!ConsacPlugin::Answer(World.status(), Result, Error))
	{
		return;
	}
	const consac::Result<consac::host::AgentId> Agent = (*World)->Join(0);
	if (!ConsacPlugin::Answer(Agent.status(), Result, Error))
	{
		return;
	}
	// What was under way ends only now that nothing can fail any more.
	CloseTraining();
	State->bCompleted = false;
	State->Last = FConsacProgress();
	State->World = std::move(*World);
	State->Agent = *Agent;
	State->Options = consac::host::ServeOptions();
	State->Options.endpoint.host = ConsacPlugin::ToUtf8(Host);
	State->Options.endpoint.port = Port;
	State->Options.server.training_length = TrainingLength;
	State->Options.server.model_name = ConsacPlugin::ToUtf8(ModelName);
}

void UConsacEnvironmentComponent::TrainingConnection(EConsacConnection& Connection, FString& Error)
{
	Connection = EConsacConnection::Failed;
	if (!State->World)
	{
		ConsacPlugin::Explain(ConsacPlugin::NotSetUp(), Error);
		return;
	}
	const bool bOpens = !State->Driver && !State->bCompleted;
	if (bOpens && GetWorld() != nullptr && GetWorld()->GetNetMode() == NM_Client)
	{
		ConsacPlugin::Explain(consac::Status(consac::StatusCode::kFailedPrecondition, "this is a client of a network game; its server trains"), Error);
		return;
	}
	if (bOpens)
	{
		consac::Result<std::unique_ptr<consac::host::Driver>> Driver = consac::host::Serve(*State->World, State->Options);
		if (!ConsacPlugin::Explain(Driver.status(), Error))
		{
			return;
		}
		State->Driver = std::move(*Driver);
		State->bServes = true;
	}
	if (!ConsacPlugin::Explain(State->bCompleted ? consac::Status::Ok() : State->Poll(0.0), Error))
	{
		return;
	}
	if (State->bCompleted || State->Driver->finished())
	{
		// First the pin: On Training Completed may close everything.
		Connection = EConsacConnection::Completed;
		Complete();
		return;
	}
	Connection = State->bConnected ? EConsacConnection::Connected : EConsacConnection::Waiting;
}

void UConsacEnvironmentComponent::Train(const TArray<float>& Observation, float Reward, bool bDone, EConsacTraining& Training, FConsacAction& Action, FString& Error)
{
	Action = FConsacAction();
	Training = EConsacTraining::Failed;
	bool bEnding = false;
	consac::Status Status = State->World ? consac::Status::Ok() : ConsacPlugin::NotSetUp();
	if (Status.ok() && !State->Driver && !State->bCompleted)
	{
		Status = consac::Status(consac::StatusCode::kFailedPrecondition, "nobody is connected; call Training Connection or Model Connection first");
	}
	if (Status.ok() && !State->bCompleted)
	{
		Status = ConsacPlugin::HandOver(*State, Observation, Reward, bDone, bEnding);
	}
	if (Status.ok() && !State->bCompleted && !bEnding)
	{
		const double Wait = std::isfinite(LoopWaitSeconds) ? std::clamp(static_cast<double>(LoopWaitSeconds), 0.0, 60.0) : 0.0;
		Status = State->Poll(Wait);
		ConsacPlugin::ShowStats(ConsacPlugin::ToProgress(State->Driver->progress()));
	}
	if (!ConsacPlugin::Explain(Status, Error))
	{
		return;
	}
	if (bEnding)
	{
		Training = EConsacTraining::Reset;
	}
	else if (State->bCompleted || State->Driver->finished())
	{
		Training = EConsacTraining::Completed;
		Complete();
	}
	else if (State->World->cue() == consac::host::Cue::kReset)
	{
		State->Expected = EConsacExpected::First;
		Training = EConsacTraining::Reset;
	}
	else if (State->World->cue() == consac::host::Cue::kAct)
	{
		State->Expected = EConsacExpected::Outcome;
		Action = ConsacPlugin::ToAction(State->Behaviour().action_layout, State->World->Action(State->Agent));
		Training = EConsacTraining::Step;
	}
	else
	{
		Training = EConsacTraining::Waiting;
	}
}

float UConsacEnvironmentComponent::GetTrainingParameter(FName Name) const
{
	consac::Result<double> Value = ConsacPlugin::DefaultOf(EnvironmentParameters, Name);
	if (State->World)
	{
		const consac::Result<std::size_t> At = State->World->ParameterNamed(ConsacPlugin::ToKey(Name));
		Value = At.ok() ? consac::Result<double>(State->World->Parameter(State->Agent, *At)) : At.status();
	}
	return ConsacPlugin::ValueOrLog(Name, Value);
}

void UConsacEnvironmentComponent::RecordTrainingStat(FName Name, float Value)
{
	if (State->World)
	{
		ConsacPlugin::NoteOrLog(*State->World, Name, Value);
	}
}

bool UConsacEnvironmentComponent::IsTrainingCompleted() const
{
	return State->bCompleted;
}

void UConsacEnvironmentComponent::ModelConnection(UConsacModel* Model, EConsacResult& Result, FString& Error)
{
	consac::Status Status = State->World ? consac::Status::Ok() : ConsacPlugin::NotSetUp();
	if (Status.ok() && (!IsValid(Model) || Model->GetFile().IsEmpty()))
	{
		Status = consac::Status(consac::StatusCode::kFailedPrecondition, "there is no model; connect an asset, or the one that Load Model gave");
	}
	if (Status.ok())
	{
		const std::span<const std::byte> File = ConsacPlugin::BytesOf(Model->GetFile());
		const std::vector<std::byte> Bytes(File.begin(), File.end());
		consac::Result<std::unique_ptr<consac::host::Driver>> Driver = consac::host::Act(*State->World, std::span(&Bytes, 1), consac::host::ActOptions());
		Status = Driver.status();
		if (Driver.ok())
		{
			State->DropDriver();
			State->bCompleted = false;
			State->Driver = std::move(*Driver);
		}
	}
	ConsacPlugin::Answer(Status, Result, Error);
}

void UConsacEnvironmentComponent::CloseTraining()
{
	State->DropDriver();
}

void UConsacEnvironmentComponent::Complete()
{
	if (!State->bCompleted)
	{
		State->DropDriver(); // nobody else is served: the port is closed
		State->bCompleted = true;
		OnTrainingCompleted.Broadcast();
	}
}

FConsacProgress UConsacEnvironmentComponent::GetTrainingProgress() const
{
	return State->Driver ? ConsacPlugin::ToProgress(State->Driver->progress()) : State->Last;
}

int32 UConsacEnvironmentComponent::GetTrainingPort() const
{
	return State->Driver ? State->Driver->port() : 0;
}

void UConsacEnvironmentComponent::TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction)
{
	const UWorld* World = GetWorld();
	const bool bPaused = World != nullptr && World->IsPaused();
	if (State->Driver && State->bPaused != bPaused)
	{
		State->bPaused = bPaused;
		State->Driver->SetPaused(bPaused);
	}
	// Nothing makes frames wait while somebody trains.
	const bool bFast = bFullSpeed && !bPaused && State->bServes && State->bConnected;
	if (!bFast)
	{
		State->Speed.reset();
	}
	else if (!State->Speed)
	{
		State->Speed = std::make_unique<FConsacSpeedGuard>();
	}
	if (!bPaused)
	{
		Super::TickComponent(DeltaTime, TickType, ThisTickFunction);
	}
}

void UConsacEnvironmentComponent::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	CloseTraining();
	Super::EndPlay(EndPlayReason);
}

void UConsacEnvironmentComponent::BeginDestroy()
{
	if (State.IsValid()) // a temporary object of Hot Reload has none
	{
		CloseTraining();
	}
	Super::BeginDestroy();
}
