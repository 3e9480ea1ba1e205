// Copyright CONSAC authors. MIT License.
#include "ConsacBlueprintLibrary.h"

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "ConsacModel.h"
#include "ConsacSocket.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainer.h"
#include "Engine/Engine.h"
#include "Engine/GameInstance.h"
#include "Engine/World.h"
#include "UObject/UObjectGlobals.h"

// A new object that belongs to the game that asks for it, or to nobody where none does. Not to its world: who keeps the object
// beyond a travel would keep that world alive, and the travel ends with a fatal error.
template <class T>
static T* ConsacNew(const UObject* WorldContextObject)
{
	const UWorld* World = GEngine != nullptr && WorldContextObject != nullptr
		? GEngine->GetWorldFromContextObject(WorldContextObject, EGetWorldErrorMode::LogAndReturnNull) : nullptr;
	UGameInstance* Game = World != nullptr ? World->GetGameInstance() : nullptr;
	return Game != nullptr ? NewObject<T>(Game) : NewObject<T>();
}

UConsacSocket* UConsacBlueprintLibrary::CreateConsacSocket(UObject* WorldContextObject, const FString& Host, int32 Port)
{
	UConsacSocket* Socket = ConsacNew<UConsacSocket>(WorldContextObject);
	Socket->SetAddress(Host, Port);
	return Socket;
}

void UConsacBlueprintLibrary::CompileEnvironmentMessage(const FConsacSpace& ObservationSpace, const TArray<float>& Observation, float Reward, bool bDone,
	EConsacResult& Result, FString& Message, FString& Error)
{
	const consac::Result<consac::Space> Space = ConsacPlugin::ToSpace(ObservationSpace);
	Message = FString();
	if (!ConsacPlugin::Answer(Space.status(), Result, Error))
	{
		return;
	}
	std::vector<double> Numbers;
	for (float Number : Observation)
	{
		Numbers.push_back(static_cast<double>(Number));
	}
	const consac::Result<std::string> Text = consac::host::CompileEnvironmentMessage(*Space, Numbers, static_cast<double>(Reward), bDone);
	if (ConsacPlugin::Answer(Text.status(), Result, Error))
	{
		Message = ConsacPlugin::FromUtf8(*Text);
	}
}

void UConsacBlueprintLibrary::CompileTrainingData(const FConsacSpace& ActionSpace, const FConsacSpace& ObservationSpace, int64 TrainingLength,
	const FString& ModelName, EConsacResult& Result, FString& Message, FString& Error)
{
	consac::Result<consac::Space> Done = ConsacPlugin::ToSpace(ActionSpace);
	consac::Result<consac::Space> Seen = ConsacPlugin::ToSpace(ObservationSpace);
	Message = FString();
	if (!Done.ok() || !Seen.ok())
	{
		ConsacPlugin::Answer(Done.ok() ? Seen.status() : Done.status(), Result, Error);
		return;
	}
	consac::text1::Setup Setup;
	Setup.action_space = std::move(*Done);
	Setup.observation_space = std::move(*Seen);
	Setup.training_length = TrainingLength;
	Setup.model_name = ConsacPlugin::ToUtf8(ModelName);
	const consac::Result<std::string> Text = consac::host::CompileTrainingData(Setup);
	if (ConsacPlugin::Answer(Text.status(), Result, Error))
	{
		Message = ConsacPlugin::FromUtf8(*Text);
	}
}

void UConsacBlueprintLibrary::DecodeAction(const FConsacSpace& ActionSpace, const FString& Message, EConsacResult& Result, FConsacAction& Action, FString& Error)
{
	const consac::Result<consac::Space> Space = ConsacPlugin::ToSpace(ActionSpace);
	Action = FConsacAction();
	if (!ConsacPlugin::Answer(Space.status(), Result, Error))
	{
		return;
	}
	const consac::Result<std::vector<double>> Numbers = consac::host::DecodeAction(*Space, ConsacPlugin::ToUtf8(Message));
	if (ConsacPlugin::Answer(Numbers.status(), Result, Error))
	{
		for (double Number : *Numbers)
		{
			Action.Values.Add(static_cast<float>(Number));
		}
		Action.Choice = ActionSpace.Kind == EConsacSpaceKind::Discrete ? static_cast<int32>((*Numbers)[0]) : 0;
	}
}

void UConsacBlueprintLibrary::LoadConsacModel(UObject* WorldContextObject, const FString& Path, EConsacResult& Result, UConsacModel*& Model, FString& Error)
{
	UConsacModel* Loaded = ConsacNew<UConsacModel>(WorldContextObject);
	const bool bLoaded = Loaded->Load(Path, Error);
	Result = bLoaded ? EConsacResult::Success : EConsacResult::Failed;
	Model = bLoaded ? Loaded : nullptr;
}

void UConsacBlueprintLibrary::StartTrainerProgram(UObject* WorldContextObject, const FConsacProgramSettings& Settings, EConsacResult& Result,
	UConsacTrainerProgram*& Program, FString& Error)
{
	UConsacTrainerProgram* Started = ConsacNew<UConsacTrainerProgram>(WorldContextObject);
	const bool bStarted = Started->Start(Settings, TArray<FString>(), Error);
	Result = bStarted ? EConsacResult::Success : EConsacResult::Failed;
	Program = bStarted ? Started : nullptr;
}

void UConsacBlueprintLibrary::RecordStat(UObject* WorldContextObject, FName Name, float Value)
{
	const UConsacSubsystem* Subsystem = UConsacSubsystem::Of(WorldContextObject);
	if (AConsacTrainer* Trainer = Subsystem != nullptr ? Subsystem->GetTrainer() : nullptr)
	{
		Trainer->NoteStat(Name, Value);
	}
}

void UConsacBlueprintLibrary::AddGroupReward(UObject* WorldContextObject, FName Group, float Reward)
{
	const UConsacSubsystem* Subsystem = UConsacSubsystem::Of(WorldContextObject);
	if (AConsacTrainer* Trainer = Subsystem != nullptr ? Subsystem->GetTrainer() : nullptr)
	{
		Trainer->AddGroupReward(Group, Reward);
	}
}

FConsacSpace UConsacBlueprintLibrary::MakeBoxSpace(int32 Size, float Low, float High)
{
	FConsacSpace Space;
	Space.Size = Size;
	Space.Low.Add(Low);
	Space.High.Add(High);
	return Space;
}

FConsacSpace UConsacBlueprintLibrary::MakeDiscreteSpace(int32 Choices)
{
	FConsacSpace Space;
	Space.Kind = EConsacSpaceKind::Discrete;
	Space.Size = Choices;
	return Space;
}

void UConsacBlueprintLibrary::ForgetErrors()
{
	ConsacPlugin::ForgetErrors();
}
