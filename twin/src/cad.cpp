#include "consac/twin/cad.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "consac/base/names.h"
#include "triangles.h"

namespace consac::twin {
namespace {

using robot::Vector3;

constexpr char kCadMagic[8] = {'c', 'o', 'n', 's', 'a', 'c', 'A', 'D'};
constexpr std::uint32_t kCadVersion = 1;
constexpr std::uint32_t kFileRecord = 1, kPartRecord = 2, kNodeRecord = 3, kWarningRecord = 4, kEndRecord = 5,
                        kJointRecord = 6;
constexpr std::size_t kMostCadText = 1000;  // bytes of a name or a warning
constexpr std::size_t kMostWarnings = 1000;
constexpr std::size_t kMostPathBytes = std::size_t{256} << 20;  // a path names all that holds a node
constexpr double kFarthest = 1e6;                               // m
constexpr std::size_t kCylinderBytes = 10 * 8 + 4, kColourBytes = 4 * 4, kTriangleBytes = 36;

// Numbers and texts one after another.
class CadBytes {
 public:
  void U32(std::uint32_t value) { Word(value, 4); }
  void U64(std::uint64_t value) { Word(value, 8); }
  void F32(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, 4);
    Word(bits, 4);
  }
  void F64(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, 8);
    Word(bits, 8);
  }
  void Point(Vector3 v) { F64(v.x), F64(v.y), F64(v.z); }
  void Text(std::string_view text) {
    text = text.substr(0, kMostCadText);
    U32(static_cast<std::uint32_t>(text.size()));
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  }
  std::vector<std::byte> bytes;

 private:
  void Word(std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::byte>(value >> (8 * i)));
  }
};

// The same taken apart. What is not there is 0, and good() false.
class CadCut {
 public:
  explicit CadCut(std::span<const std::byte> bytes) : rest_(bytes) {}
  std::uint32_t U32() { return static_cast<std::uint32_t>(Word(4)); }
  std::uint64_t U64() { return Word(8); }
  float F32() {
    const std::uint32_t bits = U32();
    float value = 0;
    std::memcpy(&value, &bits, 4);
    return value;
  }
  double F64() {
    const std::uint64_t bits = U64();
    double value = 0;
    std::memcpy(&value, &bits, 8);
    if (!(std::abs(value) <= kFarthest)) good_ = false, value = 0.0;
    return value;
  }
  Vector3 Point() {
    Vector3 v;
    v.x = F64(), v.y = F64(), v.z = F64();
    return v;
  }
  std::string Text() {
    const std::span<const std::byte> text = Take(std::min<std::size_t>(U32(), kMostCadText + 1));
    if (text.size() > kMostCadText) good_ = false;
    return PrintableLine(std::string(reinterpret_cast<const char*>(text.data()), text.size()));
  }
  std::span<const std::byte> Take(std::uint64_t count) {
    if (count > rest_.size()) good_ = false, count = 0;
    const std::span<const std::byte> taken = rest_.first(static_cast<std::size_t>(count));
    rest_ = rest_.subspan(static_cast<std::size_t>(count));
    return taken;
  }
  void Fail() { good_ = false; }
  bool good() const { return good_; }
  std::size_t left() const { return rest_.size(); }

 private:
  std::uint64_t Word(std::size_t count) {
    const std::span<const std::byte> bytes = Take(count);
    std::uint64_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | std::to_integer<std::uint64_t>(bytes[i]);
    return value;
  }
  std::span<const std::byte> rest_;
  bool good_ = true;
};

bool IsUnit(Vector3 v) {
  return std::abs(Norm(v) - 1.0) < 1e-6;
}

CadCylinder ReadCylinder(CadCut* in) {
  CadCylinder c;
  c.origin = in->Point(), c.direction = in->Point();
  c.radius = in->F64(), c.from = in->F64(), c.to = in->F64(), c.sweep = in->F64();
  c.concave = in->U32() != 0;
  if (!IsUnit(c.direction) || !(c.radius > 0.0) || c.from > c.to) in->Fail();
  return c;
}

CadNode ReadNode(CadCut* in, const CadAssembly& assembly) {
  CadNode node;
  node.parent = static_cast<std::int32_t>(in->U32()), node.part = static_cast<std::int32_t>(in->U32());
  node.name = in->Text();
  node.place.position = in->Point();
  robot::Quaternion& q = node.place.rotation;
  q.x = in->F64(), q.y = in->F64(), q.z = in->F64(), q.w = in->F64();
  const double length = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(std::abs(length - 1.0) < 1e-6)) in->Fail();
  if (in->U32() != 0) {
    node.colour = Colour{};
    for (double& each : *node.colour) each = in->F64();
    for (const double each : *node.colour) {
      if (!(each >= 0.0 && each <= 1.0)) in->Fail();
    }
  }
  const auto in_range = [](std::int32_t number, std::size_t count) {
    return number >= -1 && number < static_cast<std::int32_t>(count);
  };
  if (!in_range(node.parent, assembly.nodes.size()) || !in_range(node.part, assembly.parts.size())) in->Fail();
  if (in->good() && node.parent >= 0 && assembly.nodes[static_cast<std::size_t>(node.parent)].part >= 0) in->Fail();
  return node;
}

