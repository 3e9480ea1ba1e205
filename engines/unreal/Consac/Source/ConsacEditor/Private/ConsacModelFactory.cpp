// Copyright CONSAC authors. MIT License.
#include "ConsacModelFactory.h"

#include "ConsacModel.h"
#include "EditorFramework/AssetImportData.h"
#include "Misc/FeedbackContext.h"
#include "Templates/Casts.h"
#include "UObject/Class.h"
#include "UObject/ObjectMacros.h"
#include "UObject/UObjectGlobals.h"

UConsacModelFactory::UConsacModelFactory()
{
	SupportedClass = UConsacModel::StaticClass();
	Formats.Add(TEXT("consac;CONSAC model"));
	bCreateNew = false;
	bEditorImport = true;
	bText = false;
}

// Takes over what is in a file; a file that is no model changes nothing, and the log says why.
static bool TakeFile(UConsacModel& Model, const FString& File)
{
	FString Error;
	if (!Model.Load(File, Error))
	{
		return false;
	}
	if (!IsValid(Model.AssetImportData.Get()))
	{
		Model.AssetImportData = NewObject<UAssetImportData>(&Model);
	}
	Model.AssetImportData->Update(File);
	Model.PostEditChange();
	Model.MarkPackageDirty();
	return true;
}

UObject* UConsacModelFactory::FactoryCreateFile(UClass*, UObject* InParent, FName InName, EObjectFlags Flags, const FString& Filename, const TCHAR*,
	FFeedbackContext*, bool& bOutOperationCanceled)
{
	bOutOperationCanceled = false;
	FString Error;
	UConsacModel* Model = FindObject<UConsacModel>(InParent, *InName.ToString());
	if (Model == nullptr && NewObject<UConsacModel>()->Load(Filename, Error)) // what is no model leaves no empty asset behind
	{
		Model = NewObject<UConsacModel>(InParent, InName, Flags);
	}
	return Model != nullptr && TakeFile(*Model, Filename) ? Model : nullptr;
}

bool UConsacModelFactory::CanReimport(UObject* Obj, TArray<FString>& OutFilenames)
{
	const UConsacModel* Model = Cast<UConsacModel>(Obj);
	if (Model == nullptr)
	{
		return false;
	}
	if (IsValid(Model->AssetImportData.Get()))
	{
		Model->AssetImportData->ExtractFilenames(OutFilenames);
	}
	return true;
}

void UConsacModelFactory::SetReimportPaths(UObject* Obj, const TArray<FString>& NewReimportPaths)
{
	UConsacModel* Model = Cast<UConsacModel>(Obj);
	if (Model == nullptr || NewReimportPaths.IsEmpty())
	{
		return;
	}
	if (!IsValid(Model->AssetImportData.Get()))
	{
		Model->AssetImportData = NewObject<UAssetImportData>(Model);
	}
	Model->AssetImportData->UpdateFilenameOnly(NewReimportPaths[0]);
}

EReimportResult::Type UConsacModelFactory::Reimport(UObject* Obj)
{
	UConsacModel* Model = Cast<UConsacModel>(Obj);
	const bool bKnown = Model != nullptr && IsValid(Model->AssetImportData.Get());
	return bKnown && TakeFile(*Model, Model->AssetImportData->GetFirstFilename()) ? EReimportResult::Succeeded : EReimportResult::Failed;
}
