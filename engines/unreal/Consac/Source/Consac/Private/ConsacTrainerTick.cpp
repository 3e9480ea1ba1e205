// Copyright CONSAC authors. MIT License.
// A Consac Trainer from tick to tick.
#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "ConsacStats.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainer.h"
#include "ConsacTrainerState.h"
#include "Engine/Engine.h"
#include "Engine/World.h"
#include "Logging/LogMacros.h"
#include "Misc/App.h"
#include "UObject/UObjectGlobals.h"
#include "UObject/WeakObjectPtrTemplates.h"

namespace ConsacPlugin
{

// A list, which is empty afterwards.
static std::vector<TWeakObjectPtr<UConsacAgentComponent>> Taken(std::vector<TWeakObjectPtr<UConsacAgentComponent>>& List)
{
	return std::exchange(List, {});
}

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

// Where a decision stands for several ticks, or for the tick after, there is nothing to take twice in one.
int32 AConsacTrainer::StepsPerTick(int32 Period) const
{
	return Period == 1 && !bPipelined && MaxStepsPerTick > 1 ? MaxStepsPerTick : 1;
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
			const consac::Status Status = State->Welcome(*this, *Agent);
			if (!Status.ok())
			{
				Report(ConsacPlugin::FromUtf8(Status.message()));
			}
		}
	}
	const int32 Steps = State->Driver ? StepsPerTick(State->Herd->Period()) : 1;
	const bool bWaits = bLockStep || FApp::IsUnattended();
	const double Until = consac::Now() + (bWaits ? ConsacPlugin::ToSeconds(MaxWaitSeconds) : 0.0); // of all steps together
	for (int32 Step = 0; Step < Steps && State->Driver && !State->bStopWanted; ++Step)
	{
		const bool bMore = DoStep(Until);
		State->StepFurther(*this);
		if (!bMore)
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
	FConsacHerd& Herd = *State->Herd;
	const auto Poll = [this, Until, &Herd, Looks = Herd.Looks()]
	{
		const bool bLater = Herd.IsPipelined() && Herd.Looks() != Looks; // the next tick waits for that
		return State->Poll(bLater ? 0.0 : Until - consac::Now());
	};
	const auto Hear = [this](const consac::Status& Status)
	{
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
		return !State->bStopWanted;
	};
	return ConsacPlugin::StepHerd(Herd, State->TicksPassed, Mode == EConsacMode::ByHand, Poll, Hear);
}

void AConsacTrainer::Complete()
{
	State->bCompleted = State->bUntold = true;
	const std::string Folder = ConsacPlugin::ToFolderOrNone(SaveFolder);
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

void AConsacTrainer::NoteStat(FName Name, float Value)
{
	if (State->Driver)
	{
		ConsacPlugin::NoteOrLog(State->Herd->World(), Name, Value);
	}
}

void AConsacTrainer::AddGroupReward(FName Group, float Reward)
{
	if (!State->Driver || Group == NAME_None)
	{
		return;
	}
	if (!std::isfinite(Reward))
	{
		ConsacPlugin::LogError(FString::Printf(TEXT("a reward of the group '%s' is not finite and is left out; check what was divided by zero"), *ConsacPlugin::FromUtf8(ConsacPlugin::ToKey(Group))));
		return;
	}
	State->Herd->AddGroupReward(Group, Reward);
	for (const FConsacFurther& Others : State->Further)
	{
		Others.Herd->AddGroupReward(Group, Reward);
	}
}

// The means of the game's own numbers since the latest line.
FString AConsacTrainer::TakeStats()
{
	FString Text;
	for (const consac::Statistic& Mean : State->Herd->World().TakeMeans())
	{
		Text = FString::Printf(TEXT("%s, %s %.6g"), *Text, *ConsacPlugin::FromUtf8(Mean.name), Mean.value);
	}
	return Text;
}

void AConsacTrainer::ShowAgents()
{
	constexpr uint64 FirstKey = 0xC0A5AC00; // a line takes the place of its agent's line before
	constexpr int32 Most = 20;
	uint64 Key = FirstKey;
	for (const FString& Line : State->Herd->Describe(Most))
	{
		GEngine->AddOnScreenDebugMessage(Key++, 1.0f, FColor(255, 255, 255), Line);
	}
}

void AConsacTrainer::Show()
{
	const FConsacProgress Progress = GetTrainerProgress();
	ConsacPlugin::ShowStats(Progress);
	if (bShowAgents && GEngine != nullptr)
	{
		ShowAgents();
	}
	const double Now = consac::Now();
	if (LogSeconds > 0.0f && Now - State->LoggedAt >= static_cast<double>(LogSeconds))
	{
		State->LoggedAt = Now;
		UE_LOG(LogConsac, Log, TEXT("%s: step %lld of %lld, %.0f steps/s, %.3f ms a step, %lld episodes, mean reward %.3f%s"), *Progress.State, Progress.Steps,
			Progress.TotalSteps, Progress.StepsPerSecond, Progress.PollMilliseconds, Progress.Episodes, Progress.MeanEpisodeReward, *TakeStats());
	}
}
