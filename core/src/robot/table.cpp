#include "consac/robot/table.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/robot/conventions.h"

namespace consac::robot {
namespace {

using TableJson = nlohmann::ordered_json;

constexpr int kTableVersion = 1;

TableJson Numbers3(Vector3 v) {
  return TableJson::array({v.x, v.y, v.z});
}

TableJson Numbers4(const Quaternion& q) {
  return TableJson::array({q.x, q.y, q.z, q.w});
}

// JSON knows no infinity: what has no limit is null.
TableJson OrNull(double value) {
  return std::isfinite(value) ? TableJson(value) : TableJson(nullptr);
}

TableJson Pose(Convention convention, const Transform& transform) {
  const Transform written = TransformIn(convention, transform);
  return {{"translation", Numbers3(written.position)}, {"rotation", Numbers4(written.rotation)}};
}

TableJson LinkRow(const Link& link) {
  TableJson row = {{"name", link.name}};
  if (!link.inertial.has_value()) return row;
  row["mass"] = link.inertial->mass;
  row["centre_of_mass"] = Numbers3(link.inertial->centre);
  row["inertia"] = link.inertial->inertia;
  return row;
}

TableJson JointRow(const Robot& robot, const NodeNames& nodes, std::size_t j) {
  const Joint& joint = robot.joints[j];
  TableJson row;
  row["name"] = joint.name;
  row["type"] = NameOf(joint.type);
  row["parent"] = robot.links[static_cast<std::size_t>(joint.parent)].name;
  row["child"] = robot.links[j + 1].name;
  row["frame_node"] = nodes.frames[j];
  row["frame_node_index"] = 1 + 2 * j;
  row["node"] = nodes.joints[j];
  row["node_index"] = 2 + 2 * j;
  row["rest"] = {{"robot", Pose(Convention::kRobot, joint.rest)},
                 {"gltf", Pose(Convention::kGltf, joint.rest)},
                 {"unreal", Pose(Convention::kUnreal, joint.rest)}};
  row["axis"] = Numbers3({1, 0, 0});
  row["file_axis"] = Numbers3(joint.file_axis);
  row["axis_turn"] = Numbers4(joint.axis_turn);
  row["lower"] = OrNull(joint.drive.lower);
  row["upper"] = OrNull(joint.drive.upper);
  row["velocity"] = OrNull(joint.drive.velocity);
  row["effort"] = OrNull(joint.drive.effort);
  row["damping"] = joint.drive.damping;
  row["friction"] = joint.drive.friction;
  if (joint.mimics >= 0) {
    row["mimic"] = {{"joint", robot.LeaderOf(joint).name}, {"multiplier", joint.multiplier}, {"offset", joint.offset}};
  }
  row["source"] = joint.source;
  return row;
}

// Reads members; the first that does not fit is told, with what it belongs to.
class TableReader {
 public:
  explicit TableReader(std::string where) : where_(std::move(where)) {}
  const Status& status() const { return status_; }

  std::string Text(const TableJson& from, const char* key) {
    const TableJson* value = Member(from, key);
    if (value != nullptr && !value->is_string()) Refuse(key, "a text");
    return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
  }
  double Number(const TableJson& from, const char* key, double where_null) {
    const TableJson* value = Member(from, key);
    if (value == nullptr || value->is_null()) return where_null;
    if (!value->is_number()) Refuse(key, "a number");
    return value->is_number() ? value->get<double>() : where_null;
  }
  template <std::size_t Count>
  std::array<double, Count> List(const TableJson& from, const char* key) {
    std::array<double, Count> list{};
    const TableJson* value = Member(from, key);
    if (value == nullptr) return list;
    bool fits = value->is_array() && value->size() == Count;
    for (std::size_t i = 0; fits && i < Count; ++i) {
      fits = (*value)[i].is_number();
      if (fits) list[i] = (*value)[i].get<double>();
    }
    if (!fits) Refuse(key, std::to_string(Count) + " numbers");
    return list;
  }
  Vector3 Vector(const TableJson& from, const char* key) {
    const auto list = List<3>(from, key);
    return {list[0], list[1], list[2]};
  }
  Quaternion Rotation(const TableJson& from, const char* key) {
    const auto list = List<4>(from, key);
    const double squared = list[0] * list[0] + list[1] * list[1] + list[2] * list[2] + list[3] * list[3];
    if (!(std::abs(squared - 1.0) < 1e-6)) Refuse(key, "a quaternion of length 1");
    return {list[0], list[1], list[2], list[3]};
  }
  const TableJson* Member(const TableJson& from, const char* key) {
    const auto found = from.is_object() ? from.find(key) : from.end();
    if (from.is_object() && found != from.end()) return &*found;
    Refuse(key, "something, and is missing");
    return nullptr;
  }

