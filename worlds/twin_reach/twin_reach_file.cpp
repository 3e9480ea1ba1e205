// Reads what comes after "twin-reach-v0:": a twin, or a file that names one and says more about the task.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/robot/table.h"
#include "worlds/mujoco/mujoco.h"
#include "worlds/twin_reach/twin_reach.h"

namespace consac::worlds {
namespace {

constexpr const char *kId = "twin-reach-v0:", *kMujocoId = "twin-reach-mujoco-v0:";
constexpr std::size_t kMostTableBytes = std::size_t{64} << 20;
constexpr JsonLimits kFileLimits{std::size_t{1} << 20, 4096, 4};
constexpr std::string_view kMembers[] = {"twin", "tool", "tool_point", "ready", "goals", "near"};

Result<std::string> ReadText(const std::string& path) {
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(path, kMostTableBytes);
  if (!bytes.ok()) return bytes.status();
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

bool IsFolder(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_directory(ToPath(path), error);
}

// A robot, and where its table lies.
struct Twin {
  robot::Robot robot;
  std::string table;
};

// Whether it is what `consac twin import` reads: XML (URDF, MJCF, xacro), STEP, IGES (an S in column 73).
bool IsRobotFile(std::string_view text) {
  constexpr std::size_t kIgesSection = 72, kIgesLine = 80;
  const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
  if (line.size() == kIgesLine && line[kIgesSection] == 'S' && !line.starts_with('{')) return true;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  return text.starts_with('<') || text.starts_with("ISO-10303-21");
}

// A twin's folder, or its table.
Result<Twin> ReadTwin(const std::string& path) {
  const std::string file = IsFolder(path) ? path + "/twin.json" : path;
  const Result<std::string> text = ReadText(file);
  if (!text.ok()) {
    return Status{StatusCode::kFailedPrecondition,
                  "no twin is at " + Quote(path) + " (" + text.status().message() +
                      "); make it with `consac twin import`, or name the world where it is: twin-reach-v0:FOLDER"};
  }
  Result<robot::Robot> robot = robot::ReadTable(*text);
  if (robot.ok()) return Twin{std::move(*robot), file};
  return Status{robot.status().code(), Quote(file) + ": " + robot.status().message()};
}

Status Expected(std::string_view member, std::string_view what) {
  return {StatusCode::kInvalidArgument, Quote(member) + " is not " + std::string(what)};
}

bool ReadPoint(const nlohmann::json& json, std::array<double, 3>* point) {
  if (!json.is_array() || json.size() != 3) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!json[i].is_number()) return false;
    (*point)[i] = json[i].get<double>();
    if (!(std::abs((*point)[i]) <= 1e3)) return false;  // m: a unit error
  }
  return true;
}

Status ReadReady(const nlohmann::json& json, TwinReachChoice* choice) {
  if (!json.is_object()) return Expected("ready", "an object {\"JOINT\": rad or m, ...}");
  for (const auto& [name, position] : json.items()) {
    if (!position.is_number()) return Expected("ready/" + name, "a number, rad or m");
    choice->ready.emplace_back(name, position.get<double>());
  }
  return Status::Ok();
}

Status ReadGoals(const nlohmann::json& json, TwinReachChoice* choice) {
  TwinReachChoice::Box box;
  bool good = json.is_object() && json.size() == 2 && json.contains("low") && json.contains("high") &&
              ReadPoint(json["low"], &box.low) && ReadPoint(json["high"], &box.high);
  bool room = false;
  for (std::size_t i = 0; good && i < 3; ++i) {
    good = box.low[i] <= box.high[i];
    room = room || box.low[i] < box.high[i];
  }
  if (!good || !room) return Expected("goals", "{\"low\": [x, y, z], \"high\": [x, y, z]}, m, low below high");
  choice->goals = box;
  return Status::Ok();
}

Status ReadChoice(const nlohmann::json& json, TwinReachChoice* choice) {
  for (const auto& [name, value] : json.items()) {
    if (std::find(std::begin(kMembers), std::end(kMembers), name) == std::end(kMembers))
      return {StatusCode::kInvalidArgument, "unknown member " + Quote(name) + Suggestion(name, kMembers)};
  }
  if (json.contains("tool")) {
    if (!json["tool"].is_string()) return Expected("tool", "the name of a link");
    choice->tool = json["tool"].get<std::string>();
  }
  if (json.contains("tool_point")) {
    std::array<double, 3> point{};
    if (!ReadPoint(json["tool_point"], &point)) return Expected("tool_point", "[x, y, z] in the link's frame, m");
    choice->tool_point = robot::Vector3{point[0], point[1], point[2]};
  }
  if (json.contains("ready")) CONSAC_RETURN_IF_ERROR(ReadReady(json["ready"], choice));
  if (json.contains("goals")) CONSAC_RETURN_IF_ERROR(ReadGoals(json["goals"], choice));
  if (json.contains("near")) {
    if (!json["near"].is_number() || !(json["near"].get<double>() > 0.0))
      return Expected("near", "a length above 0, m");
    choice->threshold = json["near"].get<double>();
  }
  return Status::Ok();
}

// The twin that a file names, beside which it lies, and what the file says of the task.
Result<Twin> ReadTaskFile(const std::string& path, const std::string& text, TwinReachChoice* choice) {
  const auto in_file = [&](const Status& status) {
    return Status{status.code(), Quote(path) + ": " + status.message()};
  };
  const Result<nlohmann::json> json = ReadJson<nlohmann::json>(text, kFileLimits);
  if (!json.ok()) return in_file(json.status());
  if (!json->is_object() || !json->contains("twin") || !(*json)["twin"].is_string())
    return in_file(Expected("twin", "the folder of a twin, beside this file"));
  const Status read = ReadChoice(*json, choice);
  if (!read.ok()) return in_file(read);
  return ReadTwin(FromPath(ToPath(path).parent_path() / ToPath((*json)["twin"].get<std::string>())));
}

}  // namespace

