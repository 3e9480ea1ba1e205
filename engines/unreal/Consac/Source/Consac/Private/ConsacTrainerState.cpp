// Copyright CONSAC authors. MIT License.
#include "ConsacTrainerState.h"

#include "Components/SceneComponent.h"
#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacFarewell.h"
#include "ConsacLog.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainer.h"
#include "ConsacTrainerDrivers.h"
#include "Engine/EngineBaseTypes.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"
#include "Logging/LogMacros.h"

namespace ConsacPlugin
{

// What moves by physics stands still from one step of a tick to the next; Period: ticks from one decision to the next.
static consac::Status CheckSteps(const AConsacTrainer& Trainer, int32 Period, const UConsacAgentComponent& Agent)
{
	const AActor* Actor = Agent.GetOwner();
	if (Actor == nullptr || Trainer.StepsPerTick(Period) == 1)
	{
		return consac::Status::Ok();
	}
	TArray<USceneComponent*> Parts;
	Actor->GetComponents(Parts);
	for (const USceneComponent* Part : Parts)
	{
		if (Part->IsSimulatingPhysics())
		{
			return consac::Status(consac::StatusCode::kInvalidArgument, "Max Steps Per Tick is " + std::to_string(Trainer.MaxStepsPerTick) + ", and " +
				ToUtf8(Actor->GetName()) + " moves by physics, which stands still from one step of a tick to the next; set it to 1");
		}
	}
	return consac::Status::Ok();
}

// Agents together with who decides for them, as the trainer's properties say.
// @param First Whose steps theirs follow; null where they are the first.
static consac::Status MakeHerd(const AConsacTrainer& Trainer, const FConsacHerd* First, const TArray<UConsacAgentComponent*>& Agents, int32 Room, FConsacFurther& Into)
{
	Into.Herd = std::make_unique<FConsacHerd>();
	CONSAC_RETURN_IF_ERROR(Into.Herd->Gather(Agents, Room, Trainer.EnvironmentParameters));
	for (const UConsacAgentComponent* Agent : Agents)
	{
		CONSAC_RETURN_IF_ERROR(CheckSteps(Trainer, (First != nullptr ? First : Into.Herd.get())->Period(), *Agent));
	}
	FDriverResult Made = DriverFor(Trainer, Into.Herd->World());
	if (!Made.ok())
	{
		return Made.status();
	}
	Into.Driver = std::move(*Made);
	if (Trainer.bPipelined)
	{
		Into.Herd->Pipeline();
	}
	if (!Trainer.RecordFolder.IsEmpty())
	{
		Into.Herd->Record();
	}
	return consac::Status::Ok();
}

}

bool FConsacTrainerState::IsAway(const AConsacTrainer& Trainer)
{
	const UWorld* World = Trainer.GetWorld();
	return World != nullptr && World->GetNetMode() == NM_Client;
}

consac::Status FConsacTrainerState::MayBegin(const AConsacTrainer& Trainer) const
{
	using consac::Status;
	using consac::StatusCode;
	const UConsacSubsystem* Subsystem = UConsacSubsystem::Of(&Trainer);
	if (IsAway(Trainer))
	{
		return Status(StatusCode::kFailedPrecondition, "this is a client of a network game; its server trains");
	}
	if (Subsystem == nullptr || bOver)
	{
		return Status(StatusCode::kFailedPrecondition, Subsystem == nullptr ? "the game does not run" : "this Consac Trainer plays no more");
	}
	const AConsacTrainer* const Driving = Subsystem->GetTrainer(); // none before this one begins to play
	if (Driving != nullptr && Driving != &Trainer)
	{
		return Status(StatusCode::kFailedPrecondition, "another Consac Trainer drives the agents of this world; it is this one's turn once that has gone");
	}
	return Status::Ok();
}

