#include "read_model.h"

#include <cmath>
#include <filesystem>

#include "cad_model.h"
#include "consac/base/file.h"
#include "consac/base/text.h"
#include "consac/robot/table.h"
#include "consac/twin/import.h"
#include "consac/twin/urdf.h"
#include "files.h"
#include "xml.h"

namespace consac::twin {

Status Of(const std::string& file, const Status& status) {
  return {status.code(), "'" + file + "': " + status.message()};
}

Result<std::string> ReadText(const std::string& path) {
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(path, kMostXmlBytes);
  if (!bytes.ok()) return bytes.status();
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

Result<Model> ReadModelAndText(const std::string& path, std::string* text) {
  const std::string ending = EndingOf(path);
  if (IsCad(path))
    return Status{StatusCode::kInvalidArgument,
                  "'" + path + "' is a CAD file; make a twin of it first: consac twin import"};
  if (ending == ".xacro")
    return Status{StatusCode::kInvalidArgument,
                  "'" + path + "' is xacro; make a URDF of it first: xacro FILE > robot.urdf"};
  Result<std::string> read = ReadText(path);
  if (!read.ok()) return read.status();
  *text = std::move(*read);
  XmlReader xml(*text);
  Result<Model> model = xml.root().name() == std::string_view("mujoco") ? ReadMjcf(xml) : ReadUrdf(xml);
  if (!model.ok()) return Of(path, model.status());
  return model;
}

Result<Model> ReadModel(const std::string& path) {
  std::string text;
  return ReadModelAndText(path, &text);
}

std::vector<std::string> WideLimits(const robot::Robot& robot) {
  constexpr double kTurn = 2.0 * robot::kPiRadians, kMostTurns = 4.0, kNone = 1e6;
  const auto in_radians = [](double degrees) { return std::round(degrees * kTurn / 360.0 * 1e4) / 1e4; };  // to read
  std::vector<std::string> lines;
  for (const robot::Joint& joint : robot.joints) {
    const double lower = joint.drive.lower, upper = joint.drive.upper, turns = (upper - lower) / kTurn;
    if (joint.type != robot::JointType::kRevolute || !(turns > kMostTurns) || lower <= -kNone || upper >= kNone)
      continue;
    lines.push_back("joint " + Quote(joint.name) + ": its limits of " + NumberText(lower) + " to " + NumberText(upper) +
                    " rad are " + std::to_string(std::llround(turns)) +
                    " turns apart; URDF is in radians: if these are degrees, write " + NumberText(in_radians(lower)) +
                    " and " + NumberText(in_radians(upper)));
  }
  return lines;
}

Result<robot::Robot> LoadRobot(const std::string& path) {
  std::error_code error;
  const std::string file = std::filesystem::is_directory(ToPath(path), error) ? path + "/" + kTableName : path;
  if (EndingOf(file) != ".json") {
    const Result<Model> model = ReadModel(file);
    if (!model.ok()) return model.status();
    Result<robot::Robot> robot = MakeRobot(model->robot);
    if (!robot.ok()) return Of(file, robot.status());
    return robot;
  }
  const Result<std::string> text = ReadText(file);
  if (!text.ok()) return text.status();
  Result<robot::Robot> robot = robot::ReadTable(*text);
  if (!robot.ok()) return Of(file, robot.status());
  return robot;
}

}  // namespace consac::twin