Result<std::shared_ptr<const ReachTask>> ReadTwinReach(std::string_view argument, TwinReachPhysics physics) {
  const std::string path(argument);
  TwinReachChoice choice;
  const Result<std::string> text = IsFolder(path) ? Result<std::string>(std::string()) : ReadText(path);
  if (text.ok() && IsRobotFile(*text))
    return Status{
        StatusCode::kInvalidArgument,
        Quote(path) + " is a robot's description, not a twin; make one of it first: consac twin import " + path +
            " -o twin, then name its folder: " + (physics == TwinReachPhysics::kMujoco ? kMujocoId : kId) + "twin"};
  const bool is_task = text.ok() && !text->empty() && text->find("\"consac-twin\"") == std::string::npos;
  Result<Twin> twin = is_task ? ReadTaskFile(path, *text, &choice) : ReadTwin(path);
  if (!twin.ok()) return twin.status();
  std::shared_ptr<const ReachDynamics> dynamics;
  const bool moved = physics == TwinReachPhysics::kMujoco;
  if (moved) {
    Result<std::shared_ptr<const ReachDynamics>> loaded =
        LoadMujoco(FromPath(ToPath(twin->table).parent_path() / "twin.xml"), twin->robot);
    if (!loaded.ok()) return loaded.status();
    dynamics = std::move(*loaded);
  }
  Result<std::shared_ptr<const ReachTask>> task =
      TwinReachTask(std::move(twin->robot), choice, (moved ? kMujocoId : kId) + path);
  if (!task.ok()) return Status{task.status().code(), Quote(path) + ": " + task.status().message()};
  if (!moved) return task;
  auto with_dynamics = std::make_shared<ReachTask>(**task);
  with_dynamics->dynamics = std::move(dynamics);
  return std::shared_ptr<const ReachTask>(std::move(with_dynamics));
}

std::string TwinReachText(const ReachTask& task, std::string_view twin) {
  const ReachTool& tool = task.tools[0];
  const robot::Vector3 point = tool.frame.offset.position;
  nlohmann::ordered_json ready = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < task.ready.size(); ++i)
    ready[task.robot.joints[static_cast<std::size_t>(task.robot.position_joints[i])].name] = task.ready[i];
  const nlohmann::ordered_json file = {{"twin", twin},
                                       {"tool", task.robot.links[static_cast<std::size_t>(tool.frame.link)].name},
                                       {"tool_point", {point.x, point.y, point.z}},
                                       {"ready", std::move(ready)},
                                       {"goals", {{"low", tool.low}, {"high", tool.high}}},
                                       {"near", task.threshold}};
  return JsonText(file, 2) + "\n";
}

}  // namespace consac::worlds
