// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "GameFramework/Actor.h"
#include "Math/RandomStream.h"
#include "UObject/ObjectPtr.h"
#include "ConsacChase.generated.h"

class AConsacChase;
class AConsacTrainer;
class UConsacAgentComponent;
class USceneComponent;
class UStaticMeshComponent;

/** One who chases. All chasers learn one model together. */
UCLASS(ClassGroup=(Consac), meta=(DisplayName="Consac Chaser"))
class CONSACSAMPLES_API AConsacChaser : public AActor
{
	GENERATED_BODY()

public:
	AConsacChaser();

	/** What it sees and does. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Chase")
	TObjectPtr<UConsacAgentComponent> Agent;

	/** Whom it chases for. */
	void Join(AConsacChase* NewChase, int32 NewSeed);

	virtual void BeginPlay() override;

private:
	UFUNCTION()
	void Restart(UConsacAgentComponent* Which, int64 EpisodeSeed);

	UFUNCTION()
	void Observe(UConsacAgentComponent* Which);

	UFUNCTION()
	void Walk(UConsacAgentComponent* Which);

	UPROPERTY(Transient, DuplicateTransient)
	TObjectPtr<AConsacChase> Chase;

	UPROPERTY()
	TObjectPtr<UStaticMeshComponent> Mesh;

	FRandomStream Random;
	FVector Place = FVector::ZeroVector;
	bool bBound = false; // to its agent's events
};

/** A field on which many chase one that runs in circles. Makes its chasers and its trainer itself. */
UCLASS(Blueprintable, ClassGroup=(Consac), meta=(DisplayName="Consac Chase"))
class CONSACSAMPLES_API AConsacChase : public AActor
{
	GENERATED_BODY()

public:
	AConsacChase();

	/** How many chase. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Chase", meta=(ClampMin="1", ClampMax="10000"))
	int32 Chasers = 32;

	/** Half the width of the field, in centimetres. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Chase", meta=(ClampMin="100"))
	float HalfWidth = 1000.0f;

	/** Who trains them: set its mode before the first tick. */
	UPROPERTY(Transient, DuplicateTransient, VisibleInstanceOnly, BlueprintReadOnly, Category="Consac|Chase")
	TObjectPtr<AConsacTrainer> Trainer;

	/** Where the one runs that all chase. */
	UFUNCTION(BlueprintPure, Category="Consac|Chase", meta=(DisplayName="Get Runner Place"))
	FVector GetRunnerPlace() const;

	/** How often it was caught. */
	UFUNCTION(BlueprintPure, Category="Consac|Chase", meta=(DisplayName="Get Catches"))
	int32 GetCatches() const;

	/** Somebody caught it. */
	void Caught();

	virtual void BeginPlay() override;
	virtual void Tick(float DeltaSeconds) override;

private:
	UPROPERTY()
	TObjectPtr<UStaticMeshComponent> RunnerMesh;

	double Angle = 0.0;
	int32 Catches = 0;
};
