// What comes from consac-cad and from people about an assembly, on any bytes: a stream that is read has joints that
// make a robot, and so have hints that are taken.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "consac/robot/robot.h"
#include "consac/twin/cad.h"
#include "consac/twin/cad_joints.h"
#include "consac/twin/mesh.h"

namespace {

using namespace consac;

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckRobot(const Result<twin::CadRobot>& found) {
  if (!found.ok()) return;
  Require(robot::MakeRobot(found->robot).ok() || found->robot.links.size() > robot::kMostLinks);
  Require(found->link_place.size() == found->robot.links.size() && found->masses.size() == found->link_place.size());
}

// A base, an arm on a pin in it, and a tool.
twin::CadAssembly Arm() {
  const auto face = [](double radius, bool bore) {
    return twin::CadCylinder{{0, 0, 0}, {0, 0, 1}, radius, 0.0, 0.02, 6.28, bore};
  };
  twin::CadAssembly arm;
  arm.format = "step";
  arm.parts = {{"base", {-1, -1, -1}, {1, 1, 1}, {face(0.0081, true)}},
               {"arm", {0, 0, 0}, {0.1, 0.1, 0.1}, {face(0.008, false)}},
               {"tool", {0, 0, 0}, {0.1, 0.1, 0.1}, {}}};
  arm.nodes = {{"robot", -1, -1, {}, {}}, {"base", 0, 0, {}, {}}, {"arm", 0, 1, {}, {}}, {"tool", 0, 2, {}, {}}};
  return arm;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Result<twin::CadAssembly> assembly = twin::ReadCad(std::as_bytes(std::span<const std::uint8_t>(data, size)));
  if (assembly.ok()) {
    for (std::size_t part = 0; part < assembly->parts.size(); ++part) (void)twin::TrianglesOf(*assembly, part);
    CheckRobot(twin::FindJoints(*assembly, {}));
  }
  const Result<twin::JointHints> hints = twin::ReadHints({reinterpret_cast<const char*>(data), size});
  if (hints.ok()) CheckRobot(twin::FindJoints(Arm(), *hints));
  return 0;
}
