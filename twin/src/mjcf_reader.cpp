#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "consac/base/text.h"
#include "consac/twin/mjcf.h"
#include "mjcf_values.h"
#include "xml.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;
using robot::Vector3;

const std::string kWorld = "world";
constexpr int kLastShownGroup = 2;  // of geoms; MuJoCo hides the others

struct MjcfMesh {
  std::string file;
  Vector3 scale{1, 1, 1};
};

class MjcfReader {
 public:
  explicit MjcfReader(XmlReader& xml) : xml_(xml), values_(xml) {}

  Result<Model> Read() {
    if (!xml_.status().ok()) return xml_.status();
    const pugi::xml_node root = xml_.root();
    if (std::strcmp(root.name(), "mujoco") != 0)
      return xml_.Wrong(root, "an MJCF begins with <mujoco>, this with <" + std::string(root.name()) + ">");
    RefuseParts(root);
    model_.format = "mjcf";
    model_.robot.name = root.attribute("model").value();
    if (model_.robot.name.empty()) model_.robot.name = "robot";
    for (const pugi::xml_node node : root.children("compiler")) ReadCompiler(node);
    values_.ReadClasses(root);
    if (!xml_.status().ok()) return xml_.status();
    for (const pugi::xml_node node : root.children("asset")) ReadAssets(node);
    model_.robot.links.push_back({kWorld, std::nullopt});
    for (const pugi::xml_node node : root.children("worldbody")) ReadContent(node, kWorld, {}, "main");
    for (const pugi::xml_node node : root.children("equality")) ReadEqualities(node);
    for (const pugi::xml_node node : root.children("contact")) {
      for (const pugi::xml_node pair : node.children("exclude"))
        model_.allowed_collisions.emplace_back(xml_.Text(pair, "body1"), xml_.Text(pair, "body2"));
    }
    if (!xml_.status().ok()) return xml_.status();
    return std::move(model_);
  }

 private:
  void Warn(std::string line) { model_.warnings.push_back(std::move(line)); }

  void RefuseParts(pugi::xml_node node) {
    for (const pugi::xml_node child : node.children()) {
      const std::string_view name = child.name();
      if (name == "include" || name == "replicate" || name == "attach")
        return xml_.Refuse(child, "<" + std::string(name) +
                                      "> is not read; let MuJoCo save the model as one file first (mj_saveLastXML)");
      RefuseParts(child);
    }
  }

  void ReadCompiler(pugi::xml_node node) {
    values_.ReadCompiler(node);
    if (node.attribute("coordinate").value() == std::string_view("global"))
      xml_.Refuse(node, "global coordinates are not read");
    for (const char* name : {"assetdir", "meshdir"}) {
      if (node.attribute(name)) mesh_folder_ = node.attribute(name).value();
    }
  }

  void ReadAssets(pugi::xml_node asset) {
    for (const pugi::xml_node node : asset.children("mesh")) {
      MjcfMesh mesh;
      mesh.file = xml_.Text(node, "file");
      mesh.scale = values_.Vector(node, "scale", "main", {1, 1, 1});
      std::string name = node.attribute("name").value();
      if (name.empty()) {
        const std::size_t slash = mesh.file.find_last_of('/') + 1;  // 0 where there is none
        name = mesh.file.substr(slash, mesh.file.find_last_of('.') - slash);
      }
      if (!mesh_folder_.empty() && mesh.file.find("://") == std::string::npos)
        mesh.file = mesh_folder_ + "/" + mesh.file;
      meshes_[name] = std::move(mesh);
    }
    for (const pugi::xml_node node : asset.children("material")) {
      const auto rgba = values_.List(node, "rgba", "main", 4);
      if (rgba.size() == 4) std::copy(rgba.begin(), rgba.end(), materials_[node.attribute("name").value()].begin());
    }
  }