consac::Status FConsacTrainerState::Begin(AConsacTrainer& Trainer)
{
	using consac::Status;
	using consac::StatusCode;
	CONSAC_RETURN_IF_ERROR(MayBegin(Trainer));
	if (Driver)
	{
		return Status(StatusCode::kFailedPrecondition, "the training has begun already; Stop Training ends it");
	}
	const TArray<UConsacAgentComponent*> Agents = UConsacSubsystem::Of(&Trainer)->GetAgents();
	if (Agents.IsEmpty())
	{
		return Status(StatusCode::kFailedPrecondition, "there is no actor with a Consac Agent");
	}
	FConsacFurther Made;
	CONSAC_RETURN_IF_ERROR(ConsacPlugin::MakeHerd(Trainer, nullptr, Agents, Trainer.RoomForAgents, Made));
	Herd = std::move(Made.Herd);
	Driver = std::move(Made.Driver);
	bOpen = Trainer.Mode == EConsacMode::Act || Trainer.Mode == EConsacMode::ByHand;
	TicksPassed = 0;
	Ended = 0;
	bMet = bCompleted = false;
	if (!bOpen && Trainer.bFullSpeed && !Trainer.bFixedStep)
	{
		UE_LOG(LogConsac, Display, TEXT("without Fixed Step a tick is as long as it takes: at full speed things that move, timers and physics get less far from one decision to the next than in the game; with it they get as far"));
	}
	const UWorld* World = Trainer.GetWorld();
	if (World != nullptr && Trainer.bFixedStep && std::isfinite(Trainer.FixedStepSeconds) && Trainer.FixedStepSeconds > 0.0f)
	{
		Steps = std::make_unique<FConsacStepGuard>(static_cast<double>(Trainer.FixedStepSeconds), *World);
	}
	return Status::Ok();
}

consac::Status FConsacTrainerState::Welcome(AConsacTrainer& Trainer, UConsacAgentComponent& Agent)
{
	using consac::Status;
	using consac::StatusCode;
	CONSAC_RETURN_IF_ERROR(ConsacPlugin::CheckSteps(Trainer, Herd->Period(), Agent));
	const Status Joined = Herd->Join(Agent);
	const bool bNoPlace = Joined.code() == StatusCode::kResourceExhausted;
	if (Joined.ok() || !(bNoPlace || Joined.code() == StatusCode::kNotFound))
	{
		return Joined;
	}
	if (!bOpen)
	{
		return bNoPlace ? Status(Joined.code(), Joined.message() + "; this one takes no part. Room For Agents is for more than there are at the beginning") : Joined;
	}
	for (FConsacFurther& Others : Further)
	{
		if (Others.Herd->Join(Agent).ok())
		{
			return Status::Ok();
		}
	}
	constexpr int32 Fewest = 8, Most = 1024;
	int32 Room = std::max(Fewest, Trainer.RoomForAgents);
	for (std::size_t Herds = 0; Herds < Further.size() && Room < Most; ++Herds)
	{
		Room *= 2; // few herds for many agents
	}
	TArray<UConsacAgentComponent*> Agents;
	Agents.Add(&Agent);
	FConsacFurther Made;
	CONSAC_RETURN_IF_ERROR(ConsacPlugin::MakeHerd(Trainer, Herd.get(), Agents, Room, Made));
	Further.push_back(std::move(Made));
	return Status::Ok();
}

void FConsacTrainerState::StepFurther(AConsacTrainer& Trainer)
{
	for (std::size_t Index = 0; Index < Further.size() && !bStopWanted; ++Index)
	{
		FConsacFurther& Others = Further[Index];
		const auto Hear = [this, &Trainer](const consac::Status& Status)
		{
			if (!Status.ok())
			{
				Trainer.Report(ConsacPlugin::FromUtf8(Status.message()));
			}
			return !bStopWanted;
		};
		ConsacPlugin::StepHerd(*Others.Herd, Others.TicksPassed, Trainer.Mode == EConsacMode::ByHand, [&Others] { return Others.Driver->Poll(0.0); }, Hear);
	}
}

