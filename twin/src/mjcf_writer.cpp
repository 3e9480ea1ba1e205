// MJCF out, for MuJoCo 2.2 and later. Source: mujoco.readthedocs.io, XMLreference.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "scene.h"
#include "xml.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;

constexpr double kStiffness = 100.0;  // of the position actuators, N m/rad: a start, to be tuned for the robot
constexpr double kArmature = 0.01;    // kg m^2: what the rotor of a small geared motor adds

class MjcfWriter {
 public:
  explicit MjcfWriter(const Scene& scene) : scene_(scene), robot_(scene.robot) {}

  std::string Write() {
    pugi::xml_node root = document_.append_child("mujoco");
    Set(root, "model", robot_.name);
    pugi::xml_node compiler = root.append_child("compiler");
    Set(compiler, "angle", "radian");
    Set(compiler, "autolimits", "false");
    Set(compiler, "balanceinertia", "true");
    asset_ = root.append_child("asset");
    pugi::xml_node world = root.append_child("worldbody");
    AddShapes(world, 0);
    bodies_.resize(robot_.joints.size());
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) AddBody(world, j);
    AddContacts(root.append_child("contact"));
    pugi::xml_node equality = root.append_child("equality"), actuator = root.append_child("actuator");
    for (const robot::Joint& joint : robot_.joints) {
      if (joint.mimics >= 0) AddMimic(equality, joint);
      if (joint.mimics < 0 && joint.type != JointType::kFixed) AddActuator(actuator, joint);
    }
    return XmlText(document_);
  }

 private:
  static void Set(pugi::xml_node node, const char* name, const std::string& text) {
    node.append_attribute(name).set_value(text.c_str());
  }
  static void Set(pugi::xml_node node, const char* name, double number) {
    Set(node, name, NumbersText(std::span<const double>(&number, 1)));
  }
  static void Place(pugi::xml_node node, const Transform& at) {
    const double wxyz[] = {at.rotation.w, at.rotation.x, at.rotation.y, at.rotation.z};
    Set(node, "pos", NumbersText(at.position));
    Set(node, "quat", NumbersText(wxyz));
  }

  // One mesh of MuJoCo for a file at a scale; names are ours, so that no two files meet in one.
  std::string MeshName(const PlacedShape& placed) {
    const auto key = std::pair(placed.file, NumbersText(placed.shape.size));
    const auto known = meshes_.find(key);
    if (known != meshes_.end()) return known->second;
    const std::string name = "mesh_" + std::to_string(meshes_.size());
    pugi::xml_node mesh = asset_.append_child("mesh");
    Set(mesh, "name", name);
    Set(mesh, "file", placed.file);
    Set(mesh, "scale", key.second);
    return meshes_[key] = name;
  }

  void AddGeom(pugi::xml_node body, const PlacedShape& placed, bool collides) {
    const Shape& shape = placed.shape;
    pugi::xml_node geom = body.append_child("geom");
    const robot::Vector3& s = shape.size;
    Place(geom, placed.origin);
    switch (shape.kind) {
      case ShapeKind::kMesh:
        Set(geom, "type", "mesh");
        Set(geom, "mesh", MeshName(placed));
        break;
      case ShapeKind::kBox:
        Set(geom, "type", "box");
        Set(geom, "size", NumbersText(0.5 * s));
        break;
      case ShapeKind::kSphere:
        Set(geom, "type", "sphere");
        Set(geom, "size", s.x);
        break;
      case ShapeKind::kCylinder:
      case ShapeKind::kCapsule: {
        const double size[] = {s.x, 0.5 * s.z};
        Set(geom, "type", shape.kind == ShapeKind::kCylinder ? "cylinder" : "capsule");
        Set(geom, "size", NumbersText(size));
        break;
      }
    }
    Set(geom, "group", collides ? "3" : "2");
    if (!collides) Set(geom, "contype", "0"), Set(geom, "conaffinity", "0"), Set(geom, "mass", "0");
    Set(geom, "rgba", NumbersText(shape.colour));
  }

  void AddShapes(pugi::xml_node body, std::int32_t link) {
    for (const PlacedShape& visual : scene_.visuals) {
      if (visual.link == link) AddGeom(body, visual, false);
    }
    for (const PlacedShape& collision : scene_.collisions) {
      if (collision.link == link) AddGeom(body, collision, true);
    }
  }

  void AddBody(pugi::xml_node world, std::size_t j) {
    const robot::Joint& joint = robot_.joints[j];
    pugi::xml_node parent = joint.parent == 0 ? world : bodies_[static_cast<std::size_t>(joint.parent) - 1];
    pugi::xml_node body = bodies_[j] = parent.append_child("body");
    Set(body, "name", robot_.links[j + 1].name);
    Place(body, joint.rest);
    if (const auto& inertial = robot_.links[j + 1].inertial; inertial.has_value() && inertial->mass > 0.0) {
      const auto& [xx, xy, xz, yy, yz, zz] = inertial->inertia;
      const double full[] = {xx, yy, zz, xy, xz, yz};
      pugi::xml_node node = body.append_child("inertial");
      Set(node, "pos", NumbersText(inertial->centre));
      Set(node, "mass", inertial->mass);
      Set(node, "fullinertia", NumbersText(full));
    }
    if (joint.type != JointType::kFixed) AddHinge(body, joint);
    AddShapes(body, static_cast<std::int32_t>(j) + 1);
  }

  static void AddHinge(pugi::xml_node body, const robot::Joint& joint) {
    pugi::xml_node node = body.append_child("joint");
    Set(node, "name", joint.name);
    Set(node, "type", joint.type == JointType::kPrismatic ? "slide" : "hinge");
    Set(node, "axis", "1 0 0");
    const double range[] = {joint.drive.lower, joint.drive.upper};
    const bool limited = std::isfinite(range[0]) && std::isfinite(range[1]) && range[0] < range[1];
    Set(node, "limited", limited ? "true" : "false");
    if (limited) Set(node, "range", NumbersText(range));
    Set(node, "damping", joint.drive.damping);
    Set(node, "frictionloss", joint.drive.friction);
    Set(node, "armature", kArmature);
  }

  void AddMimic(pugi::xml_node equality, const robot::Joint& joint) {
    pugi::xml_node node = equality.append_child("joint");
    const std::int32_t leader = robot_.position_joints[static_cast<std::size_t>(joint.position_index)];
    const double polynomial[] = {joint.offset, joint.multiplier, 0, 0, 0};
    Set(node, "joint1", joint.name);
    Set(node, "joint2", robot_.joints[static_cast<std::size_t>(leader)].name);
    Set(node, "polycoef", NumbersText(polynomial));
  }

  static void AddActuator(pugi::xml_node actuator, const robot::Joint& joint) {
    pugi::xml_node node = actuator.append_child("position");
    Set(node, "name", joint.name);
    Set(node, "joint", joint.name);
    Set(node, "kp", kStiffness);
    const double range[] = {joint.drive.lower, joint.drive.upper};
    const bool limited = std::isfinite(range[0]) && std::isfinite(range[1]) && range[0] < range[1];
    Set(node, "ctrllimited", limited ? "true" : "false");
    if (limited) Set(node, "ctrlrange", NumbersText(range));
    const double force[] = {-joint.drive.effort, joint.drive.effort};
    const bool forced = std::isfinite(joint.drive.effort) && joint.drive.effort > 0.0;
    Set(node, "forcelimited", forced ? "true" : "false");
    if (forced) Set(node, "forcerange", NumbersText(force));
  }

  void AddContacts(pugi::xml_node contact) {
    std::set<std::pair<std::int32_t, std::int32_t>> pairs(robot_.allowed_collisions.begin(),
                                                          robot_.allowed_collisions.end());
    for (std::size_t j = 0; j < robot_.joints.size(); ++j)
      pairs.emplace(robot_.joints[j].parent, static_cast<std::int32_t>(j) + 1);
    for (const auto& [first, second] : pairs) {
      const auto name = [&](std::int32_t link) {
        return link == 0 ? std::string("world") : robot_.links[static_cast<std::size_t>(link)].name;
      };
      pugi::xml_node node = contact.append_child("exclude");
      Set(node, "body1", name(first));
      Set(node, "body2", name(second));
    }
  }

  const Scene& scene_;
  const robot::Robot& robot_;
  pugi::xml_document document_;
  pugi::xml_node asset_;
  std::vector<pugi::xml_node> bodies_;  // [J] of link j + 1
  std::map<std::pair<std::string, std::string>, std::string> meshes_;
};

}  // namespace

std::string WriteMjcf(const Scene& scene) {
  return MjcfWriter(scene).Write();
}

}  // namespace consac::twin
