// Copyright CONSAC authors. MIT License.
#include <memory>

#include "ConsacHelloLevel.h"
#include "ConsacPanel.h"
#include "ConsacWatch.h"
#include "Containers/Ticker.h"
#include "Framework/Commands/UIAction.h"
#include "Framework/Docking/TabManager.h"
#include "Misc/MessageDialog.h"
#include "Modules/ModuleManager.h"
#include "Templates/SharedPointer.h"
#include "Textures/SlateIcon.h"
#include "ToolMenu.h"
#include "ToolMenuSection.h"
#include "ToolMenus.h"
#include "Widgets/DeclarativeSyntaxSupport.h"
#include "Widgets/Docking/SDockTab.h"

/** The panel and its entries in the menu. */
class FConsacEditorModule : public IModuleInterface
{
public:
	virtual void StartupModule() override
	{
		Watch = std::make_unique<FConsacWatch>();
		Ticker = FTSTicker::GetCoreTicker().AddTicker(FTickerDelegate::CreateRaw(this, &FConsacEditorModule::Look), SecondsBetween);
		FGlobalTabmanager::Get()->RegisterNomadTabSpawner(TabName(), FOnSpawnTab::CreateRaw(this, &FConsacEditorModule::SpawnPanel))
			.SetDisplayName(FText::FromString(TEXT("Consac")))
			.SetMenuType(ETabSpawnerMenuType::Hidden); // the entry in Tools opens it
		UToolMenus::RegisterStartupCallback(FSimpleMulticastDelegate::FDelegate::CreateRaw(this, &FConsacEditorModule::AddEntries));
	}

	virtual void ShutdownModule() override
	{
		UToolMenus::UnRegisterStartupCallback(this);
		UToolMenus::UnregisterOwner(this);
		FGlobalTabmanager::Get()->UnregisterNomadTabSpawner(TabName());
		FTSTicker::RemoveTicker(Ticker);
		if (const TSharedPtr<SConsacPanel> Open = Panel.Pin(); Open.IsValid())
		{
			Open->Watch(nullptr); // a tab may outlive the module
		}
		Watch.reset();
	}

private:
	static constexpr float SecondsBetween = 0.25f; // of looks

	static FName TabName()
	{
		return FName(TEXT("ConsacPanel"));
	}

	void AddEntries()
	{
		const FToolMenuOwnerScoped Owner(this);
		UToolMenu* Tools = UToolMenus::Get()->ExtendMenu(FName(TEXT("LevelEditor.MainMenu.Tools")));
		FToolMenuSection& Section = Tools->FindOrAddSection(FName(TEXT("Consac")), FText::FromString(TEXT("Consac")));
		Section.AddMenuEntry(FName(TEXT("ConsacPanel")), FText::FromString(TEXT("Consac Panel")), FText::FromString(TEXT("How the training stands, and how to start and stop it")), FSlateIcon(),
			FUIAction(FExecuteAction::CreateRaw(this, &FConsacEditorModule::OpenPanel)));
		Section.AddMenuEntry(FName(TEXT("ConsacHelloLevel")), FText::FromString(TEXT("New Hello Level")), FText::FromString(TEXT("A new level that learns, ready for Play")), FSlateIcon(),
			FUIAction(FExecuteAction::CreateRaw(this, &FConsacEditorModule::OpenHelloLevel)));
	}

	void OpenPanel()
	{
		FGlobalTabmanager::Get()->TryInvokeTab(FTabId(TabName()));
	}

	void OpenHelloLevel()
	{
		FString Told;
		if (ConsacHelloLevel::Open(Told) != nullptr)
		{
			OpenPanel();
		}
		FMessageDialog::Open(EAppMsgType::Ok, FText::FromString(Told));
	}

	TSharedRef<SDockTab> SpawnPanel(const FSpawnTabArgs&)
	{
		const TSharedRef<SConsacPanel> Made = SNew(SConsacPanel);
		Made->Watch(Watch.get());
		Made->Refresh();
		Panel = Made;
		return SNew(SDockTab).TabRole(ETabRole::NomadTab)
		[
			Made
		];
	}

	bool Look(float)
	{
		if (const TSharedPtr<SConsacPanel> Open = Panel.Pin(); Open.IsValid())
		{
			Open->Refresh();
		}
		else
		{
			Watch->Look(false); // the curve of what plays now is there when the panel is opened
		}
		return true;
	}

	std::unique_ptr<FConsacWatch> Watch;
	TWeakPtr<SConsacPanel> Panel;
	FTSTicker::FDelegateHandle Ticker;
};

IMPLEMENT_MODULE(FConsacEditorModule, ConsacEditor)
