// Copyright CONSAC authors. MIT License.
#include "ConsacStepGuard.h"

#include "ConsacLog.h"
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
	int32 Guards = 0; // that live
	bool bUsedFixedStep = false;
	double FixedSeconds = 0.0;
};
static FStepBefore StepBefore;

// What makes frames wait, and how each was before the first guard.
struct FBrake
{
	const TCHAR* Name;
	float Before = 0.0f;
};
static FBrake Brakes[] = { { TEXT("t.MaxFPS") }, { TEXT("t.IdleWhenNotForeground") }, { TEXT("r.VSync") }, { TEXT("r.VSyncEditor") } };
static int32 SpeedGuards = 0; // that live

// A variable keeps the priority that it has: one that was set on the console would refuse anything less, and one that is put
// back must obey to whom it obeyed.
static void SetBrake(const FBrake& Brake, float Value)
{
	if (IConsoleVariable* Variable = IConsoleManager::Get().FindConsoleVariable(Brake.Name))
	{
		Variable->SetWithCurrentPriority(Value);
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

FConsacStepGuard::FConsacStepGuard(double StepSeconds)
{
	using ConsacPlugin::StepBefore;
	if (StepBefore.Guards++ == 0)
	{
		StepBefore.bUsedFixedStep = FApp::UseFixedTimeStep();
		StepBefore.FixedSeconds = FApp::GetFixedDeltaTime();
	}
	FApp::SetFixedDeltaTime(StepSeconds);
	FApp::SetUseFixedTimeStep(true);
	// The project's settings are not ours to change: they are a file that may be saved while this goes on.
	const UPhysicsSettings* Physics = UPhysicsSettings::Get();
	if (Physics != nullptr && static_cast<double>(Physics->MaxPhysicsDeltaTime) < StepSeconds)
	{
		UE_LOG(LogConsac, Warning, TEXT("a tick is %f s and physics does at most %f s of it: things will fall too slowly; raise Max Physics Delta Time in the project's Physics settings"),
			StepSeconds, Physics->MaxPhysicsDeltaTime);
	}
}

FConsacStepGuard::~FConsacStepGuard()
{
	using ConsacPlugin::StepBefore;
	if (--StepBefore.Guards == 0)
	{
		FApp::SetUseFixedTimeStep(StepBefore.bUsedFixedStep);
		FApp::SetFixedDeltaTime(StepBefore.FixedSeconds);
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
		if (const IConsoleVariable* Variable = IConsoleManager::Get().FindConsoleVariable(Brake.Name))
		{
			Brake.Before = Variable->GetFloat();
		}
		ConsacPlugin::SetBrake(Brake, 0.0f);
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
		ConsacPlugin::SetBrake(Brake, Brake.Before);
	}
	ConsacPlugin::LetEditorSleep();
}
