// Copyright CONSAC authors. MIT License.
#include "ConsacTrainerDrivers.h"

#include "ConsacConvert.h"
#include "ConsacHyperparametersBase.h"
#include "ConsacModel.h"
#include "ConsacModelState.h"
#include "ConsacTrainer.h"
#include "UObject/UObjectGlobals.h"

namespace ConsacPlugin
{

static FDriverResult ServeFor(const AConsacTrainer& Trainer, consac::host::TickWorld& World)
{
	consac::host::ServeOptions Options;
	Options.endpoint.host = ToUtf8(Trainer.Host);
	Options.endpoint.port = Trainer.Port;
	Options.server.training_length = Trainer.TotalSteps;
	Options.server.model_name = ToUtf8(Trainer.ModelName);
	Options.server.token = ToUtf8(Trainer.Token);
	Options.server.seed = static_cast<std::uint64_t>(Trainer.Seed);
	return consac::host::Serve(World, Options);
}

static FDriverResult TrainFor(const AConsacTrainer& Trainer, consac::host::TickWorld& World)
{
	consac::host::TrainOptions Options;
	Options.total_steps = Trainer.TotalSteps;
	Options.seed = static_cast<std::uint64_t>(Trainer.Seed);
	Options.while_learning = Trainer.WhileLearning == EConsacWhileLearning::Wait ? consac::host::WhileLearning::kWait : consac::host::WhileLearning::kGoOn;
	if (IsValid(Trainer.Hyperparameters.Get()))
	{
		TArray<FConsacHyperparameter> Rows;
		Trainer.Hyperparameters->Collect(Rows);
		Options.algorithm = ToUtf8(Trainer.Hyperparameters->GetAlgorithm());
		for (const FConsacHyperparameter& Row : Rows)
		{
			Options.hyperparameters.push_back({ ToUtf8(Row.Name), ToUtf8(Row.Value) });
		}
	}
	Options.environment_parameters = ToParameterLaws(Trainer.EnvironmentParameters);
	Options.log_folder = ToFolderOrNone(Trainer.LogFolder);
	return consac::host::Train(World, Options);
}

// The file of a behaviour's model.
static consac::Result<std::vector<std::byte>> ModelBytes(const AConsacTrainer& Trainer, const std::string& Behaviour)
{
	for (const FConsacBehaviourModel& Row : Trainer.Models)
	{
		if (ToUtf8(Row.Behaviour) == Behaviour)
		{
			const UConsacModel* Model = Row.Model.Get();
			if (IsValid(Model))
			{
				const std::span<const std::byte> File = BytesOf(Model->GetFile());
				return !File.empty() ? consac::Result<std::vector<std::byte>>(std::vector<std::byte>(File.begin(), File.end()))
					: consac::Status(consac::StatusCode::kFailedPrecondition, "the Model given for behaviour '" + Behaviour + "' is empty; import a .consac file, or take it out of Models");
			}
			return consac::ReadFile(ToFile(Row.Path));
		}
	}
	return consac::Status(consac::StatusCode::kNotFound, "there is no model for behaviour '" + Behaviour + "'; give one in Models");
}

static FDriverResult ActFor(const AConsacTrainer& Trainer, consac::host::TickWorld& World)
{
	std::vector<std::vector<std::byte>> Files;
	for (const consac::BehaviourSpec& Behaviour : World.spec().behaviours)
	{
		consac::Result<std::vector<std::byte>> Bytes = ModelBytes(Trainer, Behaviour.name);
		if (!Bytes.ok())
		{
			return Bytes.status();
		}
		Files.push_back(std::move(*Bytes));
	}
	consac::host::ActOptions Options;
	Options.mode = Trainer.bDeterministic ? consac::ActionMode::kDeterministic : consac::ActionMode::kSample;
	Options.seed = static_cast<std::uint64_t>(Trainer.Seed);
	Options.pipelined = Trainer.bPipelined;
	return consac::host::Act(World, Files, Options);
}

FDriverResult DriverFor(const AConsacTrainer& Trainer, consac::host::TickWorld& World)
{
	switch (Trainer.Mode)
	{
	case EConsacMode::Serve:
		return ServeFor(Trainer, World);
	case EConsacMode::Train:
		return TrainFor(Trainer, World);
	case EConsacMode::Act:
		return ActFor(Trainer, World);
	case EConsacMode::ByHand:
		return consac::host::ByHand(World, static_cast<std::uint64_t>(Trainer.Seed));
	}
	return consac::Status(consac::StatusCode::kInvalidArgument, "no such mode");
}

}
