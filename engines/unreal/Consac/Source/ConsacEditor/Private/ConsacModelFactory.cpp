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

// The model of a file, which is no asset yet; null where it is none, and the log says why.
static UConsacModel* ReadModel(const FString& File)
{
	FString Error;
	UConsacModel* Model = NewObject<UConsacModel>();
	return Model->Load(File, Error) ? Model : nullptr;
}

// Makes an asset what was read.
static void Take(UConsacModel& Model, UConsacModel& Read, const FString& File)
{
	Model.TakeOver(Read);
	if (!IsValid(Model.AssetImportData.Get()))
	{
		Model.AssetImportData = NewObject<UAssetImportData>(&Model);
	}
	Model.AssetImportData->Update(File);
	Model.PostEditChange();
	Model.MarkPackageDirty();
}

UObject* UConsacModelFactory::FactoryCreateFile(UClass*, UObject* InParent, FName InName, EObjectFlags Flags, const FString& Filename, const TCHAR*,
	FFeedbackContext*, bool& bOutOperationCanceled)
{
	bOutOperationCanceled = false;
	UConsacModel* Read = ReadModel(Filename);
	if (Read == nullptr) // what is no model leaves no empty asset behind, and changes none
	{
		return nullptr;
	}
	UConsacModel* Model = FindObject<UConsacModel>(InParent, *InName.ToString());
	Model = Model != nullptr ? Model : NewObject<UConsacModel>(InParent, InName, Flags);
	Take(*Model, *Read, Filename);
	return Model;
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
	const FString File = bKnown ? Model->AssetImportData->GetFirstFilename() : FString();
	UConsacModel* Read = bKnown ? ReadModel(File) : nullptr;
	if (Read == nullptr)
	{
		return EReimportResult::Failed;
	}
	Take(*Model, *Read, File);
	return EReimportResult::Succeeded;
}
