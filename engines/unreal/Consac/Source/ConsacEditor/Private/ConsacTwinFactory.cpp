// Copyright CONSAC authors. MIT License.
#include "ConsacTwinFactory.h"

#include "ConsacImported.h"
#include "ConsacTwin.h"
#include "Misc/FeedbackContext.h"
#include "UObject/Class.h"
#include "UObject/ObjectMacros.h"

UConsacTwinFactory::UConsacTwinFactory()
{
	SupportedClass = UConsacTwin::StaticClass();
	Formats.Add(TEXT("json;CONSAC twin (twin.json)"));
	ImportPriority = DefaultImportPriority + 1; // data tables are JSON too; they are asked for what is no twin
	bCreateNew = false;
	bEditorImport = true;
	bText = false;
}

bool UConsacTwinFactory::FactoryCanImport(const FString& Filename)
{
	return UConsacTwin::IsTwinFile(Filename);
}

UObject* UConsacTwinFactory::FactoryCreateFile(UClass*, UObject* InParent, FName InName, EObjectFlags Flags, const FString& Filename, const TCHAR*,
	FFeedbackContext*, bool& bOutOperationCanceled)
{
	bOutOperationCanceled = false;
	return ConsacImported::Create<UConsacTwin>(InParent, InName, Flags, Filename);
}

bool UConsacTwinFactory::CanReimport(UObject* Obj, TArray<FString>& OutFilenames)
{
	return ConsacImported::IsOne<UConsacTwin>(Obj, OutFilenames);
}

void UConsacTwinFactory::SetReimportPaths(UObject* Obj, const TArray<FString>& NewReimportPaths)
{
	ConsacImported::SetFile<UConsacTwin>(Obj, NewReimportPaths);
}

EReimportResult::Type UConsacTwinFactory::Reimport(UObject* Obj)
{
	return ConsacImported::Again<UConsacTwin>(Obj);
}
