// Copyright CONSAC authors. MIT License.
#include "ConsacLogTail.h"

#include "CoreGlobals.h"
#include "HAL/PlatformTime.h"
#include "Misc/OutputDeviceRedirector.h"
#include "Misc/ScopeLock.h"

FConsacLogTail::FConsacLogTail()
{
	GLog->AddOutputDevice(this);
}

FConsacLogTail::~FConsacLogTail()
{
	if (GLog != nullptr)
	{
		GLog->RemoveOutputDevice(this);
	}
}

void FConsacLogTail::Serialize(const TCHAR* V, ELogVerbosity::Type Verbosity, const FName& Category)
{
	const bool bMatters = Verbosity == ELogVerbosity::Error || Verbosity == ELogVerbosity::Warning;
	if (!bMatters || !Category.ToString().Contains(TEXT("LogConsac")))
	{
		return;
	}
	FConsacFault Fault;
	Fault.Text = V;
	Fault.bWarning = Verbosity == ELogVerbosity::Warning;
	Fault.Times = 1;
	Fault.When = FPlatformTime::Seconds();
	const FScopeLock Locked(&Lock);
	TArray<FConsacFault> Newer;
	Newer.Add(Fault);
	for (const FConsacFault& Earlier : Faults)
	{
		if (Earlier.Text == Fault.Text)
		{
			Newer[0].Times += Earlier.Times;
		}
		else if (Newer.Num() < Most)
		{
			Newer.Add(Earlier);
		}
	}
	Faults = Newer;
}

TArray<FConsacFault> FConsacLogTail::GetFaults() const
{
	const FScopeLock Locked(&Lock);
	return Faults;
}
