#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "consac/base/text.h"
#include "consac/twin/urdf.h"
#include "xml.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;
using robot::Vector3;

// Reads one file; what is wrong goes to the XmlReader, what is odd to the model's warnings.
class UrdfReader {
 public:
  explicit UrdfReader(XmlReader& xml) : xml_(xml) {}

  Result<Model> Read() {
    if (!xml_.status().ok()) return xml_.status();
    RefuseXacro(xml_.root());
    const pugi::xml_node root = xml_.root();
    if (std::strcmp(root.name(), "mujocoinclude") == 0)
      return xml_.Wrong(root, "<mujocoinclude> is a piece of an MJCF; import the file that includes it");
    if (std::strcmp(root.name(), "robot") != 0)
      return xml_.Wrong(root, "a URDF begins with <robot>, this with <" + std::string(root.name()) + ">");
    model_.format = "urdf";
    model_.robot.name = root.attribute("name").value();
    if (model_.robot.name.empty()) model_.robot.name = "robot";
    for (const pugi::xml_node node : root.children("material")) ReadMaterial(node);
    for (const pugi::xml_node node : root.children("link")) ReadLink(node);
    // <transmission> and <gazebo> nest elements of the same name that are no joints: only direct children count.
    for (const pugi::xml_node node : root.children("joint")) ReadJoint(node);
    for (const pugi::xml_node node : root.children("joint")) CheckLinks(node);
    if (!xml_.status().ok()) return xml_.status();
    return std::move(model_);
  }

 private:
  void Warn(const std::string& line) { model_.warnings.push_back(line); }

  void RefuseXacro(pugi::xml_node node) {
    for (const pugi::xml_node child : node.children()) {
      if (std::strncmp(child.name(), "xacro:", 6) == 0)
        return xml_.Refuse(
            child, "<" + std::string(child.name()) + "> is xacro; make a URDF of it first: xacro FILE > robot.urdf");
      RefuseXacro(child);
    }
  }

  Transform Origin(pugi::xml_node parent) {
    const pugi::xml_node origin = parent.child("origin");
    const Vector3 rpy = xml_.Vector(origin, "rpy", {});
    double quaternion[4];  // x y z w, as newer URDF may say it
    Transform transform{robot::FromRollPitchYaw(rpy), xml_.Vector(origin, "xyz", {})};
    if (xml_.Numbers(origin, "quat_xyzw", quaternion))
      transform.rotation = robot::Normalised({quaternion[0], quaternion[1], quaternion[2], quaternion[3]});
    return transform;
  }

  bool ReadColour(pugi::xml_node material, Colour* colour) {
    const pugi::xml_node node = material.child("color");
    if (!xml_.Numbers(node, "rgba", *colour)) return false;
    for (double& value : *colour) value = std::clamp(value, 0.0, 1.0);
    return true;
  }

  void ReadMaterial(pugi::xml_node node) {
    Colour colour = kDefaultColour;
    if (ReadColour(node, &colour)) materials_[node.attribute("name").value()] = colour;
  }

