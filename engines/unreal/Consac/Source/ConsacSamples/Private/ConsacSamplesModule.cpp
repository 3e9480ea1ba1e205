// Copyright CONSAC authors. MIT License.
#include "ConsacSampleLog.h"
#include "Logging/LogMacros.h"
#include "Modules/ModuleManager.h"

DEFINE_LOG_CATEGORY(LogConsacSamples);

IMPLEMENT_MODULE(FDefaultModuleImpl, ConsacSamples)
