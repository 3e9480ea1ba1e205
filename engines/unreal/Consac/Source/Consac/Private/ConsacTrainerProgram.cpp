// Copyright CONSAC authors. MIT License.
#include "ConsacTrainerProgram.h"

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "HAL/PlatformProcess.h"
#include "Interfaces/IPluginManager.h"
#include "Logging/LogMacros.h"
#include "Misc/Paths.h"
#include "Templates/PimplPtr.h"

struct FConsacProcess
{
	FProcHandle Handle;
	FString ModelPath;
};

namespace ConsacPlugin
{

// The program that was packed with the plugin.
static FString PackedProgram()
{
	const auto Plugin = IPluginManager::Get().FindPlugin(TEXT("Consac"));
	const FString Folder = Plugin ? FPaths::ConvertRelativePathToFull(Plugin->GetBaseDir()) : FString();
#if PLATFORM_WINDOWS
	return FPaths::Combine(Folder, TEXT("Programs"), TEXT("Win64"), TEXT("consac.exe"));
#elif defined(__APPLE__)
	return FPaths::Combine(Folder, TEXT("Programs"), TEXT("Mac"), TEXT("consac"));
#else
	return FPaths::Combine(Folder, TEXT("Programs"), TEXT("Linux"), TEXT("consac"));
#endif
}

// Whether an argument in quotes keeps its blanks: but on Windows, the engine takes its line apart at blanks, in quotes too, and
// puts it together with one for several.
static bool KeepsBlanks([[maybe_unused]] const std::string& Text)
{
#if PLATFORM_WINDOWS
	return true;
#else
	return Text.find("  ") == std::string::npos && (Text.empty() || Text.front() != ' ');
#endif
}

// An argument, in quotes where a blank needs them: on Linux the engine takes its one line apart by itself, and nothing is written
// about quotes that need not be. False when it cannot be one.
static bool Quoted(const FString& Argument, std::string& Line)
{
	const std::string Text = ToUtf8(Argument);
	if (Text.find_first_of("\"\n\r") != std::string::npos || (!Text.empty() && Text.back() == '\\') || !KeepsBlanks(Text))
	{
		return false;
	}
	const char* Quote = Text.empty() || Text.find_first_of(" \t") != std::string::npos ? "\"" : "";
	Line += (Line.empty() ? "" : " ") + (Quote + Text) + Quote;
	return true;
}

// Where to reach who listens on every address: Windows connects to none of these. An address of IPv6 stands in brackets.
static FString HostToReach(const FString& Host)
{
	const FString Reached = Host == FString(TEXT("0.0.0.0")) ? FString(TEXT("127.0.0.1")) : Host == FString(TEXT("::")) ? FString(TEXT("::1")) : Host;
	const std::string Text = ToUtf8(Reached);
	return Text.find(':') != std::string::npos && Text.front() != '[' ? FString::Printf(TEXT("[%s]"), *Reached) : Reached;
}

// Runs that programs were started for: their folders are there only once the programs have made them. Game thread.
static std::vector<std::string> RunsGiven;

// A name that no run has yet, so that nothing is written over.
static FString FreeRunName(const FString& Folder, const FString& Wanted)
{
	const auto IsTaken = [&Folder](const FString& Name)
	{
		const FString Run = FPaths::Combine(Folder, Name);
		return FPaths::FileExists(FPaths::Combine(Run, TEXT("config.yaml"))) ||
			std::find(RunsGiven.begin(), RunsGiven.end(), ToUtf8(Run)) != RunsGiven.end();
	};
	FString Name = Wanted;
	for (int32 Number = 2; IsTaken(Name); ++Number)
	{
		Name = FString::Printf(TEXT("%s-%d"), *Wanted, Number);
	}
	return Name;
}

}

FString FConsacProgramSettings::GetRunsFolder() const
{
	const FString Runs = RunsFolder.IsEmpty() ? FPaths::Combine(FPaths::ProjectSavedDir(), TEXT("Consac")) : ConsacPlugin::FromUtf8(ConsacPlugin::ToFile(RunsFolder));
	return FPaths::ConvertRelativePathToFull(Runs);
}

FString FConsacProgramSettings::GetRunName() const
{
	return RunName.IsEmpty() ? FString(TEXT("unreal")) : RunName;
}

UConsacTrainerProgram::UConsacTrainerProgram()
	: Process(MakePimpl<FConsacProcess>())
{
}

