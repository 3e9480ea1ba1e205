// USD out: one text file with UsdPhysics. Source: openusd.org, UsdPhysics, UsdGeom, UsdPreviewSurface; what UsdPhysics
// has no word for (most speed, friction, mimics) by the schemas of Newton, which readers without them pass over.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/robot/kinematics.h"
#include "looks.h"
#include "principal.h"
#include "scene.h"
#include "usd_text.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;

constexpr double kDriveDamping = 2.0;  // N m s/rad, N s/m: critical for kDriveStiffness and 0.01 kg m^2

class UsdWriter {
 public:
  UsdWriter(const Scene& scene, const LoadGeometry& load) : scene_(scene), robot_(scene.robot), load_(load) {}

  Status Write(const std::string& path) {
    root_ = UsdNames().Make(robot_.name);
    CONSAC_RETURN_IF_ERROR(file_.Begin(path, root_, std::string("consac ") + kVersion));
    NameAll();
    file_.Open(
        "def Xform", root_,
        "prepend apiSchemas = [\"PhysicsArticulationRootAPI\"]" + Shown(robot_.name, root_) + "\nkind = \"component\"");
    WriteMaterials();
    WriteLinks();
    WriteJoints();
    CONSAC_RETURN_IF_ERROR(WriteMeshes());
    file_.Close();
    return file_.End();
  }

 private:
  // A line of metadata with the name as the file has it, where a prim cannot be called so.
  static std::string Shown(std::string_view name, std::string_view prim) {
    return name == prim || name.empty() ? "" : "\ndisplayName = " + UsdQuoted(name);
  }
  std::string LinkPath(std::int32_t link) const {
    return "</" + root_ + "/links/" + links_[static_cast<std::size_t>(link)] + ">";
  }

  void NameAll() {
    UsdNames links, joints, meshes, materials;
    for (const robot::Link& link : robot_.links) links_.push_back(links.Make(link.name));
    for (const robot::Joint& joint : robot_.joints) joints_.push_back(joints.Make(joint.name));
    root_joint_ = joints.Make("root_joint");
    geometries_ = scene_.geometries;
    for (const PlacedShape& shape : scene_.collisions) {
      if (shape.shape.kind == ShapeKind::kMesh && GeometryOf(shape) == geometries_.size())
        geometries_.push_back({shape.shape.kind, shape.mesh, shape.shape.size, {}, 0, {}, {}});
    }
    for (const Geometry& geometry : geometries_) {
      const std::string_view file =
          geometry.kind == ShapeKind::kMesh ? std::string_view(scene_.files[geometry.file].output) : "shape.stl";
      const std::string_view base = file.substr(file.rfind('/') + 1);
      meshes_.push_back(meshes.Make(base.substr(0, base.rfind('.'))));
    }
    for (std::size_t v = 0; v < scene_.visuals.size(); ++v) {
      std::vector<std::size_t>& own = visual_materials_.emplace_back();
      for (const MeshPart& part : scene_.geometries[scene_.visual_geometry[v]].parts)
        own.push_back(palette_.Of(scene_.visuals[v].shape, part));
    }
    for (const Palette::Material& each : palette_.materials()) materials_.push_back(materials.Make(each.name));
  }

  std::size_t GeometryOf(const PlacedShape& shape) const {
    const Geometry wanted{shape.shape.kind, shape.mesh, shape.shape.size, {}, 0, {}, {}};
    const auto known = std::find_if(geometries_.begin(), geometries_.end(),
                                    [&](const Geometry& each) { return SameGeometry(each, wanted); });
    return static_cast<std::size_t>(known - geometries_.begin());
  }

  void WriteMaterials() {
    file_.Open("def Scope", "materials");
    for (std::size_t i = 0; i < materials_.size(); ++i) {
      const auto& [name, colour] = palette_.materials()[i];
      const auto [red, green, blue] = LinearOf(colour);
      const std::string shown = Shown(name, materials_[i]);
      file_.Open("def Material", materials_[i], shown.empty() ? shown : shown.substr(1));
      file_.Line("token outputs:surface.connect = </" + root_ + "/materials/" + materials_[i] +
                 "/surface.outputs:surface>");
      file_.Open("def Shader", "surface");
      file_.Line("uniform token info:id = \"UsdPreviewSurface\"");
      file_.Line("color3f inputs:diffuseColor = " + UsdTuple(robot::Vector3{red, green, blue}));
      file_.Line("float inputs:metallic = 0");
      file_.Line("float inputs:opacity = " + NumberText(colour[3]));
      file_.Line("float inputs:roughness = " + NumberText(kRoughness));
      file_.Line("token outputs:surface");
      file_.Close();
      file_.Close();
    }
    file_.Close();
  }

