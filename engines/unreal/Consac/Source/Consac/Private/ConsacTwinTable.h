// Copyright CONSAC authors. MIT License.
// What is behind a UConsacTwin, and a robot's numbers as Unreal writes them.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"

struct FConsacTwinTable
{
	std::optional<consac::robot::Robot> Robot;  // none until the file is asked for
	bool bTried = false;                        // to read the file of an asset
};

namespace ConsacPlugin
{

/** A frame of the robot's: centimetres, left-handed. */
FTransform ToTransform(const consac::robot::Transform& Frame);
/** And back; a scale is left out. */
consac::robot::Transform FromTransform(const FTransform& Written);
/** A joint's position, rad or m, as degrees or centimetres. */
double ToDegreesOrCentimetres(const consac::robot::Joint& Joint, double Position);
/** And back. */
double FromDegreesOrCentimetres(const consac::robot::Joint& Joint, double Position);
/** The robot of a twin.json. Fails also where two of its joints, or of its links, differ by capitals alone: names here do not. */
consac::Result<consac::robot::Robot> ReadTwin(std::span<const std::byte> Bytes);

}
