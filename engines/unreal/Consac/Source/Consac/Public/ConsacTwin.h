// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Templates/PimplPtr.h"
#include "UObject/Object.h"
#include "UObject/ObjectPtr.h"
#include "ConsacTwin.generated.h"

class UAssetImportData;
struct FConsacTwinTable;

/** A robot as the program's twin import made it: its joint table. An asset, by dragging twin.json into the Content Browser, which is packed with the
 *  game. A Consac Twin component builds it. */
UCLASS(BlueprintType, HideCategories=(Object))
class CONSAC_API UConsacTwin : public UObject
{
	GENERATED_BODY()

public:
	UConsacTwin();

	/** The robot's name. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Twin")
	FString Robot;

	/** Its joints, each with its type, its limits in degrees or centimetres, and whom it follows. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Twin")
	TArray<FString> Joints;

	/** How many joints move by themselves. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Twin")
	int32 Movable = 0;

#if WITH_EDITORONLY_DATA
	/** The file that it was imported from. */
	UPROPERTY(VisibleAnywhere, Instanced, Category="Consac|File")
	TObjectPtr<UAssetImportData> AssetImportData;
#endif

	/** Whether a file of JSON says that it is a twin, of whatever format: what is wrong with one Load says. */
	static bool IsTwinFile(const FString& Path);

	/** Reads a twin.json; false and Error when it is none, of another format, or damaged. */
	bool Load(const FString& Path, FString& Error);

	/** For the plugin's own code: becomes the twin that another object has loaded, which has none any more. */
	void TakeOver(UConsacTwin& Loaded);

	/** For the plugin's own code: what the file holds, read when it is first asked for; null without one, or when it is damaged, which the
	 *  log says. */
	const FConsacTwinTable* GetTable() const;

	/** For the plugin's own code: becomes that robot, of no file: it is not saved. */
	void SetTable(const FConsacTwinTable& NewTable);

	virtual void BeginDestroy() override;

private:
	void Describe();

	UPROPERTY()
	TArray<uint8> File;

	TPimplPtr<FConsacTwinTable> Table;
};