CadJoint ReadJoint(CadCut* in, const CadAssembly& assembly) {
  CadJoint joint;
  joint.name = in->Text();
  const std::uint32_t type = in->U32();
  if (type > 2) in->Fail();
  joint.type = type == 0   ? robot::JointType::kFixed
               : type == 1 ? robot::JointType::kRevolute
                           : robot::JointType::kPrismatic;
  joint.first = static_cast<std::int32_t>(in->U32()), joint.second = static_cast<std::int32_t>(in->U32());
  joint.origin = in->Point(), joint.direction = in->Point();
  joint.drawn_at = in->F64();
  const std::uint32_t limits = in->U32();
  if ((limits & 1) != 0) joint.lower = in->F64();
  if ((limits & 2) != 0) joint.upper = in->F64();
  const auto there = [&](std::int32_t node) {
    return node >= 0 && node < static_cast<std::int32_t>(assembly.nodes.size());
  };
  if (limits > 3 || joint.lower > joint.upper || !IsUnit(joint.direction)) in->Fail();
  if (!there(joint.first) || !there(joint.second)) in->Fail();
  return joint;
}

Status Damaged(const std::string& what) {
  return {StatusCode::kDataLoss, "what consac-cad wrote " + what + "; is it of this version?"};
}

}  // namespace

Result<CadAssembly> ReadCad(std::span<const std::byte> bytes) {
  CadCut in(bytes);
  const std::span<const std::byte> magic = in.Take(sizeof kCadMagic);
  if (magic.size() != sizeof kCadMagic || std::memcmp(magic.data(), kCadMagic, sizeof kCadMagic) != 0)
    return Damaged("is no assembly");
  if (const std::uint32_t version = in.U32(); version != kCadVersion)
    return Damaged("is of format " + std::to_string(version) + ", and 1 is read");
  CadAssembly assembly;
  std::size_t cylinders = 0, path_bytes = 0;
  std::vector<std::size_t> path_lengths;  // of each node
  for (std::uint64_t records = 0;; ++records) {
    const std::uint32_t kind = in.U32();
    CadCut record(in.Take(in.U64()));
    if (!in.good()) return Damaged("is cut in record " + std::to_string(records));
    if (kind == kEndRecord) {
      if (record.U64() != records || in.left() != 0 || assembly.format.empty()) return Damaged("ends wrongly");
      return assembly;
    }
    if (kind == kFileRecord) {
      assembly.format = record.Text(), assembly.unit = record.Text();
    } else if (kind == kPartRecord) {
      CadPart part;
      part.name = record.Text();
      part.low = record.Point(), part.high = record.Point();
      const std::uint32_t count = record.U32();
      cylinders += count;
      if (cylinders > kMostCylinders || assembly.parts.size() >= kMostCadParts)
        return Status{StatusCode::kResourceExhausted, "more than " + std::to_string(kMostCadParts) + " parts or " +
                                                          std::to_string(kMostCylinders) +
                                                          " cylinders; simplify the assembly"};
      for (std::uint32_t i = 0; i < count && record.left() >= kCylinderBytes && record.good(); ++i)
        part.cylinders.push_back(ReadCylinder(&record));
      if (part.cylinders.size() != count) record.Fail();
      assembly.parts.push_back(std::move(part));
      assembly.meshes.push_back(record.Take(record.left()));
    } else if (kind == kNodeRecord) {
      if (assembly.nodes.size() >= kMostCadNodes)
        return Status{StatusCode::kResourceExhausted,
                      "it holds more than " + std::to_string(kMostCadNodes) + " parts and assemblies; simplify it"};
      assembly.nodes.push_back(ReadNode(&record, assembly));
      if (record.good()) {
        const CadNode& node = assembly.nodes.back();
        path_lengths.push_back(node.name.size() + 1 +
                               (node.parent < 0 ? 0 : path_lengths[static_cast<std::size_t>(node.parent)]));
        path_bytes += path_lengths.back();
      }
      if (path_bytes > kMostPathBytes)
        return Status{StatusCode::kResourceExhausted,
                      "its assemblies are nested too deep: the paths of its parts have more than 256 MiB; simplify it"};
    } else if (kind == kJointRecord && assembly.joints.size() < kMostCadJoints) {
      assembly.joints.push_back(ReadJoint(&record, assembly));
    } else if (kind == kWarningRecord && assembly.warnings.size() < kMostWarnings) {
      assembly.warnings.push_back(record.Text());
    } else {
      record.Fail();
    }
    if (!record.good() || record.left() != 0) return Damaged("is damaged in record " + std::to_string(records));
  }
}