  // Geoms and bodies in a body, the world or a frame that stands at `at` in the link.
  void ReadContent(pugi::xml_node node, const std::string& link, const Transform& at, const std::string& enclosing) {
    for (const pugi::xml_node child : node.children()) {
      if (!xml_.status().ok()) return;
      const std::string_view name = child.name();
      const std::string inside = child.attribute("childclass") ? child.attribute("childclass").value() : enclosing;
      if (name == "geom") ReadGeom(child, link, at, enclosing);
      if (name == "frame") ReadContent(child, link, at * values_.Place(child, inside), inside);
      if (name == "body") ReadBody(child, link, at, inside);
    }
  }

  std::string Unnamed(pugi::xml_node node, const std::string& otherwise) {
    const std::string name = node.attribute("name").value();
    return name.empty() ? otherwise + "_" + std::to_string(++unnamed_) : name;
  }

  void AddLink(pugi::xml_node node, const std::string& name) {
    model_.robot.links.push_back({name, std::nullopt});
    if (model_.robot.links.size() > robot::kMostLinks)
      xml_.Refuse(node, "there are more than " + std::to_string(robot::kMostLinks) + " bodies and joints");
  }

  // A joint as a body or a frame in it holds it: how the frame stands in the body, and what class is meant.
  struct PlacedJoint {
    pugi::xml_node node;
    Transform at;
    std::string enclosing;
  };

  void GatherJoints(pugi::xml_node node, const std::string& body, const Transform& at, const std::string& enclosing,
                    std::vector<PlacedJoint>* joints) {
    for (const pugi::xml_node child : node.children()) {
      const std::string_view kind = child.name();
      if (kind == "frame") {
        const std::string inside = child.attribute("childclass") ? child.attribute("childclass").value() : enclosing;
        GatherJoints(child, body, at * values_.Place(child, inside), inside, joints);
      }
      if (kind != "joint" && kind != "freejoint") continue;
      const std::string_view type = values_.Say(child, "type", enclosing);
      if (type == "ball")
        return xml_.Refuse(child, "body " + Quote(body) + " has a ball joint, which is not read; use three hinges");
      if (kind == "freejoint" || type == "free")
        Warn("body " + Quote(body) + " is free; it is fixed here");
      else
        joints->push_back({child, at, enclosing});
    }
  }