 private:
  void Refuse(const char* key, const std::string& wanted) {
    if (status_.ok()) status_ = {StatusCode::kDataLoss, where_ + ": '" + key + "' must be " + wanted};
  }
  std::string where_;
  Status status_;
};

Result<LinkDescription> ReadLink(const TableJson& row, std::size_t number) {
  TableReader reader("link " + std::to_string(number) + " of the table");
  LinkDescription link{reader.Text(row, "name"), std::nullopt};
  if (row.is_object() && row.contains("mass")) {
    link.inertial = Inertial{reader.Number(row, "mass", -1.0), reader.Vector(row, "centre_of_mass"),
                             reader.List<6>(row, "inertia")};
  }
  if (!reader.status().ok()) return reader.status();
  return link;
}

Result<JointDescription> ReadJoint(const TableJson& row, std::size_t number, Vector3* file_axis, Quaternion* turn) {
  TableReader reader("joint " + std::to_string(number) + " of the table");
  JointDescription joint;
  joint.name = reader.Text(row, "name");
  const std::string type = reader.Text(row, "type");
  joint.parent = reader.Text(row, "parent");
  joint.child = reader.Text(row, "child");
  const TableJson* rest = reader.Member(row, "rest");
  const TableJson* frame = rest != nullptr ? reader.Member(*rest, "robot") : nullptr;
  if (frame != nullptr) joint.origin = {reader.Rotation(*frame, "rotation"), reader.Vector(*frame, "translation")};
  const Vector3 axis = reader.Vector(row, "axis");
  *file_axis = reader.Vector(row, "file_axis");
  *turn = reader.Rotation(row, "axis_turn");
  joint.drive = {reader.Number(row, "lower", -kNoLimit),   reader.Number(row, "upper", kNoLimit),
                 reader.Number(row, "velocity", kNoLimit), reader.Number(row, "effort", kNoLimit),
                 reader.Number(row, "damping", 0.0),       reader.Number(row, "friction", 0.0)};
  if (row.is_object() && row.contains("mimic")) {
    const TableJson& mimic = row["mimic"];
    joint.mimic = Mimic{reader.Text(mimic, "joint"), reader.Number(mimic, "multiplier", 1.0),
                        reader.Number(mimic, "offset", 0.0)};
  }
  joint.source = reader.Text(row, "source");
  if (!reader.status().ok()) return reader.status();
  if (!ParseJointType(type, &joint.type))
    return Status{StatusCode::kDataLoss,
                  "joint " + Quote(joint.name) + " of the table is of no known type: " + Quote(type)};
  if (!(axis == Vector3{1, 0, 0}))
    return Status{StatusCode::kDataLoss, "joint " + Quote(joint.name) + " of the table does not move about its X axis"};
  return joint;
}

Status ReadCapsules(const TableJson& json, Robot* robot) {
  if (!json.contains("capsules")) return {};
  const TableJson& rows = json["capsules"];
  if (!rows.is_array()) return {StatusCode::kDataLoss, "'capsules' of the table is no list"};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    TableReader reader("capsule " + std::to_string(i) + " of the table");
    const std::string link = reader.Text(rows[i], "link");
    const Capsule capsule{robot->FindLink(link), reader.Vector(rows[i], "from"), reader.Vector(rows[i], "to"),
                          reader.Number(rows[i], "radius", -1.0)};
    if (!reader.status().ok()) return reader.status();
    if (capsule.link < 0 || !(capsule.radius >= 0.0))
      return {StatusCode::kDataLoss, "capsule " + std::to_string(i) + " of the table is of link " + Quote(link) +
                                         " and has the radius " + NumberText(capsule.radius)};
    robot->capsules.push_back(capsule);
  }
  return {};
}

Status ReadAllowed(const TableJson& json, Robot* robot) {
  if (!json.contains("allowed_collisions")) return {};
  for (const TableJson& pair : json["allowed_collisions"]) {
    const bool fits = pair.is_array() && pair.size() == 2 && pair[0].is_string() && pair[1].is_string();
    const std::int32_t first = fits ? robot->FindLink(pair[0].get<std::string>()) : -1;
    const std::int32_t second = fits ? robot->FindLink(pair[1].get<std::string>()) : -1;
    if (first < 0 || second < 0)
      return {StatusCode::kDataLoss,
              "'allowed_collisions' of the table holds " + Quote(JsonText(pair)) + ", which is no pair of its links"};
    robot->allowed_collisions.emplace_back(first, second);
  }
  return {};
}

std::string Unused(std::string name, std::set<std::string>* used) {
  std::string candidate = name;
  for (int n = 2; !used->insert(candidate).second; ++n) candidate = name + "_" + std::to_string(n);
  return candidate;
}

}  // namespace

