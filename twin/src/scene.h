#pragma once
// What the writers write from: shapes placed on a robot's links, and the geometries they share. Private to twin.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "consac/robot/robot.h"
#include "consac/twin/mesh.h"
#include "consac/twin/urdf.h"

namespace consac::twin {

/// A geometry that several shapes may show: a mesh of one file at one scale, or a simple shape of one size.
struct Geometry {
  ShapeKind kind = ShapeKind::kMesh;
  std::size_t file = 0;                ///< of a mesh: which of Scene::files
  robot::Vector3 size;                 ///< scale, or Shape::size
  std::vector<MeshPart> parts;         ///< of its triangles
  std::size_t vertices = 0;            ///< once welded
  std::array<float, 3> low{}, high{};  ///< corners of its box, as glTF has them
  friend bool SameGeometry(const Geometry& a, const Geometry& b) {
    return a.kind == b.kind && a.file == b.file && a.size == b.size;
  }
};

/// A mesh file: what it was called and is called in the output.
struct MeshFile {
  std::string name;    ///< as the description says it
  std::string output;  ///< "meshes/base.stl", below the output folder
  std::size_t triangles = 0;
  std::vector<MeshPart> parts;
};

/// A robot with its looks.
struct Scene {
  robot::Robot robot;
  std::vector<PlacedShape> visuals, collisions;
  std::vector<std::size_t> visual_geometry;  ///< [visuals] which of the geometries each shows
  std::vector<Geometry> geometries;          ///< of visuals
  std::vector<MeshFile> files;               ///< PlacedShape::mesh
};

inline constexpr double kDriveStiffness = 100.0;  ///< N m/rad, N/m of motors: a start, to be tuned for the robot

/// Where a joint is held by limits that are equal, its own or those of the joint it follows. Simulators take no range
/// without a length, so such a joint is fixed in what is written for them.
std::optional<double> HeldAt(const robot::Robot& robot, const robot::Joint& joint);
/// Whether it is neither fixed nor held.
bool Moves(const robot::Robot& robot, const robot::Joint& joint);
/// Its frame in the parent link's: at rest, or where it is held.
robot::Transform RestOf(const robot::Robot& robot, const robot::Joint& joint);

/// Reads a geometry's triangles again.
using LoadGeometry = std::function<Result<Triangles>(const Geometry&)>;

/// Writes the scene as binary glTF 2.0, one geometry in memory at a time: for link 0 a node, for every joint a node
/// that stands where it is and one that moves (robot::NodeNamesOf), below it a node for each visual. Geometries are
/// written once and shared. The same bytes for the same scene. Errors of `load` and of the file.
Status WriteGlb(const Scene& scene, const LoadGeometry& load, const std::string& path);

/// Writes the scene as USD text with UsdPhysics, one geometry in memory at a time: links side by side below an
/// articulation's root, joints about X with limits and drives, meshes once and referenced, collision shapes as guides.
/// The same bytes for the same scene. Errors of `load` and of the file.
Status WriteUsd(const Scene& scene, const LoadGeometry& load, const std::string& path);

/// A robot as MJCF.
struct MjcfText {
  std::string text;
  std::vector<std::string> massless;  ///< links that move and have no mass: MuJoCo refuses the file for them
};
/// The robot as MJCF for MuJoCo 2.2 and later: bodies in the re-based frames, hinges and slides about X with explicit
/// limits, a position actuator for each joint that moves by itself, mimics as equalities, neighbours and allowed pairs
/// excluded from contact. A joint whose limits are equal is none there; a link without mass and shape between two
/// joints is none either, its joint stands in the body below.
MjcfText WriteMjcf(const Scene& scene);

}  // namespace consac::twin
