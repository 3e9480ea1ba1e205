// MJCF out, for MuJoCo 2.2 and later. Source: mujoco.readthedocs.io, XMLreference.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "consac/robot/kinematics.h"
#include "scene.h"
#include "xml.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;

constexpr double kArmature = 0.01;  // kg m^2: what the rotor of a small geared motor adds

class MjcfWriter {
 public:
  explicit MjcfWriter(const Scene& scene) : scene_(scene), robot_(scene.robot) { FindEmpty(); }

  MjcfText Write() {
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
      if (!Moves(joint)) continue;
      if (joint.mimics >= 0) AddMimic(equality, joint);
      if (joint.mimics < 0) AddActuator(actuator, joint);
    }
    return {XmlText(document_), Massless()};
  }

 private:
  bool Moves(const robot::Joint& joint) const { return ::consac::twin::Moves(robot_, joint); }
  Transform RestOf(const robot::Joint& joint) const { return ::consac::twin::RestOf(robot_, joint); }
  bool HasInertial(std::size_t link) const {
    const auto& inertial = robot_.links[link].inertial;
    return inertial.has_value() && inertial->mass > 0.0;
  }

  // Links without mass and shape between two joints that move: what readers make of several joints in a body. MuJoCo
  // refuses them as bodies; the joint is written into the body below.
  void FindEmpty() {
    std::vector<int> below(robot_.links.size(), 0), moving(robot_.links.size(), 0);
    for (const robot::Joint& joint : robot_.joints) {
      ++below[static_cast<std::size_t>(joint.parent)];
      if (Moves(joint)) ++moving[static_cast<std::size_t>(joint.parent)];
    }
    empty_.assign(robot_.links.size(), false);
    for (std::size_t link = 1; link < robot_.links.size(); ++link)
      empty_[link] = below[link] == 1 && moving[link] == 1 && Moves(robot_.joints[link - 1]) && !HasInertial(link);
    for (const auto* shapes : {&scene_.visuals, &scene_.collisions})
      for (const PlacedShape& shape : *shapes) empty_[static_cast<std::size_t>(shape.link)] = false;
  }

  // Links that move and have no mass, neither their own nor of what is fixed to them. A shape that collides has one, as
  // MuJoCo takes it.
  std::vector<std::string> Massless() const {
    std::vector<bool> heavy(robot_.links.size(), false);
    for (const PlacedShape& shape : scene_.collisions) {
      if (!HasInertial(static_cast<std::size_t>(shape.link))) heavy[static_cast<std::size_t>(shape.link)] = true;
    }
    std::vector<std::string> names;
    for (std::size_t link = robot_.links.size(); link-- > 1;) {
      if (HasInertial(link)) {
        const std::array<double, 6>& inertia = robot_.links[link].inertial->inertia;
        heavy[link] = inertia[0] > 0.0 && inertia[3] > 0.0 && inertia[5] > 0.0;
      }
      const robot::Joint& joint = robot_.joints[link - 1];
      if (!Moves(joint)) {
        const auto parent = static_cast<std::size_t>(joint.parent);
        heavy[parent] = heavy[parent] || heavy[link];
      }
      if (Moves(joint) && !heavy[link] && !empty_[link]) names.push_back(robot_.links[link].name);
    }
    std::reverse(names.begin(), names.end());
    return names;
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
    if (empty_[j + 1]) return;
    std::vector<std::pair<const robot::Joint*, Transform>> joints;  // of this body, with their places in it
    Transform rest;
    std::int32_t above = static_cast<std::int32_t>(j) + 1;
    do {
      const robot::Joint& joint = robot_.joints[static_cast<std::size_t>(above) - 1];
      if (Moves(joint)) joints.emplace_back(&joint, Inverse(rest));
      rest = above == static_cast<std::int32_t>(j) + 1 ? RestOf(joint) : RestOf(joint) * rest;
      above = joint.parent;
    } while (empty_[static_cast<std::size_t>(above)]);
    pugi::xml_node parent = above == 0 ? world : bodies_[static_cast<std::size_t>(above) - 1];
    pugi::xml_node body = bodies_[j] = parent.append_child("body");
    neighbours_.emplace(above, static_cast<std::int32_t>(j) + 1);
    Set(body, "name", robot_.links[j + 1].name);
    Place(body, rest);
    if (HasInertial(j + 1)) {
      const auto& inertial = robot_.links[j + 1].inertial;
      const auto& [xx, xy, xz, yy, yz, zz] = inertial->inertia;
      const double full[] = {xx, yy, zz, xy, xz, yz};
      pugi::xml_node node = body.append_child("inertial");
      Set(node, "pos", NumbersText(inertial->centre));
      Set(node, "mass", inertial->mass);
      Set(node, "fullinertia", NumbersText(full));
    }
    for (auto each = joints.rbegin(); each != joints.rend(); ++each) AddHinge(body, *each->first, each->second);
    AddShapes(body, static_cast<std::int32_t>(j) + 1);
  }

  static void AddRange(pugi::xml_node node, const robot::Joint& joint, const char* limited, const char* range) {
    const double ends[] = {joint.drive.lower, joint.drive.upper};
    const bool both = std::isfinite(ends[0]) && std::isfinite(ends[1]);
    Set(node, limited, both ? "true" : "false");
    if (both) Set(node, range, NumbersText(ends));
  }

  static void AddHinge(pugi::xml_node body, const robot::Joint& joint, const Transform& at) {
    pugi::xml_node node = body.append_child("joint");
    Set(node, "name", joint.name);
    Set(node, "type", joint.type == JointType::kPrismatic ? "slide" : "hinge");
    Set(node, "axis", NumbersText(Rotate(at.rotation, {1, 0, 0})));
    if (!(at.position == robot::Vector3{})) Set(node, "pos", NumbersText(at.position));
    AddRange(node, joint, "limited", "range");
    Set(node, "damping", joint.drive.damping);
    Set(node, "frictionloss", joint.drive.friction);
    Set(node, "armature", kArmature);
  }

  void AddMimic(pugi::xml_node equality, const robot::Joint& joint) {
    pugi::xml_node node = equality.append_child("joint");
    const double polynomial[] = {joint.offset, joint.multiplier, 0, 0, 0};
    Set(node, "joint1", joint.name);
    Set(node, "joint2", robot_.LeaderOf(joint).name);
    Set(node, "polycoef", NumbersText(polynomial));
  }

  static void AddActuator(pugi::xml_node actuator, const robot::Joint& joint) {
    pugi::xml_node node = actuator.append_child("position");
    Set(node, "name", joint.name);
    Set(node, "joint", joint.name);
    Set(node, "kp", kDriveStiffness);
    AddRange(node, joint, "ctrllimited", "ctrlrange");
    const double force[] = {-joint.drive.effort, joint.drive.effort};
    const bool forced = std::isfinite(joint.drive.effort) && joint.drive.effort > 0.0;
    Set(node, "forcelimited", forced ? "true" : "false");
    if (forced) Set(node, "forcerange", NumbersText(force));
  }

  void AddContacts(pugi::xml_node contact) {
    std::set<std::pair<std::int32_t, std::int32_t>> pairs = neighbours_;
    pairs.insert(robot_.allowed_collisions.begin(), robot_.allowed_collisions.end());
    for (const auto& [first, second] : pairs) {
      if (empty_[static_cast<std::size_t>(first)] || empty_[static_cast<std::size_t>(second)]) continue;
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
  std::vector<bool> empty_;                                     // [L] has no body
  std::vector<pugi::xml_node> bodies_;                          // [J] of link j + 1
  std::set<std::pair<std::int32_t, std::int32_t>> neighbours_;  // links whose bodies hang on each other
  std::map<std::pair<std::string, std::string>, std::string> meshes_;
};

}  // namespace

MjcfText WriteMjcf(const Scene& scene) {
  return MjcfWriter(scene).Write();
}

}  // namespace consac::twin
