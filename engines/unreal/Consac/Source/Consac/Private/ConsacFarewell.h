// Copyright CONSAC authors. MIT License.
// The end of a training that may take long: a learner finishes its piece of work, files are written.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"

/** What is left of a training once its agents are free. Whoever holds it is the only one who does. */
struct FConsacFarewell
{
	// In this order: the driver goes before the world that it drives, and the recorders with it.
	std::unique_ptr<consac::host::TickWorld> World;
	std::vector<std::unique_ptr<consac::host::Recorder>> Recorders;
	std::unique_ptr<consac::host::Driver> Driver;
	std::vector<std::string> Behaviours; // their names
	std::string ModelFolder;             // where what was learned is kept; empty: nowhere
	std::string RecordFolder;            // where the recorders save; empty: nowhere

	/** Saves and ends it. What went wrong, or nothing. */
	std::string Do();
};

namespace ConsacPlugin
{

/** The models of behaviours that have learned something, as BEHAVIOUR and `Ending`. What went wrong, or nothing. */
std::string KeepModels(consac::host::Driver& Driver, const std::vector<std::string>& Behaviours, const std::string& Folder, const char* Ending);

/** Sees a training out on a thread of its own, and waits for that at most so long. What went wrong, as far as it is known by
 *  then; what goes wrong later is a line in the log. Game thread. */
std::string SeeOut(FConsacFarewell Training, double MostSeconds);

/** Waits for all that are still on their way: the plugin is about to be unloaded. */
void AwaitFarewells();

}
