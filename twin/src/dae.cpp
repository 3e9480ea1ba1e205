// Collada in: triangles, polylists and polygons of the visual scene, in metres, with the diffuse colour of each
// material. Axes stay as they are: ROS looks at no <up_axis>, and robots are drawn for it. Source: COLLADA 1.4.1.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "consac/base/text.h"
#include "consac/twin/mesh.h"
#include "matrix.h"
#include "pieces.h"
#include "triangles.h"
#include "xml.h"

namespace consac::twin {
namespace {

constexpr int kMostNesting = 32;               // of library nodes in each other
constexpr std::size_t kMostLooks = 2'000'000;  // at elements of the scene, each time they are shown

// Numbers between blanks; false where one is none.
bool ReadNumbers(std::string_view text, std::vector<double>* numbers) {
  for (std::string_view piece = NextPiece(&text); !piece.empty(); piece = NextPiece(&text)) {
    double number = 0.0;
    if (!ParseNumber(piece, &number) || std::abs(number) > 1e9) return false;
    numbers->push_back(number);
  }
  return true;
}

// The faces of a primitive: read once, however often it is shown.
struct Faces {
  const std::vector<double>* points = nullptr;  // [P, 3]
  std::vector<std::uint32_t> corners;           // of all faces, numbers of points
  std::vector<std::uint32_t> sizes;             // [F] how many of them
  std::size_t triangles = 0;                    // at most
};

class DaeReader {
 public:
  explicit DaeReader(std::string_view text) : xml_(text) {}

  Result<Triangles> Read() {
    if (!xml_.status().ok()) return xml_.status();
    const pugi::xml_node root = xml_.root();
    if (std::strcmp(root.name(), "COLLADA") != 0) return xml_.Wrong(root, "a Collada file begins with <COLLADA>");
    const double metre = xml_.Number(root.child("asset").child("unit"), "meter", 1.0);
    if (!(metre > 0.0) || metre > 1e6) return xml_.Wrong(root, "its unit is no length");
    CollectIds(root);
    const Matrix unit = {metre, 0, 0, 0, 0, metre, 0, 0, 0, 0, metre, 0};
    for (const pugi::xml_node scene : root.child("library_visual_scenes").children("visual_scene")) {
      for (const pugi::xml_node node : scene.children("node")) ReadNode(node, unit, 0);
    }
    if (!xml_.status().ok()) return xml_.status();
    return std::move(triangles_);
  }

 private:
  // Elements with an id, wherever they are.
  void CollectIds(pugi::xml_node node) {
    for (const pugi::xml_node child : node.children()) {
      if (child.attribute("id")) ids_.emplace(child.attribute("id").value(), child);
      CollectIds(child);
    }
  }

  pugi::xml_node Find(const char* reference) const {
    const auto found = ids_.find(reference[0] == '#' ? reference + 1 : reference);
    return found == ids_.end() ? pugi::xml_node() : found->second;
  }

  bool Fill(pugi::xml_node node, std::size_t count, std::vector<double>* numbers) {
    if (ReadNumbers(node.child_value(), numbers) && numbers->size() == count) return true;
    xml_.Refuse(node, "<" + std::string(node.name()) + "> must hold " + std::to_string(count) + " numbers");
    return false;
  }

  Matrix Motion(pugi::xml_node step) {
    const std::string_view name = step.name();
    std::vector<double> n;
    Matrix motion = kIdentity;
    if (name == "matrix" && Fill(step, 16, &n)) std::copy(n.begin(), n.begin() + 12, motion.begin());
    if (name == "translate" && Fill(step, 3, &n)) motion[3] = n[0], motion[7] = n[1], motion[11] = n[2];
    if (name == "scale" && Fill(step, 3, &n)) motion[0] = n[0], motion[5] = n[1], motion[10] = n[2];
    if (name == "rotate" && Fill(step, 4, &n)) {
      const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      if (!(length > 0.0)) return motion;
      const robot::Vector3 axis{n[0] / length, n[1] / length, n[2] / length};
      const auto m = robot::MatrixOf(robot::RotationAbout(axis, n[3] * robot::kPiRadians / 180.0));
      motion = {m[0], m[1], m[2], 0, m[3], m[4], m[5], 0, m[6], m[7], m[8], 0};
    }
    return motion;
  }