  void WriteLinks() {
    std::vector<Transform> places(robot_.links.size());  // where links are with every position at 0
    const std::vector<double> zero(robot_.position_joints.size(), 0.0);
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const robot::Joint& joint = robot_.joints[j];
      places[j + 1] = places[static_cast<std::size_t>(joint.parent)] * RestOf(robot_, joint);
      if (Moves(robot_, joint)) places[j + 1] = places[j + 1] * JointMotion(joint, JointPosition(joint, zero));
    }
    file_.Open("def Scope", "links");
    for (std::size_t link = 0; link < places.size(); ++link) WriteLink(static_cast<std::int32_t>(link), places[link]);
    file_.Close();
  }

  void WriteLink(std::int32_t number, const Transform& place) {
    const robot::Link& link = robot_.links[static_cast<std::size_t>(number)];
    const std::string& name = links_[static_cast<std::size_t>(number)];
    std::vector<std::string> may_touch;
    for (const auto& [first, second] : robot_.allowed_collisions) {
      if (first == number) may_touch.push_back(LinkPath(second));
    }
    const bool weighs = link.inertial.has_value() && link.inertial->mass > 0.0;
    file_.Open("def Xform", name,
               std::string("prepend apiSchemas = [\"PhysicsRigidBodyAPI\"") + (weighs ? ", \"PhysicsMassAPI\"" : "") +
                   (may_touch.empty() ? "]" : ", \"PhysicsFilteredPairsAPI\"]") + Shown(link.name, name));
    if (weighs) WriteMass(*link.inertial);
    if (!may_touch.empty()) {
      std::string line = "rel physics:filteredPairs = [";
      for (const std::string& each : may_touch) line += (line.back() == '[' ? "" : ", ") + each;
      file_.Line(line + "]");
    }
    file_.Place(place);
    UsdNames names;
    for (std::size_t v = 0; v < scene_.visuals.size(); ++v) {
      if (scene_.visuals[v].link == number) WriteVisual(v, &names);
    }
    for (const PlacedShape& shape : scene_.collisions) {
      if (shape.link == number) WriteCollision(shape, names.Make("collision"));
    }
    file_.Close();
  }

  void WriteMass(const robot::Inertial& body) {
    file_.Line("point3f physics:centerOfMass = " + UsdTuple(body.centre));
    const PrincipalInertia principal = PrincipalOf(body.inertia);
    const auto& [x, y, z] = principal.moments;
    if (x > 0.0 && y > 0.0 && z > 0.0) {
      file_.Line("float3 physics:diagonalInertia = " + UsdTuple(principal.moments));
      file_.Line("quatf physics:principalAxes = " + UsdQuaternion(principal.axes));
    }
    file_.Line("float physics:mass = " + NumberText(body.mass));
  }

  std::string Reference(std::size_t geometry) const {
    return "prepend references = </" + root_ + "/meshes/" + meshes_[geometry] + ">";
  }
  void Bind(std::size_t material) {
    file_.Line("rel material:binding = </" + root_ + "/materials/" + materials_[material] + ">");
  }

  void WriteVisual(std::size_t v, UsdNames* names) {
    const PlacedShape& visual = scene_.visuals[v];
    const std::vector<std::size_t>& looks = visual_materials_[v];
    const bool one = std::all_of(looks.begin(), looks.end(), [&](std::size_t each) { return each == looks[0]; });
    file_.Open("def Mesh", names->Make("visual"),
               "prepend apiSchemas = [\"MaterialBindingAPI\"]\n" + Reference(scene_.visual_geometry[v]) +
                   Shown(visual.shape.name, ""));
    if (one && !looks.empty()) Bind(looks[0]);
    file_.Place(visual.origin);
    for (std::size_t part = 0; part < looks.size() && !one; ++part) {
      file_.Open("over", PartName(part), "prepend apiSchemas = [\"MaterialBindingAPI\"]");
      Bind(looks[part]);
      file_.Close();
    }
    file_.Close();
  }

  void WriteCollision(const PlacedShape& placed, const std::string& name) {
    const robot::Vector3& s = placed.shape.size;
    constexpr const char* kSolid = "prepend apiSchemas = [\"PhysicsCollisionAPI\"]";
    switch (placed.shape.kind) {
      case ShapeKind::kMesh:
        file_.Open("def Mesh", name,
                   "prepend apiSchemas = [\"PhysicsCollisionAPI\", \"PhysicsMeshCollisionAPI\"]\n" +
                       Reference(GeometryOf(placed)));
        file_.Line("uniform token physics:approximation = \"convexHull\"");
        break;
      case ShapeKind::kBox: {
        file_.Open("def Cube", name, kSolid);
        const double corners[][3] = {{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}};
        file_.Line("float3[] extent = [" + UsdTuple(corners[0]) + ", " + UsdTuple(corners[1]) + "]");
        file_.Line("double size = 1");
        break;
      }
      case ShapeKind::kSphere:
        file_.Open("def Sphere", name, kSolid);
        Extent({s.x, s.x, s.x});
        file_.Line("double radius = " + NumberText(s.x));
        break;
      case ShapeKind::kCylinder:
      case ShapeKind::kCapsule: {
        const bool round = placed.shape.kind == ShapeKind::kCapsule;
        file_.Open(round ? "def Capsule" : "def Cylinder", name, kSolid);
        Extent({s.x, s.x, 0.5 * s.z + (round ? s.x : 0.0)});
        file_.Line("uniform token axis = \"Z\"");
        file_.Line("double height = " + NumberText(s.z));
        file_.Line("double radius = " + NumberText(s.x));
        break;
      }
    }
    file_.Line("uniform token purpose = \"guide\"");
    file_.Place(placed.origin, placed.shape.kind == ShapeKind::kBox ? std::optional(s) : std::nullopt);
    file_.Close();
  }

  void Extent(robot::Vector3 half) {
    file_.Line("float3[] extent = [" + UsdTuple(-1.0 * half) + ", " + UsdTuple(half) + "]");
  }

  void WriteJoints() {
    file_.Open("def Scope", "joints");
    file_.Open("def PhysicsFixedJoint", root_joint_);  // to the world
    file_.Line("rel physics:body1 = " + LinkPath(0));
    file_.Close();
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) WriteJoint(j);
    file_.Close();
  }

  void WriteJoint(std::size_t j) {
    const robot::Joint& joint = robot_.joints[j];
    const bool moves = Moves(robot_, joint), slides = joint.type == JointType::kPrismatic;
    const std::string kind = slides ? "linear" : "angular";
    // Angles are degrees, and what is per angle is per degree.
    const double unit = slides ? 1.0 : 180.0 / robot::kPiRadians;
    std::string apis;
    if (moves) {
      apis = "prepend apiSchemas = [\"NewtonJointAPI\"" +
             (joint.mimics >= 0 ? std::string(", \"NewtonMimicAPI\"]") : ", \"PhysicsDriveAPI:" + kind + "\"]");
    }
    const std::string shown = Shown(joint.name, joints_[j]);
    file_.Open(!moves   ? "def PhysicsFixedJoint"
               : slides ? "def PhysicsPrismaticJoint"
                        : "def PhysicsRevoluteJoint",
               joints_[j], apis.empty() && !shown.empty() ? shown.substr(1) : apis + shown);
    if (moves) file_.Line("uniform token physics:axis = \"X\"");
    file_.Line("rel physics:body0 = " + LinkPath(joint.parent));
    file_.Line("rel physics:body1 = " + LinkPath(static_cast<std::int32_t>(j) + 1));
    const Transform rest = RestOf(robot_, joint);
    file_.Line("point3f physics:localPos0 = " + UsdTuple(rest.position));
    file_.Line("quatf physics:localRot0 = " + UsdQuaternion(rest.rotation));
    if (moves) WriteMotion(joint, kind, unit);
    file_.Close();
  }

  void WriteMotion(const robot::Joint& joint, const std::string& kind, double unit) {
    const robot::JointDrive& drive = joint.drive;
    const auto number = [&](const std::string& name, double value) {
      if (std::isfinite(value)) file_.Line("float " + name + " = " + NumberText(value));
    };
    if (joint.type != JointType::kContinuous) {
      number("physics:lowerLimit", drive.lower * unit);
      number("physics:upperLimit", drive.upper * unit);
    }
    number("newton:damping", drive.damping / unit);
    number("newton:friction", drive.friction);
    if (drive.velocity > 0.0) number("newton:velocityLimit", drive.velocity * unit);
    if (joint.mimics >= 0) {
      const auto leader = static_cast<std::size_t>(joint.mimics);
      file_.Line("rel newton:mimicJoint = </" + root_ + "/joints/" + joints_[leader] + ">");
      number("newton:mimicCoef0", joint.offset * unit);
      number("newton:mimicCoef1", joint.multiplier);
      return;
    }
    const std::string name = "drive:" + kind + ":physics:";
    file_.Line("uniform token " + name + "type = \"force\"");
    if (drive.effort > 0.0) number(name + "maxForce", drive.effort);
    number(name + "stiffness", kDriveStiffness / unit);
    number(name + "damping", kDriveDamping / unit);
    number(name + "targetPosition", 0.0);
  }

  static std::string PartName(std::size_t part) { return "part_" + std::to_string(part + 1); }

  // What is referenced stands in a class, which nobody draws or simulates.
  Status WriteMeshes() {
    file_.Open("class Scope", "meshes");
    for (std::size_t i = 0; i < geometries_.size(); ++i) {
      const Result<Triangles> triangles = load_(geometries_[i]);
      if (!triangles.ok()) return triangles.status();
      WriteMesh(Weld(*triangles), meshes_[i], geometries_[i].parts);
    }
    file_.Close();
    return {};
  }

  void WriteMesh(Mesh mesh, const std::string& name, const std::vector<MeshPart>& parts) {
    file_.Open("def Mesh", name);
    float low[3] = {}, high[3] = {};
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const float value = mesh.positions[i];
      low[i % 3] = i < 3 ? value : std::min(low[i % 3], value);
      high[i % 3] = i < 3 ? value : std::max(high[i % 3], value);
    }
    const float extent[] = {low[0], low[1], low[2], high[0], high[1], high[2]};
    file_.Numbers("float3[] extent", extent, 3);
    file_.Numbers("int[] faceVertexCounts", std::vector<std::uint32_t>(mesh.indices.size() / 3, 3));
    file_.Numbers("int[] faceVertexIndices", mesh.indices);
    // Four digits of a direction are more than anybody sees.
    for (float& value : mesh.normals) value = std::round(value * 1e4f) / 1e4f;
    file_.Numbers("normal3f[] primvars:normals", mesh.normals, 3);
    file_.Line("uniform token primvars:normals:interpolation = \"vertex\"");
    file_.Numbers("point3f[] points", mesh.positions, 3);
    file_.Line("uniform token subdivisionScheme = \"none\"");
    if (parts.size() > 1) {
      file_.Line("uniform token subsetFamily:materialBind:familyType = \"partition\"");
      for (std::size_t part = 0; part < parts.size(); ++part) WriteSubset(PartName(part), parts[part]);
    }
    file_.Close();
  }

  void WriteSubset(const std::string& name, const MeshPart& part) {
    file_.Open("def GeomSubset", name);
    file_.Line("uniform token elementType = \"face\"");
    file_.Line("uniform token familyName = \"materialBind\"");
    std::vector<std::uint32_t> faces(part.count);
    std::iota(faces.begin(), faces.end(), static_cast<std::uint32_t>(part.first));
    file_.Numbers("int[] indices", faces);
    file_.Close();
  }

  const Scene& scene_;
  const robot::Robot& robot_;
  const LoadGeometry& load_;
  UsdFile file_;
  std::string root_, root_joint_;
  std::vector<std::string> links_, joints_, meshes_, materials_;  // prims' names
  std::vector<Geometry> geometries_;                              // of visuals, then of what collides alone
  Palette palette_;
  std::vector<std::vector<std::size_t>> visual_materials_;  // [visuals][parts]
};

}  // namespace

Status WriteUsd(const Scene& scene, const LoadGeometry& load, const std::string& path) {
  return UsdWriter(scene, load).Write(path);
}

}  // namespace consac::twin
