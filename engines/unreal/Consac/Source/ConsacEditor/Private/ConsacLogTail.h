// Copyright CONSAC authors. MIT License.
// What the plugin's log said last of what went wrong.
#pragma once

#include "CoreMinimal.h"
#include "HAL/CriticalSection.h"
#include "Logging/LogVerbosity.h"
#include "Misc/OutputDevice.h"

/** A line of the log. */
struct FConsacFault
{
	FString Text;
	bool bWarning = false;
	/** How often it came. */
	int32 Times = 0;
	/** When it came last, in seconds of FPlatformTime. */
	double When = 0.0;
};

/** Hears the log and keeps the latest errors and warnings of categories that begin with LogConsac. Any thread. */
class FConsacLogTail : public FOutputDevice
{
public:
	/** Most that are kept. */
	static constexpr int32 Most = 5;

	FConsacLogTail();
	virtual ~FConsacLogTail() override;
	FConsacLogTail(const FConsacLogTail&) = delete;
	FConsacLogTail& operator=(const FConsacLogTail&) = delete;

	virtual void Serialize(const TCHAR* V, ELogVerbosity::Type Verbosity, const FName& Category) override;

	/** What came, the latest first. */
	TArray<FConsacFault> GetFaults() const;

private:
	mutable FCriticalSection Lock;
	TArray<FConsacFault> Faults; // the latest first
};
