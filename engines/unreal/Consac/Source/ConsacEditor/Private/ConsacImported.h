// Copyright CONSAC authors. MIT License.
// Assets that are files: how one is made of its file, and made anew. T has Load, TakeOver and AssetImportData.
#pragma once

#include "CoreMinimal.h"
#include "EditorFramework/AssetImportData.h"
#include "EditorReimportHandler.h"
#include "Templates/Casts.h"
#include "UObject/Object.h"
#include "UObject/ObjectMacros.h"
#include "UObject/UObjectGlobals.h"

namespace ConsacImported
{

/** What a file holds, which is no asset yet; null where it is none, and the log says why. */
template <class T>
T* Read(const FString& File)
{
	FString Error;
	T* Made = NewObject<T>();
	return Made->Load(File, Error) ? Made : nullptr;
}

/** Where its file is. */
template <class T>
UAssetImportData& FileOf(T& Asset)
{
	if (!IsValid(Asset.AssetImportData.Get()))
	{
		Asset.AssetImportData = NewObject<UAssetImportData>(&Asset);
	}
	return *Asset.AssetImportData;
}

/** Makes an asset what was read. */
template <class T>
void Take(T& Asset, T& Found, const FString& File)
{
	Asset.TakeOver(Found);
	FileOf(Asset).Update(File);
	Asset.PostEditChange();
	Asset.MarkPackageDirty();
}

/** The asset of a file. What is none leaves no empty asset behind, and changes none. */
template <class T>
UObject* Create(UObject* Parent, FName Name, EObjectFlags Flags, const FString& File)
{
	T* Found = Read<T>(File);
	if (Found == nullptr)
	{
		return nullptr;
	}
	T* Asset = FindObject<T>(Parent, *Name.ToString());
	Asset = Asset != nullptr ? Asset : NewObject<T>(Parent, Name, Flags);
	Take(*Asset, *Found, File);
	return Asset;
}

/** Whether it is such an asset; of which files. */
template <class T>
bool IsOne(UObject* Object, TArray<FString>& Files)
{
	const T* Asset = Cast<T>(Object);
	if (Asset != nullptr && IsValid(Asset->AssetImportData.Get()))
	{
		Asset->AssetImportData->ExtractFilenames(Files);
	}
	return Asset != nullptr;
}

/** Its file is elsewhere now. */
template <class T>
void SetFile(UObject* Object, const TArray<FString>& Files)
{
	T* Asset = Cast<T>(Object);
	if (Asset != nullptr && !Files.IsEmpty())
	{
		FileOf(*Asset).UpdateFilenameOnly(Files[0]);
	}
}

/** Reads its file again; it stays the same object. */
template <class T>
EReimportResult::Type Again(UObject* Object)
{
	T* Asset = Cast<T>(Object);
	const bool bKnown = Asset != nullptr && IsValid(Asset->AssetImportData.Get());
	const FString File = bKnown ? Asset->AssetImportData->GetFirstFilename() : FString();
	T* Found = bKnown ? Read<T>(File) : nullptr;
	if (Found == nullptr)
	{
		return EReimportResult::Failed;
	}
	Take(*Asset, *Found, File);
	return EReimportResult::Succeeded;
}

}
