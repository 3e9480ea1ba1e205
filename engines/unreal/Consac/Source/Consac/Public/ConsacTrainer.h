// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTrainerProgram.h"
#include "ConsacTypes.h"
#include "GameFramework/Actor.h"
#include "Templates/PimplPtr.h"
#include "UObject/ObjectPtr.h"
#include "ConsacTrainer.generated.h"

class UConsacAgentComponent;
class UConsacHyperparameters;
class UConsacModel;
struct FConsacTrainerState;

/** Who decides what the agents do. */
UENUM(BlueprintType)
enum class EConsacMode : uint8
{
	/** A trainer in another program, which connects to Host and Port. */
	Serve,
	/** This game learns by itself, on a thread of its own. */
	Train UMETA(DisplayName="Train Inside"),
	/** Trained models. */
	Act,
	/** A person, or rules: the agents' event On Heuristic. */
	ByHand
};

/** What agents do while this game learns from what they did. */
UENUM(BlueprintType)
enum class EConsacWhileLearning : uint8
{
	/** Nothing: every step is learned from. */
	Wait,
	/** They go on. Algorithms that learn in rounds (ppo) take the latest model and learn nothing from these steps; those that learn at every step (dqn) lose none. */
	GoOn
};

/** The model of one kind of agent. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacBehaviourModel
{
	GENERATED_BODY()

	/** The agents' Behaviour. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer")
	FString Behaviour = TEXT("default");

	/** A .consac file, where Model is none; a relative path is one below Saved/Consac of the project. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer")
	FString Path;

	/** An asset, which is packed with the game, or a model that was loaded; it wins over Path. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer")
	TObjectPtr<UConsacModel> Model;
};

DECLARE_DYNAMIC_MULTICAST_DELEGATE(FConsacTrainerEvent);
DECLARE_DYNAMIC_MULTICAST_DELEGATE_OneParam(FConsacTrainerErrorEvent, const FString&, Error);

/** Gathers all agents of its world and drives them together. Of several in a world the first drives, and each of the others
 *  waits until those before it have gone. Does nothing on a client of a network game. */
UCLASS(BlueprintType, Blueprintable, ClassGroup=(Consac), meta=(DisplayName="Consac Trainer"))
class CONSAC_API AConsacTrainer : public AActor
{
	GENERATED_BODY()

public:
	AConsacTrainer();

