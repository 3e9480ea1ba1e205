// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "GameFramework/Actor.h"
#include "Math/RandomStream.h"
#include "UObject/ObjectPtr.h"
#include "ConsacLane.generated.h"

class UConsacAgentComponent;
class USceneComponent;
class UStaticMeshComponent;

/** The thesis' road once more, with a Consac Agent: a walker on the places 0 to 40 learns to go to a coin. Put several side by side, and a
 *  Consac Trainer: all learn one model together. Tools > Consac > New Hello Level is a level of them. */
UCLASS(Blueprintable, ClassGroup=(Consac), meta=(DisplayName="Consac Lane"))
class CONSACSAMPLES_API AConsacLane : public AActor
{
	GENERATED_BODY()

public:
	AConsacLane();

	/** Of the coin's and the walker's places, where the trainer gives none. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Lane")
	int32 Seed = 1;

	/** What the walker sees and does. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Lane")
	TObjectPtr<UConsacAgentComponent> Agent;

	/** Coins that were collected. */
	UFUNCTION(BlueprintPure, Category="Consac|Lane", meta=(DisplayName="Get Coins Of Lane"))
	int32 GetCoins() const;

	virtual void BeginPlay() override;

private:
	UFUNCTION()
	void Restart(UConsacAgentComponent* Which, int64 EpisodeSeed);

	UFUNCTION()
	void Observe(UConsacAgentComponent* Which);

	UFUNCTION()
	void Walk(UConsacAgentComponent* Which);

	void PlaceCoin();
	void Draw();

	UPROPERTY()
	TObjectPtr<USceneComponent> Root;

	UPROPERTY()
	TObjectPtr<UStaticMeshComponent> WalkerMesh;

	UPROPERTY()
	TObjectPtr<UStaticMeshComponent> CoinMesh;

	FRandomStream Random;
	int32 Walker = 20;
	int32 Coin = 40;
	int32 SinceCoin = 0;
	int32 Coins = 0;
	bool bBound = false; // to its agent's events
};
