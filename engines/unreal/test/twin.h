#pragma once
// What the tests of twins share: a robot's table as a file, a twin in a running game, and where its components are.

#include "ConsacTwin.h"
#include "ConsacTwinActor.h"
#include "ConsacTwinComponent.h"
#include "consac/robot/conventions.h"
#include "consac/robot/table.h"
#include "graphs.h"
#include "tests/files.h"
#include "twin/test/twin_files.h"

namespace consac::testing {

inline const std::string kYumi = std::string(CONSAC_SOURCE_DIR) + "/examples/robots/yumi";

/// ABB's YuMi, as the program's twin import reads it.
inline const robot::Robot& Yumi() {
  static const robot::Robot robot = *twin::LoadRobot(kYumi + "/yumi_description/urdf/yumi_calibrated.urdf");
  return robot;
}

/// Its twin.json.
inline std::string TableOf(const robot::Robot& robot) {
  return robot::WriteTable(robot, {"robot.urdf", "urdf", "", ""});
}

/// A twin of that table, which begins to play.
inline UConsacTwinComponent* SpawnTwin(Shim::Game& game, const std::string& file) {
  return game.SpawnWith<AConsacTwinActor>([&](AConsacTwinActor& actor) { actor.Robot->Path = Text(file); })->Robot;
}

/// A component's frame in its parent component's, as Unreal writes it.
inline robot::Transform RelativeOf(const USceneComponent& component) {
  const FVector& p = component.shim_location_;
  const FQuat& q = component.shim_rotation_;
  return {{q.X, q.Y, q.Z, q.W}, {p.X, p.Y, p.Z}};
}

/// Its frame in `root`'s. Unreal composes quaternions and vectors as everybody does.
inline robot::Transform FrameIn(const USceneComponent& root, const USceneComponent* component) {
  robot::Transform at;
  for (; component != &root; component = component->shim_parent_) at = RelativeOf(*component) * at;
  return at;
}

/// A position as nodes take it: degrees or centimetres.
inline double AsNodesTakeIt(const robot::Joint& joint, double position) {
  const double degree = 180.0 / robot::kPiRadians;
  return joint.type == robot::JointType::kPrismatic ? 100.0 * position : degree * position;
}

}  // namespace consac::testing
