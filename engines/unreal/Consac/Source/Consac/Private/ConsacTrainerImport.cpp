// Copyright CONSAC authors. MIT License.
// A Consac Trainer's models as assets: the editor's part of it.
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacTrainer.h"
#include "HAL/FileManager.h"
#include "Logging/LogMacros.h"
#include "Misc/Paths.h"
#include "UObject/UObjectGlobals.h"
#if WITH_EDITOR
#include "AssetToolsModule.h"
#include "AutomatedAssetImportData.h"
#include "IAssetTools.h"
#endif

#include "ConsacLog.h"

#if WITH_EDITOR
namespace ConsacPlugin
{

// Files of models that came to their end, in full: none that was stopped, none of before, and none that is about to take its place.
static TArray<FString> FinishedModels(const std::string& Folder)
{
	TArray<FString> Names;
	IFileManager::Get().FindFiles(Names, *FromUtf8(Folder), TEXT("consac"));
	TArray<FString> Files;
	for (const FString& Name : Names)
	{
		const std::string Text = ToUtf8(Name);
		if (!Text.ends_with(".stopped.consac") && !Text.ends_with(".before.consac") && !Text.ends_with(".new.consac"))
		{
			Files.Add(FromUtf8(Folder + "/" + Text));
		}
	}
	return Files;
}

// The folder of the Content Browser for a folder of the disk; a package's path takes letters, digits, '-' and '_'.
static FString ContentFolder(const std::string& Folder)
{
	std::string Name = Folder.substr(Folder.find_last_of("/\\") + 1);
	for (char& Letter : Name)
	{
		const bool bPlain = (Letter >= 'a' && Letter <= 'z') || (Letter >= 'A' && Letter <= 'Z') || (Letter >= '0' && Letter <= '9') || Letter == '-' || Letter == '_';
		Letter = bPlain ? Letter : '_';
	}
	return FromUtf8("/Game/Consac/" + Name);
}

}
#endif

void AConsacTrainer::ImportModels()
{
#if WITH_EDITOR
	std::vector<std::string> Folders;
	if (!SaveFolder.IsEmpty())
	{
		Folders.push_back(ConsacPlugin::ToFile(SaveFolder));
	}
	// Of the run's own name, where that of Program was taken; none of a program that did not start.
	const std::string Model = IsValid(RunningProgram.Get()) ? ConsacPlugin::ToUtf8(RunningProgram->GetModelPath()) : std::string();
	if (!Model.empty())
	{
		Folders.push_back(Model.substr(0, Model.find_last_of("/\\")));
	}
	else
	{
		Folders.push_back(ConsacPlugin::ToUtf8(FPaths::Combine(Program.GetRunsFolder(), Program.GetRunName())));
	}
	bool bAny = false;
	std::string Looked;
	for (const std::string& Folder : Folders)
	{
		Looked += (Looked.empty() ? "" : " or ") + Folder;
		const TArray<FString> Files = ConsacPlugin::FinishedModels(Folder);
		if (Files.IsEmpty())
		{
			continue;
		}
		UAutomatedAssetImportData* Import = NewObject<UAutomatedAssetImportData>();
		Import->DestinationPath = ConsacPlugin::ContentFolder(Folder);
		Import->Filenames = Files;
		Import->bReplaceExisting = true;
		const int32 Made = FAssetToolsModule::GetModule().Get().ImportAssetsAutomated(Import).Num();
		UE_LOG(LogConsac, Display, TEXT("%d of %d models of %s are in %s"), Made, Files.Num(), *ConsacPlugin::FromUtf8(Folder), *Import->DestinationPath);
		bAny = true;
		if (Made < Files.Num())
		{
			Report(FString::Printf(TEXT("%d of %d models of %s became no assets; the lines before this one say why"), Files.Num() - Made, Files.Num(), *ConsacPlugin::FromUtf8(Folder)));
		}
	}
	if (!bAny)
	{
		Report(ConsacPlugin::FromUtf8("there is no finished model in " + Looked + "; train first"));
	}
#endif
}
