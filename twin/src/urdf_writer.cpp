#include <algorithm>
#include <cmath>

#include "consac/twin/urdf.h"
#include "xml.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;

// URDF has no word for no limit, and readers take a missing one for 0 or for an error (urdfdom).
constexpr double kLargest = 1e6;  // rad, m, rad/s, m/s, N m, N

double Finite(double value, double otherwise) {
  return std::isfinite(value) ? value : otherwise;
}

void AddLimit(pugi::xml_node joint, JointType type, const robot::JointDrive& drive) {
  if (type == JointType::kContinuous && !std::isfinite(drive.effort) && !std::isfinite(drive.velocity)) return;
  pugi::xml_node limit = joint.append_child("limit");
  if (type != JointType::kContinuous) {
    Set(limit, "lower", Finite(drive.lower, std::min(-kLargest, Finite(drive.upper, 0.0))));
    Set(limit, "upper", Finite(drive.upper, std::max(kLargest, Finite(drive.lower, 0.0))));
  }
  Set(limit, "effort", Finite(drive.effort, kLargest));
  Set(limit, "velocity", Finite(drive.velocity, kLargest));
}

void AddOrigin(pugi::xml_node parent, const Transform& at) {
  pugi::xml_node origin = parent.append_child("origin");
  Set(origin, "xyz", NumbersText(at.position));
  Set(origin, "rpy", NumbersText(robot::RollPitchYaw(at.rotation)));
}

void AddShape(pugi::xml_node link, const char* what, const PlacedShape& placed) {
  const Shape& shape = placed.shape;
  pugi::xml_node node = link.append_child(what);
  if (!shape.name.empty()) Set(node, "name", shape.name);
  AddOrigin(node, placed.origin);
  pugi::xml_node geometry = node.append_child("geometry");
  pugi::xml_node form;
  switch (shape.kind) {
    case ShapeKind::kMesh:
      form = geometry.append_child("mesh");
      Set(form, "filename", placed.file);
      if (!(shape.size == robot::Vector3{1, 1, 1})) Set(form, "scale", NumbersText(shape.size));
      break;
    case ShapeKind::kBox:
      Set(geometry.append_child("box"), "size", NumbersText(shape.size));
      break;
    case ShapeKind::kSphere:
      Set(geometry.append_child("sphere"), "radius", shape.size.x);
      break;
    case ShapeKind::kCylinder:
    case ShapeKind::kCapsule:
      form = geometry.append_child(shape.kind == ShapeKind::kCylinder ? "cylinder" : "capsule");
      Set(form, "radius", shape.size.x);
      Set(form, "length", shape.size.z);
      break;
  }
  if (!shape.has_colour) return;
  pugi::xml_node material = node.append_child("material");
  Set(material, "name", shape.material);
  Set(material.append_child("color"), "rgba", NumbersText(shape.colour));
}

void AddInertial(pugi::xml_node link, const robot::Inertial& body) {
  pugi::xml_node node = link.append_child("inertial");
  AddOrigin(node, {{}, body.centre});
  Set(node.append_child("mass"), "value", body.mass);
  pugi::xml_node inertia = node.append_child("inertia");
  constexpr const char* kElements[] = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
  for (std::size_t i = 0; i < 6; ++i) Set(inertia, kElements[i], body.inertia[i]);
}

void AddJoint(pugi::xml_node root, const robot::Robot& robot, std::size_t j) {
  const robot::Joint& joint = robot.joints[j];
  pugi::xml_node node = root.append_child("joint");
  Set(node, "name", joint.name);
  Set(node, "type", std::string(NameOf(joint.type)));
  Set(node.append_child("parent"), "link", robot.links[static_cast<std::size_t>(joint.parent)].name);
  Set(node.append_child("child"), "link", robot.links[j + 1].name);
  AddOrigin(node, joint.rest);
  if (joint.type == JointType::kFixed) return;
  Set(node.append_child("axis"), "xyz", "1 0 0");
  const robot::JointDrive& drive = joint.drive;
  AddLimit(node, joint.type, drive);
  if (drive.damping > 0.0 || drive.friction > 0.0) {
    pugi::xml_node dynamics = node.append_child("dynamics");
    Set(dynamics, "damping", drive.damping);
    Set(dynamics, "friction", drive.friction);
  }
  if (joint.mimics < 0) return;
  pugi::xml_node mimic = node.append_child("mimic");
  Set(mimic, "joint", robot.LeaderOf(joint).name);
  Set(mimic, "multiplier", joint.multiplier);
  Set(mimic, "offset", joint.offset);
}

}  // namespace

std::string WriteUrdf(const robot::Robot& robot, const std::vector<PlacedShape>& visuals,
                      const std::vector<PlacedShape>& collisions) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("robot");
  Set(root, "name", robot.name);
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    pugi::xml_node link = root.append_child("link");
    Set(link, "name", robot.links[i].name);
    if (robot.links[i].inertial.has_value()) AddInertial(link, *robot.links[i].inertial);
    for (const PlacedShape& shape : visuals) {
      if (shape.link == static_cast<std::int32_t>(i)) AddShape(link, "visual", shape);
    }
    for (const PlacedShape& shape : collisions) {
      if (shape.link == static_cast<std::int32_t>(i)) AddShape(link, "collision", shape);
    }
  }
  for (std::size_t j = 0; j < robot.joints.size(); ++j) AddJoint(root, robot, j);
  return XmlText(document);
}

}  // namespace consac::twin
