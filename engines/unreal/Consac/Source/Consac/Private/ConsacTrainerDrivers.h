// Copyright CONSAC authors. MIT License.
// Who drives a Consac Trainer's agents, as its properties say.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"

class AConsacTrainer;

namespace ConsacPlugin
{

using FDriverResult = consac::Result<std::unique_ptr<consac::host::Driver>>;

/** The driver of the trainer's Mode. The error says which property does not fit. */
FDriverResult DriverFor(const AConsacTrainer& Trainer, consac::host::TickWorld& World);

}
