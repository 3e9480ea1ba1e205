// Binary glTF 2.0: a header, a chunk of JSON, a chunk of numbers. Source: Khronos, glTF 2.0, 4.4.
#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/version.h"
#include "consac/robot/conventions.h"
#include "consac/robot/table.h"
#include "glb_format.h"
#include "looks.h"
#include "scene.h"

namespace consac::twin {
namespace {

using Json = nlohmann::ordered_json;
using robot::Convention;

constexpr int kUnsigned = 5125, kArrayBuffer = 34962, kElementBuffer = 34963;

void PutWord(std::uint32_t value, std::vector<std::byte>* out) {
  for (int i = 0; i < 4; ++i) out->push_back(static_cast<std::byte>(value >> (8 * i)));
}

// Meshes of the scene, and their materials; equal ones are one.
class Looks {
 public:
  explicit Looks(const Scene& scene) : scene_(scene) {}

  // The mesh that shows visual `v`.
  std::size_t MeshOf(std::size_t v) {
    const Shape& shape = scene_.visuals[v].shape;
    const std::size_t geometry = scene_.visual_geometry[v];
    Json primitives = Json::array();
    const Geometry& looks = scene_.geometries[geometry];
    for (std::size_t part = 0; part < looks.parts.size(); ++part) {
      primitives.push_back(
          {{"attributes", {{"POSITION", first_accessor[geometry]}, {"NORMAL", first_accessor[geometry] + 1}}},
           {"indices", first_accessor[geometry] + 2 + part},
           {"material", palette_.Of(shape, looks.parts[part])}});
    }
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      if (meshes[i]["primitives"] == primitives) return i;
    }
    const std::string name = looks.kind == ShapeKind::kMesh ? scene_.files[looks.file].output : "shape";
    meshes.push_back({{"name", name}, {"primitives", std::move(primitives)}});
    return meshes.size() - 1;
  }

  // Those of the meshes so far.
  Json Materials() const {
    Json materials = Json::array();
    for (const auto& [name, colour] : palette_.materials()) {
      const auto [red, green, blue] = LinearOf(colour);
      materials.push_back({{"name", name},
                           {"pbrMetallicRoughness",
                            {{"baseColorFactor", {red, green, blue, colour[3]}},
                             {"metallicFactor", 0.0},
                             {"roughnessFactor", kRoughness}}}});
      if (colour[3] < 1.0) materials.back()["alphaMode"] = "BLEND";
    }
    return materials;
  }

  Json meshes = Json::array();
  std::vector<std::size_t> first_accessor;  // [geometries]

 private:
  const Scene& scene_;
  Palette palette_;
};

Json Node(const std::string& name, const robot::Transform& at) {
  const robot::Transform written = TransformIn(Convention::kGltf, at);
  const auto& [q, p] = written;
  Json node = {{"name", name}};
  if (!(p == robot::Vector3{})) node["translation"] = {p.x, p.y, p.z};
  if (!(q == robot::Quaternion{})) node["rotation"] = {q.x, q.y, q.z, q.w};
  return node;
}

// Accessors and views of every geometry; the length of all numbers.
std::size_t DescribeNumbers(const Scene& scene, Looks* looks, Json* accessors, Json* views) {
  std::size_t bytes = 0;
  const auto view = [&](std::size_t length, int target) {
    views->push_back({{"buffer", 0}, {"byteOffset", bytes}, {"byteLength", length}, {"target", target}});
    bytes += length;
    return views->size() - 1;
  };
  for (const Geometry& geometry : scene.geometries) {
    looks->first_accessor.push_back(accessors->size());
    accessors->push_back({{"bufferView", view(12 * geometry.vertices, kArrayBuffer)},
                          {"componentType", kFloat},
                          {"count", geometry.vertices},
                          {"type", "VEC3"},
                          {"min", geometry.low},
                          {"max", geometry.high}});
    accessors->push_back({{"bufferView", view(12 * geometry.vertices, kArrayBuffer)},
                          {"componentType", kFloat},
                          {"count", geometry.vertices},
                          {"type", "VEC3"}});
    std::size_t triangles = 0;
    for (const MeshPart& part : geometry.parts) triangles += part.count;
    const std::size_t indices = view(12 * triangles, kElementBuffer);
    for (const MeshPart& part : geometry.parts) {
      accessors->push_back({{"bufferView", indices},
                            {"byteOffset", 12 * part.first},
                            {"componentType", kUnsigned},
                            {"count", 3 * part.count},
                            {"type", "SCALAR"}});
    }
  }
  return bytes;
}

Json NodesOf(const Scene& scene, Looks* looks) {
  const robot::Robot& robot = scene.robot;
  const robot::NodeNames names = NodeNamesOf(robot);
  std::vector<std::vector<std::size_t>> children(1 + 2 * robot.joints.size());
  Json nodes = Json::array({Node(names.base, {})});
  const auto node_of = [](std::int32_t link) { return 2 * static_cast<std::size_t>(link); };  // of a link, its joint's
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    const robot::Joint& joint = robot.joints[j];
    children[node_of(joint.parent)].push_back(1 + 2 * j);
    children[1 + 2 * j].push_back(2 + 2 * j);
    nodes.push_back(Node(names.frames[j], joint.rest));
    nodes.push_back(Node(names.joints[j], {}));
    nodes.back()["extras"] = {{"joint", joint.name}, {"type", NameOf(joint.type)}, {"link", robot.links[j + 1].name}};
  }
  std::vector<std::size_t> many(robot.links.size(), 0);
  for (std::size_t v = 0; v < scene.visuals.size(); ++v) {
    const PlacedShape& visual = scene.visuals[v];
    const auto link = static_cast<std::size_t>(visual.link);
    children[node_of(visual.link)].push_back(nodes.size());
    const std::string name =
        robot.links[link].name + "_visual" + (many[link] == 0 ? "" : "_" + std::to_string(many[link] + 1));
    ++many[link];
    nodes.push_back(Node(name, visual.origin));
    if (!visual.shape.name.empty()) nodes.back()["extras"] = {{"part", visual.shape.name}};
    nodes.back()["mesh"] = looks->MeshOf(v);
  }
  for (std::size_t i = 0; i < children.size(); ++i) {
    if (!children[i].empty()) nodes[i]["children"] = children[i];
  }
  return nodes;
}