NodeNames NodeNamesOf(const Robot& robot) {
  std::set<std::string> used;
  NodeNames nodes;
  nodes.base = Unused(robot.links[0].name, &used);
  for (const Joint& joint : robot.joints) nodes.joints.push_back(Unused(joint.name, &used));
  for (const Joint& joint : robot.joints) nodes.frames.push_back(Unused(joint.name + "_frame", &used));
  return nodes;
}

std::string WriteTable(const Robot& robot, const TableOrigin& origin) {
  TableJson json;
  json["format"] = kTableFormat;
  json["version"] = kTableVersion;
  json["name"] = robot.name;
  json["units"] = {{"length", "metre"}, {"angle", "radian"}, {"mass", "kilogram"}};
  json["conventions"] = {{"robot", "right-handed, z up, metres"},
                         {"gltf", "right-handed, y up, metres: (x, z, -y); Godot's too"},
                         {"unreal", "left-handed, z up, centimetres: 100 (x, -y, z); a joint's +q is a roll of +q"}};
  json["source"] = {
      {"file", origin.file}, {"format", origin.format}, {"sha256", origin.sha256}, {"licence", origin.licence}};
  json["root"] = robot.links[0].name;
  json["end_effectors"] = TableJson::array();
  for (const std::int32_t link : robot.EndLinks())
    json["end_effectors"].push_back(robot.links[static_cast<std::size_t>(link)].name);
  json["links"] = TableJson::array();
  for (const Link& link : robot.links) json["links"].push_back(LinkRow(link));
  json["joints"] = TableJson::array();
  const NodeNames nodes = NodeNamesOf(robot);
  for (std::size_t j = 0; j < robot.joints.size(); ++j) json["joints"].push_back(JointRow(robot, nodes, j));
  json["capsules"] = TableJson::array();
  for (const Capsule& capsule : robot.capsules) {
    json["capsules"].push_back({{"link", robot.links[static_cast<std::size_t>(capsule.link)].name},
                                {"from", Numbers3(capsule.from)},
                                {"to", Numbers3(capsule.to)},
                                {"radius", capsule.radius}});
  }
  json["allowed_collisions"] = TableJson::array();
  for (const auto& [first, second] : robot.allowed_collisions) {
    json["allowed_collisions"].push_back(TableJson::array(
        {robot.links[static_cast<std::size_t>(first)].name, robot.links[static_cast<std::size_t>(second)].name}));
  }
  return JsonText(json, 1) + "\n";
}

Result<Robot> ReadTable(std::string_view text) {
  const Result<TableJson> read = ReadJson<TableJson>(text);
  if (!read.ok()) return Status(read.status().code(), "the joint table is " + read.status().message());
  const TableJson& json = *read;
  TableReader reader("the joint table");
  if (reader.Text(json, "format") != kTableFormat)
    return Status{StatusCode::kDataLoss,
                  "this is no joint table: its 'format' is not '" + std::string(kTableFormat) + "'"};
  const double version = reader.Number(json, "version", 0.0);
  if (version != kTableVersion)
    return Status{StatusCode::kDataLoss, "the joint table is of format " + NumberText(version) +
                                             ", this program reads " + std::to_string(kTableVersion) +
                                             "; import the robot again"};
  RobotDescription description;
  description.name = reader.Text(json, "name");
  const TableJson* links = reader.Member(json, "links");
  const TableJson* joints = reader.Member(json, "joints");
  if (!reader.status().ok()) return reader.status();
  if (!links->is_array() || !joints->is_array())
    return Status{StatusCode::kDataLoss, "'links' and 'joints' of the joint table must be lists"};
  for (const TableJson& row : *links) {
    Result<LinkDescription> link = ReadLink(row, description.links.size());
    if (!link.ok()) return link.status();
    description.links.push_back(std::move(*link));
  }
  std::vector<Vector3> file_axes(joints->size());
  std::vector<Quaternion> turns(joints->size());
  for (std::size_t j = 0; j < joints->size(); ++j) {
    Result<JointDescription> joint = ReadJoint((*joints)[j], j, &file_axes[j], &turns[j]);
    if (!joint.ok()) return joint.status();
    description.joints.push_back(std::move(*joint));
  }
  Result<Robot> robot = MakeRobot(description);
  if (!robot.ok()) return robot.status();
  // The table is re-based already: what the file said is only kept.
  for (std::size_t j = 0; j < robot->joints.size(); ++j) {
    if (robot->joints[j].name != description.joints[j].name)
      return Status{StatusCode::kDataLoss,
                    "the joints of the table are not in order, a parent's before its children's: " +
                        Quote(description.joints[j].name)};
    robot->joints[j].rest = description.joints[j].origin;  // bit for bit
    robot->joints[j].file_axis = file_axes[j];
    robot->joints[j].axis_turn = turns[j];
  }
  CONSAC_RETURN_IF_ERROR(ReadCapsules(json, &*robot));
  CONSAC_RETURN_IF_ERROR(ReadAllowed(json, &*robot));
  return robot;
}

}  // namespace consac::robot
