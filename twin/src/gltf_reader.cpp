// glTF 2.0 in: triangles of the scene, turned from y up to z up, with the colour factor of each material. Not read:
// textures, skins, animations, compressed meshes. For files that are not to be trusted: every number is looked at
// before anything is read by it. Source: Khronos, glTF 2.0, 3 and 4.4.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <list>
#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/robot/transform.h"
#include "consac/twin/mesh.h"
#include "glb_format.h"
#include "matrix.h"
#include "triangles.h"

namespace consac::twin {
namespace {

using GltfJson = nlohmann::json;

constexpr std::size_t kHeader = 12, kChunkHeader = 8;
constexpr std::size_t kMostShown = 1'000'000;                    // at primitives, each time a node shows them
constexpr int kMostHanging = 64;                                 // of nodes
constexpr Matrix kZUp = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0};   // (x, y, z) is (x, -z, y)
constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;      // modes of a primitive
constexpr std::size_t kByte = 5121, kShort = 5123, kInt = 5125;  // types of numbers, as kFloat

std::uint32_t WordAt(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
  return value;
}

double DisplayOf(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

// A run of numbers in a buffer, within it.
struct Numbers {
  const std::byte* first = nullptr;
  std::size_t count = 0, stride = 0, type = 0;
};

class GltfReader {
 public:
  explicit GltfReader(const GltfBuffer& buffer) : load_(buffer) {}

  Result<Triangles> Read(std::span<const std::byte> bytes) {
    std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (bytes.size() >= kHeader && WordAt(bytes, 0) == kGlbMagic) CONSAC_RETURN_IF_ERROR(OpenContainer(bytes, &text));
    Result<GltfJson> json = ReadJson<GltfJson>(text);
    if (!json.ok()) return Status(json.status().code(), "its JSON is " + json.status().message());
    json_ = std::move(*json);
    CONSAC_RETURN_IF_ERROR(CheckWhatItNeeds());
    CONSAC_RETURN_IF_ERROR(OpenBuffers());
    seen_.assign(List(json_, "nodes").size(), false);
    const GltfJson& scenes = List(json_, "scenes");
    const std::size_t scene = Whole(json_, "scene", 0);
    if (scene >= scenes.size()) Refuse("it has no scene " + std::to_string(scene));
    if (status_.ok()) ReadNodes(List(scenes[scene], "nodes"), kZUp, 0);
    if (!status_.ok()) return status_;
    return std::move(triangles_);
  }

 private:
  void Refuse(const std::string& what) {
    if (status_.ok()) status_ = {StatusCode::kDataLoss, what};
  }

  // Members of what may be anything; nothing where there is none.
  static const GltfJson& Member(const GltfJson& json, const char* name) {
    static const GltfJson kNothing;
    const auto found = json.is_object() ? json.find(name) : json.end();
    return json.is_object() && found != json.end() ? *found : kNothing;
  }
  // The same of a list.
  static const GltfJson& List(const GltfJson& json, const char* name) {
    static const GltfJson kEmpty = GltfJson::array();
    const GltfJson& list = Member(json, name);
    return list.is_array() ? list : kEmpty;
  }
  const GltfJson& At(const char* list, std::size_t number) {
    const GltfJson& all = List(json_, list);
    if (number < all.size() && all[number].is_object()) return all[number];
    Refuse("it names number " + std::to_string(number) + " of its " + list + ", which is not there");
    return Member(json_, "");
  }
  // A whole number from 0 on that stands for a count or a place.
  std::size_t Whole(const GltfJson& json, const char* name, std::size_t otherwise) {
    const GltfJson& value = Member(json, name);
    if (value.is_null()) return otherwise;
    if (value.is_number_unsigned() && value.get<std::uint64_t>() <= kMostMeshBytes)
      return static_cast<std::size_t>(value.get<std::uint64_t>());
    Refuse("its '" + std::string(name) + "' is no number from 0 to " + std::to_string(kMostMeshBytes));
    return otherwise;
  }
  // `count` numbers; false where there is no such member.
  bool Floats(const GltfJson& json, const char* name, std::size_t count, double* out) {
    const GltfJson& list = Member(json, name);
    if (list.is_null()) return false;
    bool fits = list.is_array() && list.size() == count;
    for (std::size_t i = 0; fits && i < count; ++i) {
      fits = list[i].is_number() && std::abs(list[i].get<double>()) <= 1e9;
      if (fits) out[i] = list[i].get<double>();
    }
    if (!fits) Refuse("its '" + std::string(name) + "' is no list of " + std::to_string(count) + " numbers up to 1e9");
    return fits;
  }

  Status OpenContainer(std::span<const std::byte> bytes, std::string_view* text) {
    const std::size_t length = WordAt(bytes, 8);
    if (WordAt(bytes, 4) != 2) return {StatusCode::kDataLoss, "it is no glTF of version 2"};
    if (length > bytes.size())
      return {StatusCode::kDataLoss,
              "it has " + std::to_string(bytes.size()) + " bytes and says " + std::to_string(length)};
    for (std::size_t at = kHeader, chunk = 0; at + kChunkHeader <= length; ++chunk) {
      const std::size_t size = WordAt(bytes, at);
      const std::uint32_t kind = WordAt(bytes, at + 4);
      at += kChunkHeader;
      if (size > length - at) return {StatusCode::kDataLoss, "its chunk " + std::to_string(chunk) + " is cut"};
      if ((chunk == 0) != (kind == kJsonChunk)) return {StatusCode::kDataLoss, "its first chunk alone must be JSON"};
      if (chunk == 0) *text = text->substr(at, size);
      if (kind == kBinaryChunk && chunk == 1) binary_ = bytes.subspan(at, size);
      at += size;
    }
    return {};
  }

  Status CheckWhatItNeeds() {
    if (Member(Member(json_, "asset"), "version") != "2.0")
      return {StatusCode::kDataLoss, "it is no glTF of version 2.0"};
    for (const GltfJson& each : List(json_, "extensionsRequired")) {
      const std::string name = each.is_string() ? each.get<std::string>() : "";
      if (name.starts_with("KHR_materials_") || name.starts_with("KHR_texture_") || name.starts_with("EXT_texture_"))
        continue;  // looks alone
      return {StatusCode::kInvalidArgument,
              "it needs " + Quote(name) + ", which is not read; export it without (no compression, no quantization)"};
    }
    return {};
  }

  Status OpenBuffers() {
    std::size_t sum = 0;
    for (const GltfJson& each : List(json_, "buffers")) {
      const std::size_t length = Whole(each, "byteLength", 0);
      const GltfJson& uri = Member(each, "uri");
      std::span<const std::byte> bytes = buffers_.empty() ? binary_ : std::span<const std::byte>();
      if (!uri.is_null()) {
        Result<std::vector<std::byte>> loaded =
            uri.is_string() ? load_(uri.get<std::string>()) : Status{StatusCode::kDataLoss, "its 'uri' is no text"};
        if (!loaded.ok()) return loaded.status();
        sum += loaded->size();
        if (sum > kMostMeshBytes) return {StatusCode::kResourceExhausted, "its buffers are more than 1 GiB"};
        bytes = owned_.emplace_back(std::move(*loaded));
      }
      if (bytes.size() < length)
        return {StatusCode::kDataLoss, "its buffer " + std::to_string(buffers_.size()) + " has " +
                                           std::to_string(bytes.size()) + " bytes and says " + std::to_string(length)};
      buffers_.push_back(bytes.subspan(0, length));
    }
    return status_;
  }

  void ReadNodes(const GltfJson& numbers, const Matrix& at, int nesting) {
    if (nesting > kMostHanging) return Refuse("its nodes hang more than " + std::to_string(kMostHanging) + " deep");
    for (const GltfJson& each : numbers) {
      if (!status_.ok()) return;
      if (!each.is_number_unsigned() || each.get<std::uint64_t>() >= seen_.size())
        return Refuse("a node names a child that is not there");
      const auto number = static_cast<std::size_t>(each.get<std::uint64_t>());
      if (seen_[number]) return Refuse("its node " + std::to_string(number) + " hangs on two others");
      seen_[number] = true;
      const GltfJson& node = At("nodes", number);
      const Matrix here = at * PlaceOf(node);
      if (!Member(node, "mesh").is_null()) ReadMesh(At("meshes", Whole(node, "mesh", 0)), here);
      ReadNodes(List(node, "children"), here, nesting + 1);
    }
  }

  Matrix PlaceOf(const GltfJson& node) {
    double m[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (Floats(node, "matrix", 16, m))
      return {m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14]};
    (void)Floats(node, "translation", 3, t);
    (void)Floats(node, "rotation", 4, q);
    (void)Floats(node, "scale", 3, s);
    const auto r = robot::MatrixOf(robot::Normalised({q[0], q[1], q[2], q[3]}));
    return {r[0] * s[0], r[1] * s[1], r[2] * s[2], t[0],        r[3] * s[0], r[4] * s[1],
            r[5] * s[2], t[1],        r[6] * s[0], r[7] * s[1], r[8] * s[2], t[2]};
  }

  std::optional<Colour> ColourOf(const GltfJson& primitive) {
    if (Member(primitive, "material").is_null()) return std::nullopt;
    double factor[4] = {1, 1, 1, 1};
    (void)Floats(Member(At("materials", Whole(primitive, "material", 0)), "pbrMetallicRoughness"), "baseColorFactor", 4,
                 factor);
    Colour colour{};
    for (std::size_t i = 0; i < 4; ++i) {
      const double value = std::clamp(factor[i], 0.0, 1.0);
      colour[i] = i < 3 ? DisplayOf(value) : value;
    }
    return colour;
  }

  // The numbers of an accessor, `width` of them at a time.
  Numbers NumbersOf(const GltfJson& primitive, const char* name, const char* type, std::size_t width) {
    const GltfJson& accessor = At("accessors", Whole(primitive, name, 0));
    Numbers out{nullptr, Whole(accessor, "count", 0), 0, Whole(accessor, "componentType", 0)};
    const std::size_t bytes = out.type == kByte ? 1 : out.type == kShort ? 2 : 4;
    const bool known = width == 3 ? out.type == kFloat : out.type == kByte || out.type == kShort || out.type == kInt;
    if (!known || Member(accessor, "type") != type || !Member(accessor, "sparse").is_null() ||
        Member(accessor, "bufferView").is_null()) {
      Refuse("its '" + std::string(name) + "' are no plain " + (width == 3 ? "floats" : "whole numbers"));
      return {};
    }
    const GltfJson& view = At("bufferViews", Whole(accessor, "bufferView", 0));
    const std::size_t buffer = Whole(view, "buffer", 0), from = Whole(view, "byteOffset", 0),
                      length = Whole(view, "byteLength", 0), first = Whole(accessor, "byteOffset", 0);
    out.stride = Whole(view, "byteStride", width * bytes);
    // Each number is 1 GiB at most, so that neither sums nor products overflow 64 bits.
    const std::uint64_t end =
        out.count == 0 ? 0 : std::uint64_t{first} + std::uint64_t{out.stride} * (out.count - 1) + width * bytes;
    if (buffer >= buffers_.size() || std::uint64_t{from} + length > buffers_[buffer].size() || end > length ||
        out.stride < width * bytes) {
      Refuse("its '" + std::string(name) + "' are not within their buffer");
      return {};
    }
    out.first = buffers_[buffer].data() + from + first;
    return out;
  }

  void ReadMesh(const GltfJson& mesh, const Matrix& at) {
    for (const GltfJson& primitive : List(mesh, "primitives")) {
      const std::size_t mode = Whole(primitive, "mode", kTriangles);
      if (++looks_ > kMostShown) Refuse("its nodes show more than " + std::to_string(kMostShown) + " primitives");
      if (!status_.ok()) return;
      if (mode != kTriangles && mode != kStrip && mode != kFan) continue;  // points and lines
      const Numbers points = NumbersOf(Member(primitive, "attributes"), "POSITION", "VEC3", 3);
      const bool indexed = !Member(primitive, "indices").is_null();
      const Numbers indices = indexed ? NumbersOf(primitive, "indices", "SCALAR", 1) : Numbers{};
      MeshPart part{triangles_.count(), 0, ColourOf(primitive)};
      if (!status_.ok()) return;
      AddPrimitive(points, indexed ? &indices : nullptr, mode, at);
      part.count = triangles_.count() - part.first;
      if (part.count > 0) triangles_.parts.push_back(part);
    }
  }

  void AddPrimitive(const Numbers& points, const Numbers* indices, std::size_t mode, const Matrix& at) {
    const std::size_t corners = indices != nullptr ? indices->count : points.count;
    const std::size_t count = mode == kTriangles ? corners / 3 : corners < 3 ? 0 : corners - 2;
    // Triangles without an area count too: they leave nothing, but take their time.
    shown_ += count;
    if (shown_ > kMostTriangles) {
      status_ = {StatusCode::kResourceExhausted, "it shows more than " + std::to_string(kMostTriangles) + " triangles"};
      return;
    }
    const bool mirrored = IsMirror(at);
    const auto corner = [&](std::size_t number, float* out) {
      if (indices != nullptr) {
        std::uint32_t index = 0;
        const std::size_t bytes = indices->type == kByte ? 1 : indices->type == kShort ? 2 : 4;
        for (std::size_t i = bytes; i-- > 0;)
          index = index << 8 | std::to_integer<std::uint32_t>(indices->first[number * indices->stride + i]);
        number = index;
      }
      if (number >= points.count) return false;
      float point[3];
      std::memcpy(point, points.first + number * points.stride, sizeof point);
      return PlaceCorner(at, point, out);
    };
    for (std::size_t t = 0; t < count; ++t) {
      std::size_t a = mode == kTriangles ? 3 * t : mode == kFan ? 0 : t;
      std::size_t b = mode == kTriangles ? 3 * t + 1 : t + 1, c = mode == kTriangles ? 3 * t + 2 : t + 2;
      if (mirrored != (mode == kStrip && t % 2 == 1)) std::swap(b, c);
      float out[9];
      if (!corner(a, out) || !corner(b, out + 3) || !corner(c, out + 6))
        return Refuse("a triangle has a corner that is not there, or further than 1e9 m away");
      AddTriangle(out, &triangles_.corners);
    }
  }

  const GltfBuffer& load_;
  GltfJson json_;
  Status status_;
  std::span<const std::byte> binary_;
  std::list<std::vector<std::byte>> owned_;  // buffers that are not in the container
  std::vector<std::span<const std::byte>> buffers_;
  std::vector<bool> seen_;             // nodes
  std::size_t looks_ = 0, shown_ = 0;  // at primitives; triangles
  Triangles triangles_;
};

}  // namespace

Result<Triangles> ReadGltf(std::span<const std::byte> bytes, const GltfBuffer& buffer) {
  return GltfReader(buffer).Read(bytes);
}

Result<std::vector<std::byte>> GltfBase64(std::string_view uri) {
  constexpr std::string_view kMark = ";base64,";
  const std::size_t mark = uri.find(kMark);
  if (!uri.starts_with("data:") || mark == std::string_view::npos)
    return Status{StatusCode::kDataLoss, "its buffer " + Quote(uri) + " is no data in base64"};
  std::vector<std::byte> out;
  out.reserve((uri.size() - mark) * 3 / 4);
  std::uint32_t bits = 0;
  int have = 0;
  for (const char c : uri.substr(mark + kMark.size())) {
    if (c == '=') break;
    const std::uint32_t six = c >= 'A' && c <= 'Z'   ? static_cast<std::uint32_t>(c - 'A')
                              : c >= 'a' && c <= 'z' ? static_cast<std::uint32_t>(c - 'a' + 26)
                              : c >= '0' && c <= '9' ? static_cast<std::uint32_t>(c - '0' + 52)
                              : c == '+'             ? 62u
                              : c == '/'             ? 63u
                                                     : 64u;
    if (six > 63) return Status{StatusCode::kDataLoss, "its buffer's base64 has a character that is none"};
    bits = bits << 6 | six;
    have += 6;
    if (have >= 8) out.push_back(static_cast<std::byte>(bits >> (have -= 8)));
  }
  return out;
}

}  // namespace consac::twin
