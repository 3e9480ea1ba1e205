// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "GameFramework/Actor.h"
#include "Math/RandomStream.h"
#include "UObject/ObjectPtr.h"
#include "ConsacRoad.generated.h"

class UConsacEnvironmentComponent;
class USceneComponent;
class UStaticMeshComponent;

/** The worked example of the thesis: an actor on a road from 0 to 40 learns to walk to a coin. Its graph, in C++:
 *  Begin Play -> Setup Environment; Tick -> Training Connection -> Training -> Step or Reset; Completed -> Close. */
UCLASS(Blueprintable, ClassGroup=(Consac), meta=(DisplayName="Consac Road"))
class CONSACSAMPLES_API AConsacRoad : public AActor
{
	GENERATED_BODY()

public:
	AConsacRoad();

	/** Steps to train for. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Road", meta=(ClampMin="0"))
	int64 TrainingLength = 20000;

	/** Where a trainer may connect. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Road", meta=(ClampMin="0", ClampMax="65535"))
	int32 Port = 5005;

	/** A trained model that walks instead of a trainer; empty: train. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Road")
	FString ModelPath;

	/** Most steps in one tick: 1 in tick mode, more in loop mode. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Road", meta=(ClampMin="1"))
	int32 StepsPerTick = 1;

	/** Of the coin's places. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Road")
	int32 Seed = 1;

	/** The nodes that train. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Road")
	TObjectPtr<UConsacEnvironmentComponent> Environment;

	/** Where the actor stands, from 0 to 40. */
	UFUNCTION(BlueprintPure, Category="Consac|Road", meta=(DisplayName="Get Walker Place"))
	int32 GetWalkerPlace() const;

	/** Where the coin lies, from 0 to 40. */
	UFUNCTION(BlueprintPure, Category="Consac|Road", meta=(DisplayName="Get Coin Place"))
	int32 GetCoinPlace() const;

	/** Coins that were collected. */
	UFUNCTION(BlueprintPure, Category="Consac|Road", meta=(DisplayName="Get Coins Collected"))
	int32 GetCoinsCollected() const;

	virtual void BeginPlay() override;
	virtual void Tick(float DeltaSeconds) override;

private:
	bool PlayOnce();
	void Walk(int32 Choice);
	void Restart();
	void PlaceCoin();
	void Draw();

	UPROPERTY()
	TObjectPtr<USceneComponent> Root;

	UPROPERTY()
	TObjectPtr<UStaticMeshComponent> WalkerMesh;

	UPROPERTY()
	TObjectPtr<UStaticMeshComponent> CoinMesh;

	FRandomStream Random;
	int32 Walker = 10;
	int32 Coin = 40;
	int32 SinceCoin = 0;
	int32 Episodes = 0;
	int32 Collected = 0;
	float Reward = 0.0f;
	bool bDone = false;
	bool bBegun = false; // Begin Play went well
};
