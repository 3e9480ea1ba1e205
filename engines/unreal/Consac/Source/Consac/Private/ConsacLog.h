// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Logging/LogMacros.h"

DECLARE_LOG_CATEGORY_EXTERN(LogConsac, Log, All);

namespace ConsacPlugin
{

/** An error, as a line in the log. What fails in every tick says so once: a text that came less than a second ago is not
 *  written again. Any thread. */
void LogError(const FString& Text);

/** Whatever comes next is written. */
void ForgetErrors();

}
