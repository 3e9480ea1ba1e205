// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "EditorReimportHandler.h"
#include "Factories/Factory.h"
#include "UObject/ObjectMacros.h"
#include "ConsacTwinFactory.generated.h"

class FFeedbackContext;
class UClass;
class UObject;

/** A twin.json that is dragged into the Content Browser becomes a Consac Twin, and one that is imported again stays the same object: whoever refers
 *  to it goes on with the new file. Other JSON is left to others. */
UCLASS()
class UConsacTwinFactory : public UFactory, public FReimportHandler
{
	GENERATED_BODY()

public:
	UConsacTwinFactory();

	virtual bool FactoryCanImport(const FString& Filename) override;
	virtual UObject* FactoryCreateFile(UClass* InClass, UObject* InParent, FName InName, EObjectFlags Flags, const FString& Filename, const TCHAR* Parms,
		FFeedbackContext* Warn, bool& bOutOperationCanceled) override;

	virtual bool CanReimport(UObject* Obj, TArray<FString>& OutFilenames) override;
	virtual void SetReimportPaths(UObject* Obj, const TArray<FString>& NewReimportPaths) override;
	virtual EReimportResult::Type Reimport(UObject* Obj) override;
};