FConsacProgress FConsacTrainerState::Progress() const
{
	FConsacProgress Now = ConsacPlugin::ToProgress(Driver->progress());
	double Rewards = Now.MeanEpisodeReward * static_cast<double>(Now.Episodes);
	for (const FConsacFurther& Others : Further)
	{
		const FConsacProgress Theirs = ConsacPlugin::ToProgress(Others.Driver->progress());
		Now.Steps += Theirs.Steps;
		Now.StepsPerSecond += Theirs.StepsPerSecond;
		Now.Episodes += Theirs.Episodes;
		Rewards += Theirs.MeanEpisodeReward * static_cast<double>(Theirs.Episodes);
	}
	if (!Further.empty() && Now.Episodes > 0)
	{
		Now.MeanEpisodeReward = Rewards / static_cast<double>(Now.Episodes); // each herd's mean counts by its episodes
	}
	return Now;
}

consac::Status FConsacTrainerState::Poll(double WaitSeconds)
{
	// Nobody is waited for who has not come.
	const consac::Status Status = Driver->Poll(bMet ? std::max(WaitSeconds, 0.0) : 0.0);
	const bool bLeft = Driver->ended() != Ended;
	Ended = Driver->ended();
	bMet = Status.ok() && ((bMet && !bLeft) || Herd->World().cue() != consac::host::Cue::kWait);
	return Status;
}

std::string FConsacTrainerState::Keep(const std::string& Folder)
{
	FConsacFarewell Writing;
	const std::string Fault = ConsacPlugin::CollectModels(*Driver, Herd->Behaviours(), Folder, ".consac", Writing.Models);
	Keeping = Writing.Models.empty() ? nullptr : &ConsacPlugin::SendOut(std::move(Writing));
	return Fault;
}

bool FConsacTrainerState::HasKept(double MostSeconds)
{
	return Keeping == nullptr || ConsacPlugin::IsOut(*Keeping, MostSeconds);
}

std::string FConsacTrainerState::LeaveKeeping()
{
	ConsacPlugin::FLeaving* const One = std::exchange(Keeping, nullptr);
	return One != nullptr ? ConsacPlugin::Leave(*One) : std::string();
}

void FConsacTrainerState::SetSpeed(bool bFast)
{
	if (!bFast)
	{
		Speed.reset();
	}
	else if (!Speed)
	{
		Speed = std::make_unique<FConsacSpeedGuard>();
	}
}

std::string FConsacTrainerState::End(const std::string& ModelFolder, const std::string& RecordFolder, double MostSeconds)
{
	FConsacFarewell Training;
	if (Driver)
	{
		Last = Progress();
		Training.Driver = std::move(Driver);
		Herd->Release(Training);
		Training.ModelFolder = ModelFolder;
		Training.RecordFolder = RecordFolder;
	}
	const bool bSomething = Training.Driver != nullptr;
	for (FConsacFurther& Others : std::exchange(Further, {}))
	{
		FConsacFarewell Theirs;
		Theirs.Driver = std::move(Others.Driver);
		Others.Herd->Release(Theirs);
		Theirs.RecordFolder = RecordFolder;
		if (!RecordFolder.empty())
		{
			ConsacPlugin::Leave(ConsacPlugin::SendOut(std::move(Theirs)));
		}
	}
	Herd.reset();
	Steps.reset();
	Speed.reset();
	Newcomers.clear();
	bMet = bStopWanted = bPaused = bUntold = false;
	const std::string Fault = LeaveKeeping();
	if (!bSomething)
	{
		return Fault;
	}
	ConsacPlugin::FLeaving& Leaving = ConsacPlugin::SendOut(std::move(Training));
	ConsacPlugin::IsOut(Leaving, MostSeconds);
	const std::string Found = ConsacPlugin::Leave(Leaving);
	return Found.empty() ? Fault : Found;
}
