#pragma once
// An assembly as a CAD file has it: parts, where they stand in each other, and what joints are looked for by. The
// program consac-cad (OpenCASCADE) writes it as a stream of records, this library reads it; neither part needs the
// other to be built. Not STEP itself: nothing here knows its syntax.
//
// The stream, little-endian: the 8 bytes "consacAD", the version (u32), then records of a kind (u32), a length (u64)
// and that many bytes: file, parts before the nodes that show them, nodes after their parents, joints after theirs,
// warnings, and the end, which counts the records before it. Lengths are metres, texts UTF-8 with their length (u32)
// before them.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "consac/base/status.h"
#include "consac/twin/mesh.h"
#include "consac/twin/model.h"

namespace consac::twin {

inline constexpr std::size_t kMostCadParts = 100'000;      ///< that differ
inline constexpr std::size_t kMostCadNodes = 100'000;      ///< parts and assemblies, each as often as it stands there
inline constexpr std::size_t kMostCadJoints = 10'000;      ///< that the file itself has
inline constexpr std::size_t kMostCylinders = 20'000'000;  ///< of all parts

/// A cylindrical face: a pin, or a bore.
struct CadCylinder {
  robot::Vector3 origin;        ///< a point of its axis, m, in the part's frame
  robot::Vector3 direction;     ///< of its axis, of length 1
  double radius = 0.0;          ///< m
  double from = 0.0, to = 0.0;  ///< where it begins and ends along the direction from the origin, m
  double sweep = 0.0;           ///< how much of a turn it goes around, rad
  bool concave = false;         ///< a bore
};

/// A shape that stands in one or more places.
struct CadPart {
  std::string name;          ///< the product's
  robot::Vector3 low, high;  ///< its box, m
  std::vector<CadCylinder> cylinders;
};

/// A place in the tree of assemblies.
struct CadNode {
  std::string name;              ///< the occurrence's
  std::int32_t parent = -1;      ///< node, before this one; -1 none
  std::int32_t part = -1;        ///< what stands here; -1 an assembly
  robot::Transform place;        ///< in the parent's frame, m
  std::optional<Colour> colour;  ///< of everything here, where the file says one
};

/// A joint that the file itself has, between two nodes.
struct CadJoint {
  std::string name;
  robot::JointType type = robot::JointType::kFixed;          ///< fixed, revolute or prismatic
  std::int32_t first = 0, second = 0;                        ///< nodes; the second moves by +q
  robot::Vector3 origin, direction{1, 0, 0};                 ///< of its axis, in the first node's frame, m; of length 1
  double lower = -robot::kNoLimit, upper = robot::kNoLimit;  ///< rad or m
  double drawn_at = 0.0;                                     ///< its position in the pose of the file, rad or m
};

/// An assembly.
struct CadAssembly {
  std::string format;  ///< "step" or "iges"
  std::string unit;    ///< of the file, as it names it: "millimetre", "INCH"
  std::vector<CadPart> parts;
  std::vector<CadNode> nodes;         ///< parents first
  std::vector<CadJoint> joints;       ///< few files have any
  std::vector<std::string> warnings;  ///< a line each
  /// [parts] the triangles' bytes in the stream; they live as long as that.
  std::vector<std::span<const std::byte>> meshes;
};

/// The assembly in a stream, which must outlive it. kDataLoss where it is none, kResourceExhausted where it is too
/// much.
Result<CadAssembly> ReadCad(std::span<const std::byte> bytes);
/// The triangles of a part; may be none.
Result<Triangles> TrianglesOf(const CadAssembly& assembly, std::size_t part);

/// Writes a stream.
class CadWriter {
 public:
  /// Takes bytes; false where they cannot be written.
  using Sink = std::function<bool(std::span<const std::byte>)>;
  /// Begins a stream.
  CadWriter(Sink sink, const std::string& format, const std::string& unit);
  /// Parts and nodes have numbers from 0 in the order in which they are added.
  void AddPart(const CadPart& part, const Triangles& triangles);
  void AddNode(const CadNode& node);
  void AddJoint(const CadJoint& joint);
  void AddWarning(const std::string& line);
  /// Ends it: whether all of it was written.
  bool End();

 private:
  void Put(std::uint32_t kind, const std::vector<std::byte>& payload);

  Sink sink_;
  std::uint64_t records_ = 0;
  bool good_ = true;
};

}  // namespace consac::twin
