// Copyright CONSAC authors. MIT License.
#include "Modules/ModuleManager.h"

IMPLEMENT_MODULE(FDefaultModuleImpl, ConsacEditor)