  void ReadGeometry(pugi::xml_node node, Shape* shape) {
    const pugi::xml_node geometry = node.child("geometry");
    const auto positive = [&](pugi::xml_node of, const char* name) {
      const double value = xml_.Number(of, name, 0.0);
      if (!(value > 0.0) || value > 1e6) xml_.Refuse(of, "<" + std::string(of.name()) + "> has no usable " + name);
      return value;
    };
    if (const pugi::xml_node mesh = geometry.child("mesh")) {
      shape->kind = ShapeKind::kMesh;
      shape->mesh = xml_.Text(mesh, "filename");
      shape->size = xml_.Vector(mesh, "scale", {1, 1, 1});
      xml_.CheckScale(mesh, shape->size);
    } else if (const pugi::xml_node box = geometry.child("box")) {
      shape->kind = ShapeKind::kBox;
      const Vector3 s = shape->size = xml_.Vector(box, "size", {});
      if (!(s.x > 0.0 && s.y > 0.0 && s.z > 0.0) || s.x + s.y + s.z > 1e6)
        xml_.Refuse(box, "<box size=" + Quote(NumbersText(s)) + ">: three lengths are needed");
    } else if (const pugi::xml_node sphere = geometry.child("sphere")) {
      shape->kind = ShapeKind::kSphere;
      const double radius = positive(sphere, "radius");
      shape->size = {radius, radius, radius};
    } else if (const pugi::xml_node round =
                   geometry.child("cylinder") ? geometry.child("cylinder") : geometry.child("capsule")) {
      shape->kind = std::strcmp(round.name(), "capsule") == 0 ? ShapeKind::kCapsule : ShapeKind::kCylinder;
      const double radius = positive(round, "radius");
      shape->size = {radius, radius, positive(round, "length")};
    } else {
      xml_.Refuse(node, "<" + std::string(node.name()) + "> of link " + Quote(shape->link) +
                            " has no geometry that is read: mesh, box, cylinder, sphere or capsule");
    }
  }

  void ReadShape(pugi::xml_node node, const std::string& link, std::vector<Shape>* shapes) {
    Shape shape;
    shape.link = link;
    shape.name = node.attribute("name").value();
    shape.origin = Origin(node);
    ReadGeometry(node, &shape);
    const pugi::xml_node material = node.child("material");
    shape.material = material.attribute("name").value();
    shape.has_colour = ReadColour(material, &shape.colour);
    const auto known = materials_.find(shape.material);
    if (!shape.has_colour && known != materials_.end()) {
      shape.colour = known->second;
      shape.has_colour = true;
    } else if (shape.has_colour && !shape.material.empty()) {
      materials_.emplace(shape.material, shape.colour);  // named in one link, used in others
    }
    shapes->push_back(std::move(shape));
    if (shapes->size() > kMostShapes)
      xml_.Refuse(node, "there are more than " + std::to_string(kMostShapes) + " <" + std::string(node.name()) + ">");
  }

  void ReadInertial(pugi::xml_node node, robot::LinkDescription* link) {
    const Transform origin = Origin(node);
    robot::Inertial body;
    body.mass = xml_.Number(node.child("mass"), "value", 0.0);
    body.centre = origin.position;
    const pugi::xml_node inertia = node.child("inertia");
    constexpr const char* kElements[] = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
    std::array<double, 6> elements{};
    for (std::size_t i = 0; i < 6; ++i) elements[i] = xml_.Number(inertia, kElements[i], 0.0);
    body.inertia = robot::TurnedInertia(elements, robot::Inverse(origin.rotation));
    link->inertial = body;
  }

  void ReadLink(pugi::xml_node node) {
    robot::LinkDescription link{xml_.Text(node, "name"), std::nullopt};
    if (const pugi::xml_node inertial = node.child("inertial")) ReadInertial(inertial, &link);
    for (const pugi::xml_node visual : node.children("visual")) ReadShape(visual, link.name, &model_.visuals);
    for (const pugi::xml_node collision : node.children("collision"))
      ReadShape(collision, link.name, &model_.collisions);
    model_.robot.links.push_back(std::move(link));
  }

