// Copyright CONSAC authors. MIT License.
#include "ConsacStepGuard.h"

#include "HAL/IConsoleManager.h"
#include "Misc/App.h"
#include "PhysicsEngine/PhysicsSettings.h"

namespace ConsacPlugin
{

static IConsoleVariable* FrameLimit()
{
	return IConsoleManager::Get().FindConsoleVariable(TEXT("t.MaxFPS"));
}

// The settings as they were before the first guard.
struct FSettingsBefore
{
	int32 Guards = 0;  // that live
	bool bUsedFixedStep = false;
	double FixedSeconds = 0.0;
	float MaxFramesPerSecond = 0.0f;
	float MaxPhysicsSeconds = 0.0f;
	bool bSubstepped = false;
};

static FSettingsBefore Before;

static void KeepSettings()
{
	Before.bUsedFixedStep = FApp::UseFixedTimeStep();
	Before.FixedSeconds = FApp::GetFixedDeltaTime();
	if (const IConsoleVariable* Limit = FrameLimit())
	{
		Before.MaxFramesPerSecond = Limit->GetFloat();
	}
	if (const UPhysicsSettings* Physics = UPhysicsSettings::Get())
	{
		Before.MaxPhysicsSeconds = Physics->MaxPhysicsDeltaTime;
		Before.bSubstepped = Physics->bSubstepping;
	}
}

}

FConsacStepGuard::FConsacStepGuard(double StepSeconds)
{
	if (ConsacPlugin::Before.Guards++ == 0)
	{
		ConsacPlugin::KeepSettings();
	}
	FApp::SetFixedDeltaTime(StepSeconds);
	FApp::SetUseFixedTimeStep(true);
	if (IConsoleVariable* Limit = ConsacPlugin::FrameLimit())
	{
		Limit->Set(0.0f);
	}
	if (UPhysicsSettings* Physics = UPhysicsSettings::Get())
	{
		// Physics that may do less than a tick's time in a tick runs slower than the game.
		const float Seconds = static_cast<float>(StepSeconds);
		Physics->MaxPhysicsDeltaTime = Physics->MaxPhysicsDeltaTime < Seconds ? Seconds : Physics->MaxPhysicsDeltaTime;
		Physics->bSubstepping = false;
	}
}

FConsacStepGuard::~FConsacStepGuard()
{
	if (--ConsacPlugin::Before.Guards > 0)
	{
		return;
	}
	FApp::SetUseFixedTimeStep(ConsacPlugin::Before.bUsedFixedStep);
	FApp::SetFixedDeltaTime(ConsacPlugin::Before.FixedSeconds);
	if (IConsoleVariable* Limit = ConsacPlugin::FrameLimit())
	{
		Limit->Set(ConsacPlugin::Before.MaxFramesPerSecond);
	}
	if (UPhysicsSettings* Physics = UPhysicsSettings::Get())
	{
		Physics->MaxPhysicsDeltaTime = ConsacPlugin::Before.MaxPhysicsSeconds;
		Physics->bSubstepping = ConsacPlugin::Before.bSubstepped;
	}
}
