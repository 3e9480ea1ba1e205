// Copyright CONSAC authors. MIT License.
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacFarewell.h"
#include "ConsacLog.h"
#include "Logging/LogMacros.h"
#include "Modules/ModuleManager.h"

namespace ConsacPlugin
{

static void LogLine(void*, consac::LogLevel Level, std::string_view Line)
{
	const FString Text = FromUtf8(Line);
	switch (Level)
	{
	case consac::LogLevel::kDebug:
		UE_LOG(LogConsac, Verbose, TEXT("%s"), *Text);
		break;
	case consac::LogLevel::kInfo:
		UE_LOG(LogConsac, Log, TEXT("%s"), *Text);
		break;
	case consac::LogLevel::kWarning:
		UE_LOG(LogConsac, Warning, TEXT("%s"), *Text);
		break;
	case consac::LogLevel::kError:
		LogError(Text);
		break;
	}
}

static void LogAssertion(void*, const char* Expression, const char* File, int Line)
{
	UE_LOG(LogConsac, Error, TEXT("CONSAC was used wrongly: %hs (%hs:%d)"), Expression, File, Line);
}

}

/** Sends the core's lines to the log. */
class FConsacModule : public IModuleInterface
{
public:
	virtual void StartupModule() override
	{
		consac::Hooks Hooks;
		Hooks.log = &ConsacPlugin::LogLine;
		Hooks.assertion = &ConsacPlugin::LogAssertion;
		consac::SetHooks(Hooks);
	}

	virtual void ShutdownModule() override
	{
		ConsacPlugin::AwaitFarewells();
		consac::SetHooks(consac::Hooks());
	}
};

IMPLEMENT_MODULE(FConsacModule, Consac)
