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

}

FConsacStepGuard::FConsacStepGuard(double StepSeconds)
	: bUsedFixedStep(FApp::UseFixedTimeStep()), FixedSeconds(FApp::GetFixedDeltaTime())
{
	FApp::SetFixedDeltaTime(StepSeconds);
	FApp::SetUseFixedTimeStep(true);
	if (IConsoleVariable* Limit = ConsacPlugin::FrameLimit())
	{
		MaxFramesPerSecond = Limit->GetFloat();
		Limit->Set(0.0f);
	}
	if (UPhysicsSettings* Physics = UPhysicsSettings::Get())
	{
		MaxPhysicsSeconds = Physics->MaxPhysicsDeltaTime;
		bSubstepped = Physics->bSubstepping;
		// Physics that may do less than a tick's time in a tick runs slower than the game.
		Physics->MaxPhysicsDeltaTime = MaxPhysicsSeconds < static_cast<float>(StepSeconds) ? static_cast<float>(StepSeconds) : MaxPhysicsSeconds;
		Physics->bSubstepping = false;
	}
}

FConsacStepGuard::~FConsacStepGuard()
{
	FApp::SetUseFixedTimeStep(bUsedFixedStep);
	FApp::SetFixedDeltaTime(FixedSeconds);
	if (IConsoleVariable* Limit = ConsacPlugin::FrameLimit())
	{
		Limit->Set(MaxFramesPerSecond);
	}
	if (UPhysicsSettings* Physics = UPhysicsSettings::Get())
	{
		Physics->MaxPhysicsDeltaTime = MaxPhysicsSeconds;
		Physics->bSubstepping = bSubstepped;
	}
}
