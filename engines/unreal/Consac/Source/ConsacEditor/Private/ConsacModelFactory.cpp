// Copyright CONSAC authors. MIT License.
#include "ConsacModelFactory.h"

#include "ConsacImported.h"
#include "ConsacModel.h"
#include "Misc/FeedbackContext.h"
#include "UObject/Class.h"
#include "UObject/ObjectMacros.h"

UConsacModelFactory::UConsacModelFactory()
{
	SupportedClass = UConsacModel::StaticClass();
	Formats.Add(TEXT("consac;CONSAC model"));
	bCreateNew = false;
	bEditorImport = true;
	bText = false;
}

UObject* UConsacModelFactory::FactoryCreateFile(UClass*, UObject* InParent, FName InName, EObjectFlags Flags, const FString& Filename, const TCHAR*,
	FFeedbackContext*, bool& bOutOperationCanceled)
{
	bOutOperationCanceled = false;
	return ConsacImported::Create<UConsacModel>(InParent, InName, Flags, Filename);
}

bool UConsacModelFactory::CanReimport(UObject* Obj, TArray<FString>& OutFilenames)
{
	return ConsacImported::IsOne<UConsacModel>(Obj, OutFilenames);
}

void UConsacModelFactory::SetReimportPaths(UObject* Obj, const TArray<FString>& NewReimportPaths)
{
	ConsacImported::SetFile<UConsacModel>(Obj, NewReimportPaths);
}

EReimportResult::Type UConsacModelFactory::Reimport(UObject* Obj)
{
	return ConsacImported::Again<UConsacModel>(Obj);
}