bool UConsacTrainerProgram::Start(const FConsacProgramSettings& Settings, const TArray<FString>& MoreArguments, FString& Error)
{
	using consac::Status;
	using consac::StatusCode;
	if (IsRunning())
	{
		return ConsacPlugin::Explain(Status(StatusCode::kFailedPrecondition, "the trainer program is running already; Stop Trainer Program ends it"), Error);
	}
	const FString Program = Settings.Program.IsEmpty() ? ConsacPlugin::PackedProgram() : Settings.Program;
	if (!FPaths::FileExists(Program))
	{
		return ConsacPlugin::Explain(Status(StatusCode::kNotFound, "there is no program " + ConsacPlugin::ToUtf8(Program) + "; give its path in Program"), Error);
	}
	if (Settings.Port <= 0)
	{
		const std::string Given = std::to_string(Settings.Port);
		return ConsacPlugin::Explain(Status(StatusCode::kInvalidArgument, "there is no port " + Given + " to connect to; start the game first, or give a port"), Error);
	}
	const FString Folder = Settings.GetRunsFolder();
	const FString Name = ConsacPlugin::FreeRunName(Folder, Settings.GetRunName());
	TArray<FString> Arguments;
	Arguments.Add(TEXT("train"));
	Arguments.Add(FString::Printf(TEXT("tcp://%s:%d"), *ConsacPlugin::HostToReach(Settings.Host), Settings.Port));
	Arguments.Append({ TEXT("--name"), Name, TEXT("--dir"), Folder });
	if (!Settings.Algorithm.IsEmpty())
	{
		Arguments.Append({ TEXT("--algo"), Settings.Algorithm });
	}
	if (Settings.TotalSteps > 0)
	{
		Arguments.Append({ TEXT("--steps"), FString::Printf(TEXT("%lld"), Settings.TotalSteps) });
	}
	Arguments.Append(MoreArguments);
	std::string Line;
	for (int32 Index = 0; Index < Arguments.Num(); ++Index)
	{
		if (!ConsacPlugin::Quoted(Arguments[Index], Line))
		{
			// An access token is nobody's to read in a log.
			const bool bSecret = Index > 0 && Arguments[Index - 1] == FString(TEXT("--token"));
			const std::string Shown = bSecret ? "after --token" : ConsacPlugin::ToUtf8(Arguments[Index]);
			return ConsacPlugin::Explain(Status(StatusCode::kInvalidArgument, "the argument " + Shown + " has a quote, a line break, a \\ at its end, or blanks that do not last: two in a row or one at its beginning"), Error);
		}
	}
	const FString All = FString::Printf(TEXT("%s %s"), *ConsacPlugin::FromUtf8(Line), *Settings.ExtraArguments);
	Stop(); // closes the handle of one that has ended by itself
	// Detached: else to close the handle is to wait until it has ended, on Linux.
	Process->Handle = FPlatformProcess::CreateProc(*Program, *All, true, true, true, nullptr, 0, nullptr, nullptr);
	Process->ModelPath = FPaths::Combine(Folder, Name, TEXT("model.consac"));
	if (!Process->Handle.IsValid())
	{
		return ConsacPlugin::Explain(Status(StatusCode::kUnavailable, ConsacPlugin::ToUtf8(Program) + " could not be started"), Error);
	}
	ConsacPlugin::RunsGiven.push_back(ConsacPlugin::ToUtf8(FPaths::Combine(Folder, Name)));
	// Not the arguments: an access token may be among them.
	UE_LOG(LogConsac, Display, TEXT("started %s; its run is %s"), *Program, *Name);
	return ConsacPlugin::Explain(Status::Ok(), Error);
}

bool UConsacTrainerProgram::IsRunning()
{
	return Process->Handle.IsValid() && FPlatformProcess::IsProcRunning(Process->Handle);
}

void UConsacTrainerProgram::Stop()
{
	if (IsRunning())
	{
		FPlatformProcess::TerminateProc(Process->Handle, true);
	}
	if (Process->Handle.IsValid())
	{
		FPlatformProcess::CloseProc(Process->Handle);
	}
	Process->Handle = FProcHandle();
}

FString UConsacTrainerProgram::GetModelPath() const
{
	return Process->ModelPath;
}

void UConsacTrainerProgram::BeginDestroy()
{
	// A temporary object of Hot Reload has no state.
	if (Process.IsValid() && Process->Handle.IsValid())
	{
		FPlatformProcess::CloseProc(Process->Handle);
		Process->Handle = FProcHandle();
	}
	Super::BeginDestroy();
}
