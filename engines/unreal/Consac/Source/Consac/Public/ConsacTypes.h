// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTypes.generated.h"

/** Whether a node did what it was asked for. */
UENUM(BlueprintType)
enum class EConsacResult : uint8
{
	/** It did. */
	Success,
	/** It did not; Error says why. Everything is as before, unless the node says otherwise. */
	Failed
};

/** Answer of a node that looks whether something is there. */
UENUM(BlueprintType)
enum class EConsacAnswer : uint8
{
	Yes,
	No,
	/** It could not look; Error says why. */
	Failed
};

/** How Training Connection stands. */
UENUM(BlueprintType)
enum class EConsacConnection : uint8
{
	/** Somebody trains or acts: call Training. */
	Connected,
	/** Nobody has come yet. */
	Waiting,
	/** The training has come to its end. */
	Completed,
	/** Something is wrong; Error says what. The next call tries again. */
	Failed
};

/** What Training wants of the world. */
UENUM(BlueprintType)
enum class EConsacTraining : uint8
{
	/** Carry out Action; then call Training with what came of it. */
	Step,
	/** Put the world at the start of an episode; then call Training with its first observation. */
	Reset,
	/** Nothing yet; call Training again. */
	Waiting,
	/** The training has come to its end. */
	Completed,
	/** Something is wrong; Error says what. The next call tries again. */
	Failed
};

/** How an episode ended. */
UENUM(BlueprintType)
enum class EConsacEpisodeEnd : uint8
{
	/** In a terminal state: won, lost, fallen. */
	Terminated,
	/** It was cut, by a time limit for instance; it could have gone on. */
	Truncated
};

/** What a step pays by the goal that it reached and the one that was wanted. */
UENUM(BlueprintType)
enum class EConsacGoalReward : uint8
{
	/** Nothing: Add Reward alone pays. */
	None,
	/** 0 where the goal is reached, else -1. */
	Sparse,
	/** Minus the distance from the goal. */
	Dense
};

/** Which values a space holds. */
UENUM(BlueprintType)
enum class EConsacSpaceKind : uint8
{
	/** Numbers between bounds. */
	Box,
	/** One of some choices: 0, 1, 2 ... */
	Discrete,
	/** Several choices at once. */
	MultiDiscrete,
	/** Several yes-or-no. */
	MultiBinary
};

/** What can be observed or done. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacSpace
{
	GENERATED_BODY()

	/** Which values. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	EConsacSpaceKind Kind = EConsacSpaceKind::Box;

	/** Box: how many numbers. Discrete: how many choices. MultiBinary: how many bits. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space", meta=(ClampMin="1"))
	int32 Size = 1;

	/** Box: lower bounds, one for all numbers or one for each. Empty: no bound. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	TArray<float> Low;

	/** Box: upper bounds, likewise. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	TArray<float> High;

	/** MultiDiscrete: how many choices each has. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	TArray<int32> Choices;

	/** Box: rows, columns, channels of a picture, whose product is Size. Empty: a plain list of Size numbers. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	TArray<int32> Shape;

	/** Box: whole numbers from 0 to 255, for pictures. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	bool bBytes = false;
};

/** A named part of what an agent sees or does. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacEntry
{
	GENERATED_BODY()

	/** Unique in its list. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent")
	FName Name;

	/** Its values. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent")
	FConsacSpace Space;
};

/** A number of the world that a trainer may set, and vary from episode to episode: gravity, friction, how many enemies there are. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacParameter
{
	GENERATED_BODY()

	/** Unique in its list. A trainer elsewhere knows it in lower case. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Parameters")
	FName Name;

	/** What it is where nobody sets it. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Parameters")
	double Default = 0.0;

	/** Nothing below Low or above High may be set. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Parameters")
	bool bBounded = false;

	/** The least value. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Parameters", meta=(EditCondition="bBounded"))
	double Low = 0.0;

	/** The largest value. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Parameters", meta=(EditCondition="bBounded"))
	double High = 1.0;

	/** For people: a line, with the unit. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Parameters")
	FString Description;

	/** What a training in this game, or the program that the Consac Trainer starts, sets: a number, uniform LOW HIGH or log_uniform LOW HIGH, drawn anew for
	 *  every episode, or ramp FROM TO STEPS. Empty: Default. A trainer that was started otherwise has its own environment_parameters. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Parameters")
	FString Training;
};

/** An action as a trainer or a model chose it. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacAction
{
	GENERATED_BODY()

	/** The choice, where the action space is Discrete. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	int32 Choice = 0;

	/** All numbers of the action; one where the action space is Discrete. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Space")
	TArray<float> Values;
};

/** The numbers of a named part of what an agent sees or does. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacNumbers
{
	GENERATED_BODY()

	/** Of the entry. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Model")
	FName Name;

	/** As many as its space has; the choice where it is Discrete. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Model")
	TArray<float> Values;
};

/** How a training stands. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacProgress
{
	GENERATED_BODY()

	/** In words. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	FString State;

	/** Steps of single agents so far. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	int64 Steps = 0;

	/** Steps planned; 0 where there is no end. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	int64 TotalSteps = 0;

	/** Episodes that ended. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	int64 Episodes = 0;

	/** Rounds of learning in this process. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	int64 Updates = 0;

	/** Mean reward of the last 100 episodes; 0 before the first ended. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	float MeanEpisodeReward = 0.0f;

	/** Mean length of the same episodes, in steps. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	float MeanEpisodeLength = 0.0f;

	/** Steps of single agents in a second. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	float StepsPerSecond = 0.0f;

	/** What it took to get the latest action, in milliseconds: with Lock Step or Loop Wait Seconds, the waiting for it too. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Training")
	float PollMilliseconds = 0.0f;
};