	/** Who decides. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer")
	EConsacMode Mode = EConsacMode::Serve;

	/** Begins with the game, or once its first agent has come, unless Stop Training was called before; otherwise Start Training begins. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer")
	bool bAutoStart = true;

	/** Steps of single agents to train for; On Training Completed comes after them. Act and By Hand go on until they are stopped. A trainer that is told to take fewer, by Program's
	 *  Total Steps or its own --steps, leaves before, and the event does not come. 0 in Serve, together with a Model Name: the trainer only acts by that model. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer", meta=(ClampMin="0"))
	int64 TotalSteps = 100000;

	/** Of the world's and the learner's random numbers. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer", meta=(ClampMin="0"))
	int64 Seed = 0;

	/** Serve and Train: agents of each kind that may be there at once, where they come and go; 0: as many as are there from the start. No step of an
	 *  agent that was destroyed counts, and a newcomer may have its place. In Act and By Hand whoever comes finds a place. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer", meta=(ClampMin="0"))
	int32 RoomForAgents = 0;

	/** Numbers of this world that who trains may set, and vary from episode to episode, so that what is learned holds for more than one world. Read by Get Environment
	 *  Parameter in On Episode Begin. Over text protocol 1 all are at their Default. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer", meta=(TitleProperty="Name"))
	TArray<FConsacParameter> EnvironmentParameters;

	/** Serve: the address to listen on; 127.0.0.1 for trainers on this computer only. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Serve")
	FString Host = TEXT("127.0.0.1");

	/** Serve: the port; 0 for any that is free. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Serve", meta=(ClampMin="0", ClampMax="65535"))
	int32 Port = 5005;

	/** Serve: the model that the trainer is to use or to make. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Serve")
	FString ModelName;

	/** Serve: what a trainer must show; needed to listen beyond this computer. It is saved in the level, for whoever has its file. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Serve")
	FString Token;

	/** Serve: the program that Start Trainer Program For This starts. It connects to the trainer's own Host and Port, whatever stands
	 *  in these two here; Algorithm is empty or that of Hyperparameters, where there are any. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Serve")
	FConsacProgramSettings Program;

	/** Train Inside, and the program: how to learn; none: the defaults. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Train")
	TObjectPtr<UConsacHyperparameters> Hyperparameters;

	/** Train Inside: what agents do meanwhile. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Train")
	EConsacWhileLearning WhileLearning = EConsacWhileLearning::GoOn;

	/** Train Inside: the folder where each kind of agent's model is saved, as BEHAVIOUR.consac at the end, and as
	 *  BEHAVIOUR.stopped.consac when it is stopped before; one of an earlier training that is written over is kept as BEHAVIOUR.before.consac
	 *  or BEHAVIOUR.stopped.before.consac; where it cannot be, it stays as it is and the new one is BEHAVIOUR.new.consac. What could not be written at the end, as On Trainer Error says, a stop does
	 *  not try again: Save Model does. A relative path is one below Saved/Consac of the project; empty: nothing is
	 *  saved. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Train")
	FString SaveFolder;

	/** Train Inside: the folder where progress.csv and TensorBoard's events are written, with the names that a run of the program has, and what Consac
	 *  Record Stat was told as game/NAME: in a folder of their own for each training, PPO2_1 or the next number that is free.
	 *  tensorboard --logdir shows them. A relative path is one below Saved/Consac of the project; empty: they are not written. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Train")
	FString LogFolder;

	/** Act: a model for each kind of agent. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Act", meta=(TitleProperty="Behaviour"))
	TArray<FConsacBehaviourModel> Models;

	/** Act: the best action; otherwise one drawn as the training did. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Act")
	bool bDeterministic = true;

	/** Each tick waits for the decision that it needs, so that none passes without, once a trainer has come. The game stands
	 *  still meanwhile; without this only an unattended game (-unattended) waits. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time")
	bool bLockStep = false;

	/** Longest wait of one tick, with all of its steps, for a trainer who has come, and of Stop Training and End Play for what is under way, in seconds;
	 *  what a stop does not wait for is finished in the background. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time", meta=(ClampMin="0.001", ClampMax="60"))
	float MaxWaitSeconds = 1.0f;

	/** What the agents see in one tick decides what they do in the next. In Act the models then compute on a thread of their own, while the game goes on;
	 *  in Serve an answer has a tick's time to come. On Observe comes a tick before the next On Action (with a Decision Period of 1 in the same tick, right
	 *  after it), and what is earned in between counts for the coming decision. Train with it what is to act with it. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time")
	bool bPipelined = false;

	/** Most decisions within one tick. Above 1 only for worlds whose actions are complete when On Action returns: no time passes in between,
	 *  and an agent that moves by physics, or has a part that does, is refused whenever it comes. Where Decision Period is above 1, or with Pipelined, it is 1. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time", meta=(ClampMin="1"))
	int32 MaxStepsPerTick = 1;

	/** While it trains, frames follow each other as fast as the computer can: no frame limit, on battery neither, no vertical synchronisation, and
	 *  the editor does not slow down in the background. All settings that this changes are put back at the end, and while the
	 *  game is paused, but for those that somebody else has changed meanwhile. A dedicated server keeps its own rate, unless Fixed Step is set. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time")
	bool bFullSpeed = true;

	/** Every tick is the same length of game time, however long it takes, from Start Training on. The settings that this changes are put back at the
	 *  end. Ticks longer than the project's Max Physics Delta Time need that raised, and those beyond Min or Max Undilated Frame
	 *  Time of the World Settings (0.0005 and 0.4 s, unless changed) need these changed: the log warns of both. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time")
	bool bFixedStep = false;

	/** Length of such a tick, in seconds. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time", meta=(ClampMin="0.0005", ClampMax="0.4", EditCondition="bFixedStep"))
	float FixedStepSeconds = 0.016667f;

	/** Seconds between two lines in the log that say how it stands; 0: none. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Time", meta=(ClampMin="0"))
	float LogSeconds = 10.0f;

	/** On the screen, what each agent sees, does and has earned, for the first 20. To look at: it costs time. The Visual Logger (Tools > Debug), where it
	 *  records, has the same for each agent and decision, without this. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Debug")
	bool bShowAgents = false;

	/** The folder where demonstrations are saved at the end, one file for each kind of agent; a relative path is one below
	 *  Saved/Consac of the project; empty: they are not recorded. In every Mode, whoever decides. BEHAVIOUR.safetensors, or the next name that
	 *  is free, BEHAVIOUR-2.safetensors: no demonstration is written over. The log names the file. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Trainer|Recording")
	FString RecordFolder;

	/** The training has come to its end, and its models are in Save Folder: no tick waits for the disk. In Serve once for each
	 *  trainer that has come and trained for Total Steps. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Trainer")
	FConsacTrainerEvent OnTrainingCompleted;

	/** Something went wrong. It goes on where it can. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Trainer")
	FConsacTrainerErrorEvent OnTrainerError;

	/** Gathers the agents and begins. Fails when it has begun, when there are no agents, or when something does not fit; Auto Start
	 *  is then as it was. Before the trainer's first tick, in an Event Begin Play for instance, it succeeds and begins with that tick,
	 *  when all agents of the level play, or once one has come; On Trainer Error tells what goes wrong with that. In an event, after Stop Training there: begins when the stop is done, and On Trainer Error tells what goes
	 *  wrong with that. */
	UFUNCTION(BlueprintCallable, Category="Consac|Trainer", meta=(DisplayName="Start Training", ExpandEnumAsExecs="Result"))
	void StartTraining(EConsacResult& Result, FString& Error);

