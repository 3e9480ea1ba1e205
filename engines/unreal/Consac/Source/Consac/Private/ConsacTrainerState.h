// Copyright CONSAC authors. MIT License.
// What is behind an AConsacTrainer: one training from its beginning to its end.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"
#include "ConsacHerd.h"
#include "ConsacStepGuard.h"
#include "ConsacTypes.h"
#include "UObject/WeakObjectPtrTemplates.h"

class AConsacTrainer;
class UConsacAgentComponent;

namespace ConsacPlugin
{
struct FLeaving;
}

namespace ConsacPlugin
{

/** What came of a herd's decision, whose ticks have passed, and the next cue. The first failure of several. */
template <class TPoll>
consac::Status Decide(FConsacHerd& Herd, const TPoll& Poll)
{
	consac::Status Status = Herd.IsActing() ? Herd.Settle() : consac::Status();
	const auto Note = [&Status](consac::Status Next)
	{
		if (Status.ok())
		{
			Status = std::move(Next);
		}
	};
	Note(Poll());
	if (Herd.World().cue() == consac::host::Cue::kReset)
	{
		Note(Herd.Begin());
		Note(Poll());
	}
	return Status;
}

/** What is due of a herd in a tick: what came of its decision, and the next one. Pipelined, what is seen decides what is done a tick later: a decision is
 *  carried out, and what the agents see a tick before the next one is handed to the driver. Whether a decision was carried out.
 *  @param Poll Asks the driver.
 *  @param Hear Gets what went wrong, or nothing, before the decision is carried out; false where it is not to be. */
template <class TPoll, class THear>
bool StepHerd(FConsacHerd& Herd, int32& TicksPassed, bool bByHand, const TPoll& Poll, const THear& Hear)
{
	if (Herd.IsActing() && ++TicksPassed < Herd.Period())
	{
		return false;
	}
	const int64 Looks = Herd.Looks();
	const bool bGoesOn = Hear(Decide(Herd, Poll));
	const bool bJustSeen = Herd.IsPipelined() && Herd.Looks() != Looks;
	if (!bGoesOn || bJustSeen || Herd.World().cue() != consac::host::Cue::kAct)
	{
		return false;
	}
	TicksPassed = Herd.IsPipelined() ? 1 : 0;
	Herd.Act(bByHand);
	if (TicksPassed >= Herd.Period() && Herd.IsActing() && Hear(consac::Status()))
	{
		Hear(Decide(Herd, Poll));
	}
	return true;
}

}

/** Agents that came where nobody learns and found no place: a herd of their own, by the same models or rules. */
struct FConsacFurther
{
	// In this order: the driver goes before the world that it drives.
	std::unique_ptr<FConsacHerd> Herd;
	std::unique_ptr<consac::host::Driver> Driver;
	int32 TicksPassed = 0;
};

struct FConsacTrainerState
{
	// In this order: the driver goes before the world that it drives.
	std::unique_ptr<FConsacHerd> Herd;
	std::unique_ptr<consac::host::Driver> Driver;
	std::unique_ptr<FConsacStepGuard> Steps;
	std::unique_ptr<FConsacSpeedGuard> Speed;
	std::vector<FConsacFurther> Further;
	bool bOpen = false;          // nobody learns: whoever comes finds a place
	int32 TicksPassed = 0;
	int64 Ended = 0;             // sessions of the driver that came to an end
	bool bStarted = false;       // it has begun or was stopped once: nothing begins by itself any more
	bool bMet = false;           // somebody decides: a trainer is connected, a learner or a model has begun
	bool bCompleted = false;
	bool bUntold = false;        // of that, since its models are not written yet
	ConsacPlugin::FLeaving* Keeping = nullptr; // who writes them
	bool bBusy = false;          // agents' events are under way
	bool bStopWanted = false;    // one of them has called Stop Training, or a stop is under way
	bool bStartWanted = false;   // and Start Training after it
	bool bPaused = false;        // the driver was told so
	bool bTicked = false;        // since it began to play: whoever begins to play with the level plays by then
	bool bAsked = false;         // Start Training was called before that
	bool bOver = false;          // it has ended to play
	std::vector<TWeakObjectPtr<UConsacAgentComponent>> Newcomers;
	double LoggedAt = 0.0;
	double TryAgainAt = 0.0;     // when to start once more: no agent is there, or another game has the port
	std::string Told;            // why it could not start
	FConsacProgress Last;        // of what has ended

	/** Whether this is a client of a network game. */
	static bool IsAway(const AConsacTrainer& Trainer);
	/** Whether this trainer is one that may begin at all, now or once it plays. */
	consac::Status MayBegin(const AConsacTrainer& Trainer) const;
	/** Gathers the agents and begins. */
	consac::Status Begin(AConsacTrainer& Trainer);
	/** Gives an agent that comes meanwhile a place. The error says why there is none. */
	consac::Status Welcome(AConsacTrainer& Trainer, UConsacAgentComponent& Agent);
	/** A step of those that found no place among the others. */
	void StepFurther(AConsacTrainer& Trainer);
	/** How it stands. */
	FConsacProgress Progress() const;
	/** Polls the driver, for at most so long, and notes what came of it. */
	consac::Status Poll(double WaitSeconds);
	/** Begins to write what was learned into a folder. What went wrong, or nothing. */
	std::string Keep(const std::string& Folder);
	/** Whether that is done; waits for it at most so long. */
	bool HasKept(double MostSeconds);
	/** Asks no more for it. What went wrong with it so far, or nothing. */
	std::string LeaveKeeping();
	/** Frames wait for nothing while it trains. */
	void SetSpeed(bool bFast);
	/** Ends it: agents are free and settings are back at once, what takes longer than `MostSeconds` goes on by itself. What went
	 *  wrong, or nothing.
	 *  @param ModelFolder Where to keep what was learned; empty: nowhere. RecordFolder likewise. */
	std::string End(const std::string& ModelFolder, const std::string& RecordFolder, double MostSeconds);
};
