// Copyright CONSAC authors. MIT License.
// What the Consac panel shows, as plain data, and the words that it says of it. How it is drawn is ConsacPanel.h.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCurve.h"
#include "ConsacFrameClock.h"
#include "ConsacLogTail.h"
#include "ConsacTypes.h"
#include "Misc/DateTime.h"

/** A Consac Trainer, or a Consac Environment, that plays. */
struct FConsacPanelTrainer
{
	/** As the editor's lists have it. */
	FString Name;
	/** What it is set to, in the words of the Details panel. */
	FString Mode;
	/** It drives agents now, or has its port open. */
	bool bRuns = false;
	/** It waits until another one of its world has gone. */
	bool bWaitsForTurn = false;
	/** A Consac Environment, which a graph starts and stops. */
	bool bGraph = false;
	/** Nothing keeps its frames from following each other. */
	bool bFullSpeed = true;
	/** The open port; 0 where none is. */
	int32 Port = 0;
	/** Agents of its world. */
	int32 Agents = 0;
	FConsacProgress Progress;
};

/** A model's file. */
struct FConsacPanelModel
{
	/** Below Saved/Consac of the project. */
	FString File;
	/** Of its latest change, in UTC. */
	FDateTime Changed;
	int64 Bytes = 0;
};

struct FConsacPanelState
{
	/** A game plays in the editor. */
	bool bPlays = false;
	/** The level that is open has a Consac Trainer. */
	bool bLevelHasTrainer = false;
	/** Those that play; the one that the curve and the times are of first. */
	TArray<FConsacPanelTrainer> Trainers;
	FConsacFrameTimes Times;
	FConsacCurve Curve;
	/** The latest first, and at most MostModels. */
	TArray<FConsacPanelModel> Models;
	/** How many more there are. */
	int32 MoreModels = 0;
	/** The latest first. */
	TArray<FConsacFault> Faults;
	/** When it was looked at: seconds of FPlatformTime, and the calendar's time in UTC. */
	double Now = 0.0;
	FDateTime NowUtc;

	static constexpr int32 MostModels = 8;
};

/** What is said of it: lines parted by \n; empty where there is nothing to say. */
namespace ConsacPanelWords
{

/** Who trains, how far it is, and what to do next. */
FString State(const FConsacPanelState& Panel);

/** Of the curve: what it is, from where to where. */
FString Curve(const FConsacPanelState& Panel);

/** Frames and steps a second, and where the time of a frame goes. */
FString Speed(const FConsacPanelState& Panel);

/** What takes most of the time, and what helps. */
FString Slow(const FConsacPanelState& Panel);

FString Models(const FConsacPanelState& Panel);
FString Faults(const FConsacPanelState& Panel);

/** "just now", "5 min ago". */
FString Ago(double Seconds);

}