  // False once something is wrong, or elements of the file are shown so often that it takes its time.
  bool MayLook(pugi::xml_node node) {
    if (++looks_ > kMostLooks) xml_.Refuse(node, "its scene has nodes that hold each other, or shows too much");
    return xml_.status().ok();
  }

  void ReadNode(pugi::xml_node node, Matrix at, int nesting) {
    if (!xml_.status().ok()) return;
    if (nesting > kMostNesting) return xml_.Refuse(node, "its scene has nodes that hold each other");
    for (const pugi::xml_node child : node.children()) {
      const std::string_view name = child.name();
      at = at * Motion(child);
      if (!MayLook(child)) return;
      if (name == "instance_geometry") ReadGeometry(child, at);
      if (name == "node") ReadNode(child, at, nesting + 1);
      if (name == "instance_node") ReadNode(Find(child.attribute("url").value()), at, nesting + 1);
    }
  }

  std::optional<Colour> ColourOf(pugi::xml_node instance, std::string_view symbol) {
    for (const pugi::xml_node bound :
         instance.child("bind_material").child("technique_common").children("instance_material")) {
      if (!MayLook(bound)) return std::nullopt;
      if (symbol != bound.attribute("symbol").value()) continue;
      const pugi::xml_node material = Find(bound.attribute("target").value());
      const pugi::xml_node effect = Find(material.child("instance_effect").attribute("url").value());
      for (const pugi::xml_node shading : effect.child("profile_COMMON").child("technique").children()) {
        std::vector<double> n;
        const pugi::xml_node colour = shading.child("diffuse").child("color");
        if (!colour || !ReadNumbers(colour.child_value(), &n) || n.size() < 3) continue;
        Colour out = kDefaultColour;
        for (std::size_t i = 0; i < 4 && i < n.size(); ++i) out[i] = std::clamp(n[i], 0.0, 1.0);
        return out;
      }
    }
    return std::nullopt;
  }

  // The points that a primitive's vertices are of, and where in its <p> they are; none where it names no usable ones.
  const std::vector<double>* PointsOf(pugi::xml_node primitive, std::size_t* offset, std::size_t* stride) {
    const char* source = "";
    *stride = 1;
    for (const pugi::xml_node input : primitive.children("input")) {
      const double at = xml_.Number(input, "offset", 0.0);
      if (!(at >= 0.0) || at > 64.0) return nullptr;
      *stride = std::max(*stride, static_cast<std::size_t>(at) + 1);
      if (std::strcmp(input.attribute("semantic").value(), "VERTEX") != 0) continue;
      *offset = static_cast<std::size_t>(at);
      for (const pugi::xml_node position : Find(input.attribute("source").value()).children("input")) {
        if (std::strcmp(position.attribute("semantic").value(), "POSITION") == 0)
          source = position.attribute("source").value();
      }
    }
    const pugi::xml_node list = Find(source).child("float_array");
    if (!list) return nullptr;
    const auto [known, is_new] = points_.emplace(list, std::vector<double>());
    if (!is_new) return &known->second;
    return ReadNumbers(list.child_value(), &known->second) && known->second.size() % 3 == 0 ? &known->second : nullptr;
  }