  void ReadBody(pugi::xml_node node, const std::string& parent, const Transform& at, const std::string& enclosing) {
    const std::string name = Unnamed(node, "body");
    std::vector<PlacedJoint> joints;
    GatherJoints(node, name, {}, enclosing, &joints);
    Transform origin = at * values_.Place(node, enclosing);
    std::string above = parent;
    Vector3 pivot;  // where the link's frame is, in the body's
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const Vector3 position = joints[i].at * values_.Vector(joints[i].node, "pos", joints[i].enclosing, {});
      const bool last = i + 1 == joints.size();
      const std::string link = last ? name : name + "_before_" + std::to_string(joints.size() - 1 - i);
      model_.robot.joints.push_back(ReadJoint(joints[i], above, link, origin * Transform{{}, position - pivot}));
      AddLink(node, link);
      origin = {};
      above = link;
      pivot = position;
    }
    if (joints.empty()) {
      robot::JointDescription fixed;
      fixed.name = name + "_fixed", fixed.parent = parent, fixed.child = name, fixed.origin = origin,
      fixed.source = "mjcf";
      model_.robot.joints.push_back(std::move(fixed));
      AddLink(node, name);
    }
    const Transform body{{}, -1.0 * pivot};  // the body's frame in the link's
    if (const pugi::xml_node inertial = node.child("inertial")) ReadInertial(inertial, body, enclosing);
    ReadContent(node, name, body, enclosing);
  }

  robot::JointDescription ReadJoint(const PlacedJoint& placed, const std::string& parent, const std::string& child,
                                    const Transform& origin) {
    const auto& [node, at, enclosing] = placed;
    robot::JointDescription joint;
    joint.name = Unnamed(node, "joint");
    joint.parent = parent, joint.child = child, joint.origin = origin, joint.source = "mjcf";
    joint.axis = Rotate(at.rotation, values_.Vector(node, "axis", enclosing, {0, 0, 1}));
    const bool slides = values_.Say(node, "type", enclosing) == "slide";
    const auto range = values_.List(node, "range", enclosing, 2);
    const bool limited = values_.Say(node, "limited", enclosing) != "false" && !range.empty();
    joint.type = slides ? JointType::kPrismatic : limited ? JointType::kRevolute : JointType::kContinuous;
    if (limited)
      joint.drive.lower = slides ? range[0] : values_.Angle(range[0]),
      joint.drive.upper = slides ? range[1] : values_.Angle(range[1]);
    const auto force = values_.List(node, "actuatorfrcrange", enclosing, 2);
    if (!force.empty()) joint.drive.effort = std::max(std::abs(force[0]), std::abs(force[1]));
    joint.drive.damping = values_.Number(node, "damping", enclosing, 0.0);
    joint.drive.friction = values_.Number(node, "frictionloss", enclosing, 0.0);
    if (values_.Number(node, "ref", enclosing, 0.0) != 0.0)
      Warn("joint " + Quote(joint.name) + ": its ref is not read; here its position is 0 where the file draws it");
    return joint;
  }

  void ReadInertial(pugi::xml_node node, const Transform& body, const std::string& enclosing) {
    robot::Inertial inertial;
    inertial.mass = values_.Number(node, "mass", enclosing, 0.0);
    const Transform place = body * values_.Place(node, enclosing);
    inertial.centre = place.position;
    std::array<double, 6> inertia{};
    if (const auto diagonal = values_.List(node, "diaginertia", enclosing, 3); !diagonal.empty())
      inertia = {diagonal[0], 0, 0, diagonal[1], 0, diagonal[2]};
    if (const auto full = values_.List(node, "fullinertia", enclosing, 6); !full.empty())
      inertia = {full[0], full[3], full[4], full[1], full[5], full[2]};
    inertial.inertia = robot::TurnedInertia(inertia, Inverse(place.rotation));
    model_.robot.links.back().inertial = inertial;
  }

  void ReadGeom(pugi::xml_node node, const std::string& link, const Transform& at, const std::string& enclosing) {
    Shape shape;
    shape.link = link;
    shape.name = node.attribute("name").value();
    if (!ReadForm(node, at, enclosing, &shape)) return;
    const auto rgba = values_.List(node, "rgba", enclosing, 4);
    shape.material = std::string(values_.Say(node, "material", enclosing));
    const auto material = materials_.find(shape.material);
    if (!rgba.empty()) std::copy(rgba.begin(), rgba.end(), shape.colour.begin());
    if (rgba.empty() && material != materials_.end()) shape.colour = material->second;
    shape.has_colour = !rgba.empty() || material != materials_.end();
    for (double& value : shape.colour) value = std::clamp(value, 0.0, 1.0);
    const bool shown = values_.Number(node, "group", enclosing, 0.0) <= kLastShownGroup && shape.colour[3] > 0.0;
    const bool touches = values_.Number(node, "contype", enclosing, 1.0) != 0.0 ||
                         values_.Number(node, "conaffinity", enclosing, 1.0) != 0.0;
    if (shown) model_.visuals.push_back(shape);
    if (touches) model_.collisions.push_back(std::move(shape));
    if (model_.visuals.size() > kMostShapes || model_.collisions.size() > kMostShapes)
      xml_.Refuse(node, "there are more than " + std::to_string(kMostShapes) + " geoms");
  }

  // Its kind, size and place in the link, with `at` the place of what holds it; false where it is left out.
  bool ReadForm(pugi::xml_node node, const Transform& at, const std::string& enclosing, Shape* shape) {
    shape->origin = at * values_.Place(node, enclosing);
    std::string_view type = values_.Say(node, "type", enclosing);
    if (type.empty()) type = values_.Say(node, "mesh", enclosing).empty() ? "sphere" : "mesh";
    if (type == "mesh") {
      const auto mesh = meshes_.find(values_.Say(node, "mesh", enclosing));
      if (mesh == meshes_.end()) {
        xml_.Refuse(node,
                    "the geom's mesh " + Quote(values_.Say(node, "mesh", enclosing)) + " is not among the assets");
        return false;
      }
      shape->kind = ShapeKind::kMesh;
      shape->mesh = mesh->second.file;
      shape->size = mesh->second.scale;
      xml_.CheckScale(node, shape->size);
      return true;
    }
    constexpr std::pair<std::string_view, ShapeKind> kForms[] = {{"box", ShapeKind::kBox},
                                                                 {"sphere", ShapeKind::kSphere},
                                                                 {"cylinder", ShapeKind::kCylinder},
                                                                 {"capsule", ShapeKind::kCapsule}};
    const auto form =
        std::find_if(std::begin(kForms), std::end(kForms), [&](const auto& each) { return each.first == type; });
    if (form == std::end(kForms)) {
      if (type != "plane") Warn("link " + Quote(shape->link) + ": a geom of type " + Quote(type) + " is left out");
      return false;
    }
    shape->kind = form->second;
    std::vector<double> size = xml_.ListOf(node, "size", values_.Say(node, "size", enclosing), 3);
    const auto ends = values_.List(node, "fromto", enclosing, 6);
    if (!ends.empty() && !size.empty()) {
      const Vector3 from{ends[0], ends[1], ends[2]}, to{ends[3], ends[4], ends[5]};
      const Transform along{TurnOfZInto(UnitOrZ(to - from)), 0.5 * (from + to)};
      shape->origin = at * along;
      size = {size[0], 0.5 * Norm(to - from)};
    }
    const std::size_t needed = shape->kind == ShapeKind::kBox ? 3 : shape->kind == ShapeKind::kSphere ? 1 : 2;
    for (std::size_t i = 0; i < needed; ++i) {
      if (i < size.size() && size[i] > 0.0 && size[i] < 1e6) continue;
      xml_.Refuse(node, "a geom of type " + Quote(type) + " needs " + std::to_string(needed) + " sizes above 0");
      return false;
    }
    if (needed == 3) shape->size = {2 * size[0], 2 * size[1], 2 * size[2]};
    if (needed == 2) shape->size = {size[0], size[0], 2 * size[1]};
    if (needed == 1) shape->size = {size[0], size[0], size[0]};
    return true;
  }

  void ReadEqualities(pugi::xml_node equality) {
    for (const pugi::xml_node node : equality.children("joint")) {
      const std::string follower = xml_.Text(node, "joint1"), leader = node.attribute("joint2").value();
      const std::vector<double> given = xml_.ListOf(node, "polycoef", values_.Say(node, "polycoef", "main"), 5);
      std::array<double, 5> polynomial = {0, 1, 0, 0, 0};
      std::copy(given.begin(), given.end(), polynomial.begin());
      const bool line = polynomial[2] == 0.0 && polynomial[3] == 0.0 && polynomial[4] == 0.0;
      const auto joint = std::find_if(model_.robot.joints.begin(), model_.robot.joints.end(),
                                      [&](const robot::JointDescription& each) { return each.name == follower; });
      if (joint == model_.robot.joints.end() || leader.empty() || !line)
        Warn("the equality of joint " + Quote(follower) + " is no line of another joint; it is left out");
      else
        joint->mimic = robot::Mimic{leader, polynomial[1], polynomial[0]};
    }
  }

  XmlReader& xml_;
  MjcfValues values_;
  Model model_;
  std::string mesh_folder_;
  std::map<std::string, MjcfMesh, std::less<>> meshes_;
  std::map<std::string, Colour, std::less<>> materials_;
  int unnamed_ = 0;
};

}  // namespace

Result<Model> ReadMjcf(std::string_view text) {
  XmlReader xml(text);
  return ReadMjcf(xml);
}

Result<Model> ReadMjcf(XmlReader& xml) {
  return MjcfReader(xml).Read();
}

}  // namespace consac::twin
