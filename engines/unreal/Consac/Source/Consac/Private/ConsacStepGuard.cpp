// Copyright CONSAC authors. MIT License.
#include "ConsacStepGuard.h"

#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "Engine/World.h"
#include "GameFramework/WorldSettings.h"
#include "HAL/IConsoleManager.h"
#include "Logging/LogMacros.h"
#include "Misc/App.h"
#include "PhysicsEngine/PhysicsSettings.h"
#if WITH_EDITOR
#include "Editor.h"
#include "Editor/EditorEngine.h"
#endif

namespace ConsacPlugin
{

// The settings as they were before the first guard of a kind.
struct FStepBefore
{
	std::vector<std::pair<const FConsacStepGuard*, double>> Guards; // that live, and the seconds of their ticks
	bool bUsedFixedStep = false;
	double FixedSeconds = 0.0;
};
static FStepBefore StepBefore;

// A limit that nobody reaches. At 0 the editor has a limit of its own, and Smooth Frame Rate another.
constexpr float ManyFrames = 100000.0f; // a second

// What makes frames wait, how each is while they do not, and how it was before the first guard.
struct FBrake
{
	const TCHAR* Name;
	float Released;
	float Before = 0.0f;
};
static FBrake Brakes[] = { { TEXT("t.MaxFPS"), ManyFrames }, { TEXT("t.IdleWhenNotForeground"), 0.0f }, { TEXT("r.VSync"), 0.0f },
	{ TEXT("r.VSyncEditor"), 0.0f }, { TEXT("r.DontLimitOnBattery"), 1.0f } };
static int32 SpeedGuards = 0; // that live

// A variable keeps the priority that it has: one that was set on the console would refuse anything less, and one that is put
// back must obey to whom it obeyed.
static void Release(FBrake& Brake)
{
	if (IConsoleVariable* Variable = IConsoleManager::Get().FindConsoleVariable(Brake.Name))
	{
		Brake.Before = Variable->GetFloat();
		Variable->SetWithCurrentPriority(Brake.Released);
	}
}

// What somebody has changed meanwhile stays as it is.
static void PutBack(const FBrake& Brake)
{
	IConsoleVariable* Variable = IConsoleManager::Get().FindConsoleVariable(Brake.Name);
	if (Variable != nullptr && Variable->GetFloat() == Brake.Released)
	{
		Variable->SetWithCurrentPriority(Brake.Before);
	}
}

#if WITH_EDITOR
static FDelegateHandle Unthrottled;

static bool NeverThrottle()
{
	return true;
}

static void LetEditorRun()
{
	if (GEditor != nullptr)
	{
		GEditor->ShouldDisableCPUThrottlingDelegates.Add(UEditorEngine::FShouldDisableCPUThrottling::CreateStatic(&NeverThrottle));
		Unthrottled = GEditor->ShouldDisableCPUThrottlingDelegates.Last().GetHandle();
	}
}

static void LetEditorSleep()
{
	if (GEditor != nullptr)
	{
		GEditor->ShouldDisableCPUThrottlingDelegates.RemoveAll([](const UEditorEngine::FShouldDisableCPUThrottling& Asked)
		{
			return Asked.GetHandle() == Unthrottled;
		});
	}
}
#else
static void LetEditorRun()
{
}

static void LetEditorSleep()
{
}
#endif

}

FConsacStepGuard::FConsacStepGuard(double StepSeconds, const UWorld& World)
{
	using ConsacPlugin::StepBefore;
	if (StepBefore.Guards.empty())
	{
		StepBefore.bUsedFixedStep = FApp::UseFixedTimeStep();
		StepBefore.FixedSeconds = FApp::GetFixedDeltaTime();
	}
	StepBefore.Guards.emplace_back(this, StepSeconds);
	FApp::SetFixedDeltaTime(StepSeconds);
	FApp::SetUseFixedTimeStep(true);
	// The project's settings are not ours to change: they are a file that may be saved while this goes on.
	const UPhysicsSettings* Physics = UPhysicsSettings::Get();
	if (Physics != nullptr && static_cast<double>(Physics->MaxPhysicsDeltaTime) < StepSeconds)
	{
		UE_LOG(LogConsac, Warning, TEXT("a tick is %f s and physics does at most %f s of it: things will fall too slowly; raise Max Physics Delta Time in the project's Physics settings"),
			StepSeconds, Physics->MaxPhysicsDeltaTime);
	}
	const AWorldSettings* Level = World.GetWorldSettings();
	if (Level != nullptr && (StepSeconds < static_cast<double>(Level->MinUndilatedFrameTime) || StepSeconds > static_cast<double>(Level->MaxUndilatedFrameTime)))
	{
		UE_LOG(LogConsac, Warning, TEXT("a tick is to be %f s and this level allows %f to %f s: each will be the nearest of these; change Min or Max Undilated Frame Time in its World Settings"),
			StepSeconds, Level->MinUndilatedFrameTime, Level->MaxUndilatedFrameTime);
	}
}

FConsacStepGuard::~FConsacStepGuard()
{
	using ConsacPlugin::StepBefore;
	std::erase_if(StepBefore.Guards, [this](const auto& Guard) { return Guard.first == this; });
	if (StepBefore.Guards.empty())
	{
		FApp::SetUseFixedTimeStep(StepBefore.bUsedFixedStep);
		FApp::SetFixedDeltaTime(StepBefore.FixedSeconds);
	}
	else
	{
		FApp::SetFixedDeltaTime(StepBefore.Guards.back().second);
	}
}

FConsacSpeedGuard::FConsacSpeedGuard()
{
	if (ConsacPlugin::SpeedGuards++ > 0)
	{
		return;
	}
	for (ConsacPlugin::FBrake& Brake : ConsacPlugin::Brakes)
	{
		ConsacPlugin::Release(Brake);
	}
	ConsacPlugin::LetEditorRun();
}

FConsacSpeedGuard::~FConsacSpeedGuard()
{
	if (--ConsacPlugin::SpeedGuards > 0)
	{
		return;
	}
	for (const ConsacPlugin::FBrake& Brake : ConsacPlugin::Brakes)
	{
		ConsacPlugin::PutBack(Brake);
	}
	ConsacPlugin::LetEditorSleep();
}
