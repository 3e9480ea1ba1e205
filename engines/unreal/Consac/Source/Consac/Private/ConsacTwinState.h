// Copyright CONSAC authors. MIT License.
// What is behind a UConsacTwinComponent that plays.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"
#include "UObject/Object.h"

// A link's body: its first mesh.
struct FConsacTwinBody
{
	int32 Component = -1;           // among what was made; -1 none
	consac::robot::Transform Place; // in the link's frame
	bool bSimulates = false;
};

// What holds a joint's two bodies.
struct FConsacTwinConstraint
{
	int32 Component = -1;   // among what was made
	int32 Joint = 0;
	double Reference = 0.0; // rad or m, where its bodies were when it was made
};

struct FConsacTwinState
{
	std::optional<consac::robot::Posture> Posture; // where it is
	std::optional<consac::robot::Posture> Wanted;  // with physics: where its drives pull
	std::vector<FName> Joints;                     // their names here
	std::vector<FName> Links;
	std::vector<FConsacTwinBody> Bodies; // [links]
	std::vector<FConsacTwinConstraint> Constraints;

	// What a node sets.
	consac::robot::Posture& Asked() { return Wanted ? *Wanted : *Posture; }
};

namespace ConsacPlugin
{

/** Whether it went; if not, the log says why, and of which twin. */
bool TellTwin(const UObject& Of, const consac::Status& Status);

}