Result<Triangles> TrianglesOf(const CadAssembly& assembly, std::size_t part) {
  CadCut in(assembly.meshes[part]);
  Triangles triangles;
  const std::uint64_t groups = in.U32(), count = in.U32();
  if (groups > count || count > kMostTriangles || in.left() != groups * (8 + kColourBytes) + count * kTriangleBytes)
    return Damaged("has a damaged mesh, part " + std::to_string(part));
  std::vector<std::pair<std::uint32_t, std::optional<Colour>>> sizes;
  for (std::uint64_t g = 0; g < groups; ++g) {
    const std::uint32_t size = in.U32();
    const bool coloured = in.U32() != 0;
    Colour colour{};
    for (double& each : colour) each = std::clamp(static_cast<double>(in.F32()), 0.0, 1.0);
    for (const double each : colour) {
      if (!(each >= 0.0)) in.Fail();
    }
    sizes.emplace_back(size, coloured ? std::optional(colour) : std::nullopt);
  }
  std::uint64_t read = 0;
  for (const auto& [size, colour] : sizes) {
    const std::size_t first = triangles.count();
    for (std::uint32_t t = 0; t < size && read < count; ++t, ++read) {
      float corners[9];
      for (float& each : corners) {
        each = in.F32();
        if (!(std::abs(each) <= static_cast<float>(kFarthest))) in.Fail(), each = 0.0f;
      }
      AddTriangle(corners, &triangles.corners);
    }
    if (triangles.count() > first) triangles.parts.push_back({first, triangles.count() - first, colour});
  }
  if (!in.good() || in.left() != 0) return Damaged("has a damaged mesh, part " + std::to_string(part));
  return triangles;
}

CadWriter::CadWriter(Sink sink, const std::string& format, const std::string& unit) : sink_(std::move(sink)) {
  CadBytes head;
  for (const char c : kCadMagic) head.bytes.push_back(static_cast<std::byte>(c));
  head.U32(kCadVersion);
  good_ = sink_(head.bytes);
  CadBytes file;
  file.Text(format), file.Text(unit);
  Put(kFileRecord, file.bytes);
}

void CadWriter::AddPart(const CadPart& part, const Triangles& triangles) {
  CadBytes out;
  out.bytes.reserve(64 + kCylinderBytes * part.cylinders.size() + kTriangleBytes * triangles.count());
  out.Text(part.name);
  out.Point(part.low), out.Point(part.high);
  out.U32(static_cast<std::uint32_t>(part.cylinders.size()));
  for (const CadCylinder& c : part.cylinders) {
    out.Point(c.origin), out.Point(c.direction);
    out.F64(c.radius), out.F64(c.from), out.F64(c.to), out.F64(c.sweep);
    out.U32(c.concave ? 1 : 0);
  }
  out.U32(static_cast<std::uint32_t>(triangles.parts.size()));
  out.U32(static_cast<std::uint32_t>(triangles.count()));
  for (const MeshPart& each : triangles.parts) {
    out.U32(static_cast<std::uint32_t>(each.count));
    out.U32(each.colour.has_value() ? 1 : 0);
    for (const double value : each.colour.value_or(Colour{})) out.F32(static_cast<float>(value));
  }
  for (const float value : triangles.corners) out.F32(value);
  Put(kPartRecord, out.bytes);
}

void CadWriter::AddNode(const CadNode& node) {
  CadBytes out;
  out.U32(static_cast<std::uint32_t>(node.parent)), out.U32(static_cast<std::uint32_t>(node.part));
  out.Text(node.name);
  out.Point(node.place.position);
  const robot::Quaternion& q = node.place.rotation;
  out.F64(q.x), out.F64(q.y), out.F64(q.z), out.F64(q.w);
  out.U32(node.colour.has_value() ? 1 : 0);
  for (const double value : node.colour.value_or(Colour{})) {
    if (node.colour.has_value()) out.F64(value);
  }
  Put(kNodeRecord, out.bytes);
}

void CadWriter::AddJoint(const CadJoint& joint) {
  CadBytes out;
  out.Text(joint.name);
  out.U32(joint.type == robot::JointType::kFixed ? 0 : joint.type == robot::JointType::kRevolute ? 1 : 2);
  out.U32(static_cast<std::uint32_t>(joint.first)), out.U32(static_cast<std::uint32_t>(joint.second));
  out.Point(joint.origin), out.Point(joint.direction);
  out.F64(joint.drawn_at);
  const bool below = std::isfinite(joint.lower), above = std::isfinite(joint.upper);
  out.U32((below ? 1u : 0u) | (above ? 2u : 0u));
  if (below) out.F64(joint.lower);
  if (above) out.F64(joint.upper);
  Put(kJointRecord, out.bytes);
}

void CadWriter::AddWarning(const std::string& line) {
  CadBytes out;
  out.Text(line);
  Put(kWarningRecord, out.bytes);
}

bool CadWriter::End() {
  CadBytes out;
  out.U64(records_);
  Put(kEndRecord, out.bytes);
  return good_;
}

void CadWriter::Put(std::uint32_t kind, const std::vector<std::byte>& payload) {
  CadBytes head;
  head.U32(kind), head.U64(payload.size());
  good_ = good_ && sink_(head.bytes) && sink_(payload);
  ++records_;
}

}  // namespace consac::twin
