// The readers of robots on any bytes: a URDF that is a robot is written and read back with the same links where they
// were; meshes and joint tables are refused or read.
#include <cstdint>
#include <cstdlib>
#include <string>

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
    if (robot.ok()) {
      const std::string written = twin::WriteUrdf(*robot, {}, {});
      const Result<twin::Model> again = twin::ReadUrdf(written);
      Require(again.ok());
      Require(robot::MakeRobot(again->robot).ok());
      CheckTableComesBack(*robot);
    }
  }
  const Result<twin::Model> mjcf = twin::ReadMjcf(text);
  if (mjcf.ok()) {
    const Result<robot::Robot> robot = robot::MakeRobot(mjcf->robot);
    if (robot.ok()) CheckTableComesBack(*robot);
  }
  twin::Model pairs;
  (void)twin::ReadSrdf(text, &pairs);
  (void)robot::ReadTable(text);
  CheckMesh(twin::ReadStl(std::as_bytes(std::span<const std::uint8_t>(data, size))));
  CheckMesh(twin::ReadObj(text));
  CheckMesh(twin::ReadDae(text));
  return 0;
}