  // Refuses what does not fit.
  Faces ReadFaces(pugi::xml_node primitive) {
    const std::string_view name = primitive.name();
    Faces faces;
    std::vector<double> sizes;
    std::size_t offset = 0, stride = 1;
    faces.points = PointsOf(primitive, &offset, &stride);
    if (faces.points == nullptr || !ReadNumbers(primitive.child("vcount").child_value(), &sizes)) {
      xml_.Refuse(primitive, "<" + std::string(name) + "> names no usable positions");
      return faces;
    }
    for (const pugi::xml_node list : primitive.children("p")) {
      std::vector<double> numbers;
      bool fits = ReadNumbers(list.child_value(), &numbers);
      const std::size_t corners = numbers.size() / stride;
      for (std::size_t corner = 0; fits && corner < corners; ++corner) {
        const double number = numbers[corner * stride + offset];
        fits = number >= 0.0 && number < static_cast<double>(faces.points->size() / 3);
        if (fits) faces.corners.push_back(static_cast<std::uint32_t>(number));
      }
      for (std::size_t first = 0; fits && first < corners;) {
        double size = name == "triangles" ? 3.0 : static_cast<double>(corners);
        if (name == "polylist") size = faces.sizes.size() < sizes.size() ? sizes[faces.sizes.size()] : 0.0;
        fits = size >= 1.0 && size <= static_cast<double>(corners - first);
        if (!fits) break;
        faces.sizes.push_back(static_cast<std::uint32_t>(size));
        faces.triangles += std::max(faces.sizes.back(), 3u) - 2;
        first += faces.sizes.back();
      }
      if (!fits) {
        xml_.Refuse(list, "<p> does not fit its <" + std::string(name) + ">");
        return faces;
      }
    }
    return faces;
  }

  void ReadGeometry(pugi::xml_node instance, const Matrix& at) {
    const pugi::xml_node mesh = Find(instance.attribute("url").value()).child("mesh");
    for (const pugi::xml_node primitive : mesh.children()) {
      if (!MayLook(primitive)) return;
      const std::string_view name = primitive.name();
      if (name != "triangles" && name != "polylist" && name != "polygons") continue;
      auto known = faces_.find(primitive);
      if (known == faces_.end()) known = faces_.emplace(primitive, ReadFaces(primitive)).first;
      if (!xml_.status().ok()) return;
      MeshPart part{triangles_.count(), 0, ColourOf(instance, primitive.attribute("material").value())};
      if (!AddFaces(known->second, at))
        return xml_.Refuse(instance, "what it shows has more than " + std::to_string(kMostTriangles) +
                                         " triangles, or is further than 1e9 m away");
      part.count = triangles_.count() - part.first;
      if (part.count > 0) triangles_.parts.push_back(part);
    }
  }

  // Adds them where `at` brings them; false where that is too far or too many.
  bool AddFaces(const Faces& faces, const Matrix& at) {
    // Triangles without an area count too: they leave nothing, but take their time.
    shown_ += faces.triangles;
    if (shown_ > kMostTriangles) return false;
    const bool mirrored = IsMirror(at);
    const auto corner = [&](std::uint32_t number, float* out) {
      return PlaceCorner(at, &(*faces.points)[3 * std::size_t{number}], out);
    };
    const std::uint32_t* face = faces.corners.data();
    for (const std::uint32_t size : faces.sizes) {
      for (std::uint32_t i = 2; i < size; ++i) {
        float corners[9];
        if (!corner(face[0], corners) || !corner(face[mirrored ? i : i - 1], corners + 3) ||
            !corner(face[mirrored ? i - 1 : i], corners + 6))
          return false;
        AddTriangle(corners, &triangles_.corners);
      }
      face += size;
    }
    return true;
  }

  XmlReader xml_;
  std::map<std::string, pugi::xml_node, std::less<>> ids_;
  std::map<pugi::xml_node, std::vector<double>> points_;  // of <float_array>
  std::map<pugi::xml_node, Faces> faces_;                 // of primitives
  std::size_t looks_ = 0, shown_ = 0;                     // at elements; triangles
  Triangles triangles_;
};

}  // namespace

Result<Triangles> ReadDae(std::string_view text) {
  return DaeReader(text).Read();
}

}  // namespace consac::twin
