// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "Templates/PimplPtr.h"
#include "UObject/Object.h"
#include "ConsacTrainerProgram.generated.h"

struct FConsacProcess;

/** How the program consac is started. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacProgramSettings
{
	GENERATED_BODY()

	/** The program, in full; empty: the one that comes with the plugin, for Windows or Linux; its README.txt says what it needs. A
	 *  packaged game takes it along, unless it is a Shipping build. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program")
	FString Program;

	/** Where the environment listens. Start Trainer Program For This takes the trainer's own. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program")
	FString Host = TEXT("127.0.0.1");

	/** The port of the environment; likewise. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program", meta=(ClampMin="1", ClampMax="65535"))
	int32 Port = 5005;

	/** How it learns; empty: the program's own choice. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program")
	FString Algorithm;

	/** Steps of single agents; 0: as many as the environment asks for. With fewer than that the program leaves before, and the game's
	 *  On Training Completed does not come. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program", meta=(ClampMin="0"))
	int64 TotalSteps = 0;

	/** The run's name: where its model and its logs are. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program")
	FString RunName = TEXT("unreal");

	/** The folder that holds all runs; a relative path is one below Saved/Consac of the project, and empty is that folder. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program")
	FString RunsFolder;

	/** Further arguments, as on a command line. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Program")
	FString ExtraArguments;

	/** For the plugin's own code: the folder that holds all runs, in full. */
	FString GetRunsFolder() const;

	/** For the plugin's own code: the name of the first run. */
	FString GetRunName() const;
};

/** The program consac at work. It goes on when nobody holds this any more; Stop Trainer Program ends it. */
UCLASS(BlueprintType)
class CONSAC_API UConsacTrainerProgram : public UObject
{
	GENERATED_BODY()

public:
	UConsacTrainerProgram();

	/** Whether it still works. */
	UFUNCTION(BlueprintCallable, Category="Consac|Program", meta=(DisplayName="Is Trainer Program Running"))
	bool IsRunning();

	/** Ends it, and does not wait: on Linux it is asked to, and saves first; on Windows it is ended at once.
	 *  Ending one that has ended does nothing. */
	UFUNCTION(BlueprintCallable, Category="Consac|Program", meta=(DisplayName="Stop Trainer Program"))
	void Stop();

	/** Where it puts the trained model. */
	UFUNCTION(BlueprintPure, Category="Consac|Program", meta=(DisplayName="Get Trained Model Path"))
	FString GetModelPath() const;

	/** Starts it; false and Error when there is no such program. */
	bool Start(const FConsacProgramSettings& Settings, const TArray<FString>& MoreArguments, FString& Error);

	virtual void BeginDestroy() override;

private:
	TPimplPtr<FConsacProcess> Process;
};
