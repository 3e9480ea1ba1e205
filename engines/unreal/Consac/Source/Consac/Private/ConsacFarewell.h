// Copyright CONSAC authors. MIT License.
// What a training leaves to do that may take long: a learner finishes its piece of work, files are written.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"

/** Models to be written, each with its path. */
using FConsacModels = std::vector<std::pair<std::string, consac::ModelFile>>;

/** What is left of a training once its agents are free. Whoever holds it is the only one who does. */
struct FConsacFarewell
{
	// In this order: the driver goes before the world that it drives, and the recorders with it.
	std::unique_ptr<consac::host::TickWorld> World;
	std::vector<std::unique_ptr<consac::host::Recorder>> Recorders;
	std::unique_ptr<consac::host::Driver> Driver;
	std::vector<std::string> Behaviours; // their names
	FConsacModels Models;
	std::string ModelFolder;             // where what the driver has learned is kept; empty: nowhere
	std::string RecordFolder;            // where the recorders save; empty: nowhere

	/** Saves and ends it. What went wrong, or nothing. */
	std::string Do();

private:
	/** Writes the files. What went wrong: `Fault`, or something newer. */
	std::string Save(std::string Fault) const;
};

namespace ConsacPlugin
{

/** Adds the models of behaviours that have learned something, as BEHAVIOUR and `Ending`. What went wrong, or nothing. To be
 *  called by whoever has the driver. */
std::string CollectModels(const consac::host::Driver& Driver, const std::vector<std::string>& Behaviours, const std::string& Folder, const char* Ending, FConsacModels& Models);

// All of the following are the game thread's.

/** A training that is being seen out, on a thread of its own; by the caller where there is no thread to be had. */
struct FLeaving;

/** Sees a training out. Its own until Leave. */
FLeaving& SendOut(FConsacFarewell Training);

/** Whether it is done; waits for that at most so long. */
bool IsOut(FLeaving& One, double MostSeconds);

/** Nobody asks for it any more. What went wrong, as far as it is known by now; what goes wrong later is a line in the log. */
std::string Leave(FLeaving& One);

/** Waits for all that are still on their way, however long: the plugin is about to be unloaded, and their code with it. */
void AwaitFarewells();

}
