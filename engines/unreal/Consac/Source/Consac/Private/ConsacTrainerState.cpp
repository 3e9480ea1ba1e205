// Copyright CONSAC authors. MIT License.
#include "ConsacTrainerState.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacFarewell.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainer.h"
#include "ConsacTrainerDrivers.h"
#include "Engine/EngineBaseTypes.h"
#include "Engine/World.h"

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
	std::unique_ptr<FConsacHerd> Gathered = std::make_unique<FConsacHerd>();
	CONSAC_RETURN_IF_ERROR(Gathered->Gather(Agents, Trainer.RoomForAgents));
	ConsacPlugin::FDriverResult Made = ConsacPlugin::DriverFor(Trainer, Gathered->World());
	if (!Made.ok())
	{
		return Made.status();
	}
	Herd = std::move(Gathered);
	Driver = std::move(*Made);
	TicksPassed = 0;
	Ended = 0;
	bMet = bCompleted = false;
	if (!Trainer.RecordFolder.IsEmpty())
	{
		Herd->Record();
	}
	const UWorld* World = Trainer.GetWorld();
	if (World != nullptr && Trainer.bFixedStep && std::isfinite(Trainer.FixedStepSeconds) && Trainer.FixedStepSeconds > 0.0f)
	{
		Steps = std::make_unique<FConsacStepGuard>(static_cast<double>(Trainer.FixedStepSeconds), *World);
	}
	return Status::Ok();
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
		Last = ConsacPlugin::ToProgress(Driver->progress());
		Training.Driver = std::move(Driver);
		Herd->Release(Training);
		Training.ModelFolder = ModelFolder;
		Training.RecordFolder = RecordFolder;
	}
	const bool bSomething = Training.Driver != nullptr;
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