  void ReadDrive(pugi::xml_node node, robot::JointDescription* joint) {
    const pugi::xml_node limit = node.child("limit"), dynamics = node.child("dynamics");
    robot::JointDrive& drive = joint->drive;
    if (joint->type == JointType::kRevolute || joint->type == JointType::kPrismatic) {
      if (limit) {
        drive.lower = xml_.Number(limit, "lower", 0.0);
        drive.upper = xml_.Number(limit, "upper", 0.0);
        if (drive.lower > drive.upper)
          xml_.Refuse(limit, "joint " + Quote(joint->name) + ": its lower limit " + NumberText(drive.lower) +
                                 " is above its upper limit " + NumberText(drive.upper));
        if (drive.lower == drive.upper)
          Warn("joint " + Quote(joint->name) + ": its limits are both " + NumberText(drive.lower) +
               ", so it cannot move");
      } else {
        Warn("joint " + Quote(joint->name) + ": it has no <limit>, so it has no limits here");
      }
    }
    drive.velocity = xml_.Number(limit, "velocity", robot::kNoLimit);
    drive.effort = xml_.Number(limit, "effort", robot::kNoLimit);
    drive.damping = xml_.Number(dynamics, "damping", 0.0);
    drive.friction = xml_.Number(dynamics, "friction", 0.0);
  }

  void ReadJoint(pugi::xml_node node) {
    robot::JointDescription joint;
    joint.name = xml_.Text(node, "name");
    const std::string type = node.attribute("type").value(), which = "joint " + Quote(joint.name) + ": ";
    if (type == "floating" || type == "planar") {
      Warn(which + "its type is " + Quote(type) + ", which is not taken; it is fixed here");
    } else if (!robot::ParseJointType(type, &joint.type)) {
      xml_.Refuse(node, which + "its type is " + Quote(type) +
                            "; known are revolute, continuous, prismatic, fixed, floating and planar");
    }
    joint.parent = node.child("parent").attribute("link").value();
    joint.child = node.child("child").attribute("link").value();
    if (joint.parent.empty() || joint.child.empty())
      xml_.Refuse(node, which + "it needs <parent link=...> and <child link=...>");
    joint.origin = Origin(node);
    joint.axis = xml_.Vector(node.child("axis"), "xyz", {1, 0, 0});
    if (joint.type != JointType::kFixed && !node.child("axis"))
      Warn(which + "it has no <axis>; URDF then takes (1, 0, 0)");
    if (joint.type != JointType::kFixed && joint.axis == Vector3{})
      xml_.Refuse(node.child("axis"), which +
                                          "its axis is (0, 0, 0), which is no direction; say about or along which "
                                          "axis it moves");
    ReadDrive(node, &joint);
    if (const pugi::xml_node mimic = node.child("mimic")) {
      joint.mimic = robot::Mimic{xml_.Text(mimic, "joint"), xml_.Number(mimic, "multiplier", 1.0),
                                 xml_.Number(mimic, "offset", 0.0)};
    }
    joint.source = "urdf";
    model_.robot.joints.push_back(std::move(joint));
  }

  // What MakeRobot would refuse without a line.
  void CheckLinks(pugi::xml_node joint) {
    for (const char* end : {"parent", "child"}) {
      const std::string link = joint.child(end).attribute("link").value();
      const auto is_it = [&](const robot::LinkDescription& each) { return each.name == link; };
      if (std::any_of(model_.robot.links.begin(), model_.robot.links.end(), is_it)) continue;
      std::vector<std::string_view> known;
      for (const robot::LinkDescription& each : model_.robot.links) known.emplace_back(each.name);
      return xml_.Refuse(joint.child(end), "joint " + Quote(joint.attribute("name").value()) + " names the link " +
                                               Quote(link) + ", which is not there" + Suggestion(link, known));
    }
  }

  XmlReader& xml_;
  Model model_;
  std::map<std::string, Colour> materials_;
};

}  // namespace

Result<Model> ReadUrdf(std::string_view text) {
  XmlReader xml(text);
  return ReadUrdf(xml);
}

Result<Model> ReadUrdf(XmlReader& xml) {
  return UrdfReader(xml).Read();
}

Status ReadSrdf(std::string_view text, Model* model) {
  XmlReader xml(text);
  if (!xml.status().ok()) return xml.status();
  for (const pugi::xml_node node : xml.root().children("disable_collisions"))
    model->allowed_collisions.emplace_back(xml.Text(node, "link1"), xml.Text(node, "link2"));
  return xml.status();
}

}  // namespace consac::twin