Status WriteNumbers(const Scene& scene, const LoadGeometry& load, AtomicFile* file) {
  for (const Geometry& geometry : scene.geometries) {
    const Result<Triangles> triangles = load(geometry);
    if (!triangles.ok()) return triangles.status();
    Mesh mesh = Weld(*triangles);
    if (mesh.positions.size() != 3 * geometry.vertices)
      return {StatusCode::kDataLoss, "a mesh changed while it was written; import again"};
    for (std::vector<float>* list : {&mesh.positions, &mesh.normals}) {
      for (std::size_t i = 0; i < list->size(); i += 3) {
        const float y = (*list)[i + 1];
        (*list)[i + 1] = (*list)[i + 2];
        (*list)[i + 2] = y == 0.0f ? 0.0f : -y;
      }
      CONSAC_RETURN_IF_ERROR(file->Write(std::as_bytes(std::span<const float>(*list))));
    }
    CONSAC_RETURN_IF_ERROR(file->Write(std::as_bytes(std::span<const std::uint32_t>(mesh.indices))));
  }
  return {};
}

}  // namespace

Status WriteGlb(const Scene& scene, const LoadGeometry& load, const std::string& path) {
  Looks looks(scene);
  Json accessors = Json::array(), views = Json::array();
  const std::size_t numbers = DescribeNumbers(scene, &looks, &accessors, &views);
  Json json;
  json["asset"] = {{"version", "2.0"}, {"generator", std::string("consac ") + kVersion}};
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"name", scene.robot.name}, {"nodes", Json::array({0})}}});
  json["nodes"] = NodesOf(scene, &looks);
  if (numbers > 0) {  // an empty list is no glTF
    json["meshes"] = std::move(looks.meshes);
    json["materials"] = looks.Materials();
    json["accessors"] = std::move(accessors);
    json["bufferViews"] = std::move(views);
    json["buffers"] = Json::array({{{"byteLength", numbers}}});
  }
  std::string text = JsonText(json);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t total = 12 + 8 + text.size() + (numbers > 0 ? 8 + numbers : 0);
  if (total > 0xFFFFFFFFu)
    return {StatusCode::kResourceExhausted,
            "the meshes are " + std::to_string(total >> 20) + " MiB as glTF, which ends at 4096; simplify them"};
  std::vector<std::byte> head;
  PutWord(kGlbMagic, &head), PutWord(2, &head), PutWord(static_cast<std::uint32_t>(total), &head);
  PutWord(static_cast<std::uint32_t>(text.size()), &head), PutWord(kJsonChunk, &head);
  AtomicFile file;
  CONSAC_RETURN_IF_ERROR(file.Open(path));
  CONSAC_RETURN_IF_ERROR(file.Write(head));
  CONSAC_RETURN_IF_ERROR(file.Write(std::as_bytes(std::span<const char>(text))));
  if (numbers > 0) {
    head.clear();
    PutWord(static_cast<std::uint32_t>(numbers), &head), PutWord(kBinaryChunk, &head);
    CONSAC_RETURN_IF_ERROR(file.Write(head));
    CONSAC_RETURN_IF_ERROR(WriteNumbers(scene, load, &file));
  }
  return file.Commit();
}

}  // namespace consac::twin
