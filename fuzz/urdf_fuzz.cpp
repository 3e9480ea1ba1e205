// The readers of robots on any bytes: a URDF or MJCF that is a robot is written as URDF and as a joint table and read
// back with the same links where they were; meshes and joint tables are refused or read.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "consac/robot/kinematics.h"
#include "consac/robot/table.h"
#include "consac/twin/mesh.h"
#include "consac/twin/mjcf.h"
#include "consac/twin/urdf.h"

namespace {

using namespace consac;

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckTableComesBack(const robot::Robot& robot) {
  const std::string table = robot::WriteTable(robot, {"a.urdf", "urdf", "", ""});
  const Result<robot::Robot> again = robot::ReadTable(table);
  Require(again.ok() && robot::WriteTable(*again, {"a.urdf", "urdf", "", ""}) == table);
}

// Frames of the links where every joint has moved.
std::vector<robot::Transform> LinksOf(const robot::Robot& robot) {
  std::vector<double> positions(robot.position_joints.size());
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = 0.1 * static_cast<double>(i % 7 + 1);
  robot::Kinematics kinematics(robot);
  kinematics.Forward(positions);
  return {kinematics.links().begin(), kinematics.links().end()};
}

void CheckRobot(const robot::Robot& robot) {
  CheckTableComesBack(robot);
  const Result<twin::Model> model = twin::ReadUrdf(twin::WriteUrdf(robot, {}, {}));
  Require(model.ok());
  const Result<robot::Robot> again = robot::MakeRobot(model->robot);
  Require(again.ok() && again->links.size() == robot.links.size() && again->positions() == robot.positions());
  double reach = 1.0;  // m: what rounding is seen against
  for (const robot::Joint& joint : robot.joints) {
    reach += Norm(joint.rest.position);
    if (joint.type == robot::JointType::kPrismatic) reach += std::abs(joint.multiplier) + std::abs(joint.offset);
  }
  const std::vector<robot::Transform> before = LinksOf(robot), after = LinksOf(*again);
  for (std::size_t link = 0; link < before.size(); ++link) {
    Require(robot.links[link].name == again->links[link].name);
    Require(Norm(before[link].position - after[link].position) <= 1e-6 * reach);
    Require(AngleBetween(before[link].rotation, after[link].rotation) <= 1e-6);
  }
}

void CheckMesh(const Result<twin::Triangles>& mesh) {
  constexpr std::size_t kEnough = 2000;  // triangles; welding is no parser
  if (!mesh.ok() || mesh->count() > kEnough) return;
  Require(twin::Weld(*mesh).indices.size() == 3 * mesh->count());
  (void)twin::SolidOf(*mesh);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Result<twin::Model> model = twin::ReadUrdf(text);
  if (model.ok()) {
    const Result<robot::Robot> robot = robot::MakeRobot(model->robot);
    if (robot.ok()) CheckRobot(*robot);
  }
  const Result<twin::Model> mjcf = twin::ReadMjcf(text);
  if (mjcf.ok()) {
    const Result<robot::Robot> robot = robot::MakeRobot(mjcf->robot);
    if (robot.ok()) CheckRobot(*robot);
  }
  twin::Model pairs;
  (void)twin::ReadSrdf(text, &pairs);
  (void)robot::ReadTable(text);
  CheckMesh(twin::ReadStl(std::as_bytes(std::span<const std::uint8_t>(data, size))));
  CheckMesh(twin::ReadObj(text));
  CheckMesh(twin::ReadDae(text));
  // A buffer that is named is the file itself, so that its numbers are any.
  const auto bytes = std::as_bytes(std::span<const std::uint8_t>(data, size));
  CheckMesh(twin::ReadGltf(bytes, [&](const std::string& uri) -> Result<std::vector<std::byte>> {
    if (uri.starts_with("data:")) return twin::GltfBase64(uri);
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  }));
  return 0;
}
