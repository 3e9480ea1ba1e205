// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Engine/DataAsset.h"
#include "ConsacHyperparametersBase.generated.h"

/** A hyperparameter as text. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacHyperparameter
{
	GENERATED_BODY()

	/** As the program names it. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Hyperparameters")
	FString Name;

	/** As the program reads it. */
	UPROPERTY(BlueprintReadOnly, Category="Consac|Hyperparameters")
	FString Value;
};

/** How an algorithm learns. One kind of data asset for every algorithm derives from this; they are generated from the
 *  program's own table. */
UCLASS(Abstract, BlueprintType)
class CONSAC_API UConsacHyperparameters : public UDataAsset
{
	GENERATED_BODY()

public:
	/** The algorithm's name, as the program knows it. */
	virtual FString GetAlgorithm() const;

	/** Adds every hyperparameter of the algorithm. */
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const;

protected:
	static void AddText(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, const FString& Value);
	static void AddReal(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, double Value);
	static void AddInteger(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, int64 Value);
	static void AddBoolean(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, bool bValue);
};