	/** Ends it, saves what is to be saved, and puts every setting back. Holds the game for Max Wait Seconds at most: a learner
	 *  or a file that needs longer is finished in the background. Before the begin it keeps Auto Start from beginning. Ending what has ended
	 *  does nothing. */
	UFUNCTION(BlueprintCallable, Category="Consac|Trainer", meta=(DisplayName="Stop Training"))
	void StopTraining();

	/** Writes the model as it is now, the one that acts in Act. The game waits until the disk has it, a frame or two; for what Save
	 *  Folder keeps it does not. Fails where there is none: in Serve and By Hand, and in an Event End Play, when all has ended.
	 *  @param Path A .consac file; its folder is made where it is missing, also where writing then fails. A relative path is one below Saved/Consac of the project. */
	UFUNCTION(BlueprintCallable, Category="Consac|Trainer", meta=(DisplayName="Save Model", ExpandEnumAsExecs="Result"))
	void SaveModel(const FString& Behaviour, const FString& Path, EConsacResult& Result, FString& Error);

	/** How it stands. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Trainer", meta=(DisplayName="Get Trainer Progress"))
	FConsacProgress GetTrainerProgress() const;

	/** Whether it has begun, with the trainer's first tick or later, and was not stopped: also after its end, when the agents go on by what was learned, or a further trainer
	 *  may come. */
	UFUNCTION(BlueprintPure, Category="Consac|Trainer", meta=(DisplayName="Is Training"))
	bool IsTraining() const;

	/** The port that is open; 0 when none is. */
	UFUNCTION(BlueprintPure, Category="Consac|Trainer", meta=(DisplayName="Get Trainer Port"))
	int32 GetTrainerPort() const;

	/** Starts the program consac, to train this world, which plays already where Port is 0: a button in the editor, a node in a graph. */
	UFUNCTION(BlueprintCallable, CallInEditor, Category="Consac|Trainer", meta=(DisplayName="Start Trainer Program For This"))
	void StartProgram();

	/** Ends the program that Start Trainer Program For This started for this same trainer: one in play is another than the editor's it was
	 *  copied from. */
	UFUNCTION(BlueprintCallable, CallInEditor, Category="Consac|Trainer", meta=(DisplayName="Stop Trainer Program For This"))
	void StopProgram();

	/** In the editor: the models in Save Folder, and those of the program's run, become assets below Content/Consac, in a folder of that
	 *  name; those that are there already are imported again, and whoever refers to them has the new ones. A button of the trainer; in a
	 *  packaged game it does nothing. */
	UFUNCTION(BlueprintCallable, CallInEditor, Category="Consac|Trainer", meta=(DisplayName="Import Trained Models"))
	void ImportModels();

	virtual void BeginPlay() override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;
	virtual void Tick(float DeltaSeconds) override;
	virtual void BeginDestroy() override;

	/** A number of the game's own; Consac Record Stat in a graph. */
	void NoteStat(FName Name, float Value);

	/** Pays every agent of a group; Consac Add Group Reward in a graph. */
	void AddGroupReward(FName Group, float Reward);

	/** For the plugin's own code: decisions within a tick, where a decision stands for so many ticks. */
	int32 StepsPerTick(int32 Period) const;

	/** An agent began to play while the world runs. */
	void AgentCame(UConsacAgentComponent* Agent);

private:
	friend struct FConsacTrainerState;

	void Report(const FString& Error);
	void Stop();
	void Advance();
	bool DoStep(double Until);
	void StartNoted();
	void Complete();
	void TellCompleted(double MostSeconds);
	void StartInTurn();
	void Show();
	void ShowAgents();
	FString TakeStats();

	UPROPERTY(Transient, DuplicateTransient)
	TObjectPtr<UConsacTrainerProgram> RunningProgram;

	TPimplPtr<FConsacTrainerState> State;
};
