#include "cli/twin_picture.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/text.h"

namespace consac::cli {
namespace {

using robot::Vector3;
using Json = nlohmann::json;

constexpr int kSamples = 2;         // of a pixel, each way: edges without steps
constexpr std::size_t kBegin = 20;  // of a GLB's JSON
constexpr float kAmbient = 0.30f, kLit = 0.80f;
constexpr float kBackground[2][3] = {{0.93f, 0.95f, 0.97f}, {0.72f, 0.77f, 0.83f}};  // top, bottom; linear
constexpr int kBallRows = 12;

// What glTF writes as (x, z, -y) is (x, y, z) here.
Vector3 OfGltf(const float* from) {
  return {static_cast<double>(from[0]), -static_cast<double>(from[2]), static_cast<double>(from[1])};
}

// A number of the scene's JSON; `otherwise` where it is not there.
double NumberOf(const Json& json, const char* name, double otherwise) {
  return json.contains(name) && json[name].is_number() ? json[name].get<double>() : otherwise;
}

// The whole scene, and the bytes behind it.
struct Scene {
  Json json;
  std::span<const std::byte> bytes;

  const Json* Row(const char* list, double number) const {
    if (!json.contains(list) || !json[list].is_array() || !(number >= 0) ||
        number >= static_cast<double>(json[list].size()))
      return nullptr;
    return &json[list][static_cast<std::size_t>(number)];
  }
  // Elements of an accessor, `size` bytes each; empty where they do not lie in the file.
  std::span<const std::byte> Elements(double accessor, std::size_t size) const {
    const Json* row = Row("accessors", accessor);
    const Json* view = row == nullptr ? nullptr : Row("bufferViews", NumberOf(*row, "bufferView", -1));
    if (view == nullptr) return {};
    const double from = NumberOf(*view, "byteOffset", 0) + NumberOf(*row, "byteOffset", 0);
    const double length = NumberOf(*row, "count", 0) * static_cast<double>(size);
    if (!(from >= 0 && length > 0 && from + length <= static_cast<double>(bytes.size()))) return {};
    return bytes.subspan(static_cast<std::size_t>(from), static_cast<std::size_t>(length));
  }
};

robot::Transform PlaceOf(const Json& node) {
  robot::Transform place;
  const auto numbers = [&](const char* name, std::size_t count, float* out) {
    if (!node.contains(name) || !node[name].is_array() || node[name].size() != count) return false;
    for (std::size_t i = 0; i < count; ++i) out[i] = node[name][i].is_number() ? node[name][i].get<float>() : 0.0f;
    return true;
  };
  float shift[3], turn[4];
  if (numbers("translation", 3, shift)) place.position = OfGltf(shift);
  if (numbers("rotation", 4, turn)) {
    const Vector3 axis = OfGltf(turn);
    place.rotation = robot::Normalised({axis.x, axis.y, axis.z, static_cast<double>(turn[3])});
  }
  return place;
}

std::vector<Vector3> PointsOf(std::span<const std::byte> elements) {
  std::vector<Vector3> points(elements.size() / (3 * sizeof(float)));
  for (std::size_t i = 0; i < points.size(); ++i) {
    float raw[3];
    std::memcpy(raw, elements.data() + i * sizeof(raw), sizeof(raw));
    points[i] = OfGltf(raw);
  }
  return points;
}

// A canvas of samples with their depth.
class Canvas {
 public:
  Canvas(int side, const PictureCamera& camera)
      : side_(side * kSamples), eye_(camera.eye), scale_(static_cast<double>(side_) / camera.width) {
    const auto count = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
    depth_.assign(count, std::numeric_limits<float>::infinity());
    colour_.resize(3 * count);
    for (std::size_t i = 0; i < count; ++i) {
      const float down = static_cast<float>(i / static_cast<std::size_t>(side_)) / static_cast<float>(side_);
      for (std::size_t c = 0; c < 3; ++c)
        colour_[3 * i + c] = kBackground[0][c] + down * (kBackground[1][c] - kBackground[0][c]);
    }
    const Vector3 way = camera.at - camera.eye;
    ahead_ = (1.0 / Norm(way)) * way;
    const Vector3 side_way = Cross(ahead_, {0, 0, 1});
    right_ = (1.0 / Norm(side_way)) * side_way;
    down_ = Cross(ahead_, right_);
    const Vector3 light = Vector3{0.2, -0.3, 1.0} - 0.7 * ahead_;
    light_ = (1.0 / Norm(light)) * light;
  }

  void Triangle(const Vector3 (&points)[3], const Vector3 (&normals)[3], const std::array<float, 3>& colour) {
    double x[3], y[3], z[3];
    float shade[3];
    for (int i = 0; i < 3; ++i) {
      const Vector3 from = points[i] - eye_;
      z[i] = Dot(from, ahead_);
      if (z[i] < 0.05) return;  // m: behind the eye, or in it
      x[i] = 0.5 * side_ + scale_ * Dot(from, right_) / z[i];
      y[i] = 0.5 * side_ + scale_ * Dot(from, down_) / z[i];
      shade[i] = kAmbient + kLit * static_cast<float>(std::max(0.0, Dot(normals[i], light_)));
    }
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (std::abs(area) < 1e-12) return;
    const auto within = [&](double value) { return static_cast<int>(std::clamp(value, 0.0, side_ - 1.0)); };
    const int left = within(std::ceil(std::min({x[0], x[1], x[2]}) - 0.5)),
              right = within(std::max({x[0], x[1], x[2]}));
    const int top = within(std::ceil(std::min({y[0], y[1], y[2]}) - 0.5)),
              bottom = within(std::max({y[0], y[1], y[2]}));
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        const double px = column + 0.5, py = row + 0.5;
        const double b = ((px - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (py - y[0])) / area;
        const double c = ((x[1] - x[0]) * (py - y[0]) - (px - x[0]) * (y[1] - y[0])) / area;
        const double a = 1.0 - b - c;
        if (a < 0.0 || b < 0.0 || c < 0.0) continue;
        const auto depth = static_cast<float>(1.0 / (a / z[0] + b / z[1] + c / z[2]));
        const std::size_t at =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(column);
        if (depth >= depth_[at]) continue;
        depth_[at] = depth;
        const float light =
            static_cast<float>(a) * shade[0] + static_cast<float>(b) * shade[1] + static_cast<float>(c) * shade[2];
        for (std::size_t i = 0; i < 3; ++i) colour_[3 * at + i] = std::min(1.0f, light * colour[i]);
      }
    }
  }

  void Ball(const PictureBall& ball) {
    const auto point = [&](int row, int column) {
      const double up = robot::kPiRadians * row / kBallRows, around = robot::kPiRadians * column / kBallRows;
      return Vector3{std::sin(up) * std::cos(around), std::sin(up) * std::sin(around), std::cos(up)};
    };
    for (int row = 0; row < kBallRows; ++row) {
      for (int column = 0; column < 2 * kBallRows; ++column) {
        const Vector3 a = point(row, column), b = point(row + 1, column), c = point(row + 1, column + 1),
                      d = point(row, column + 1);
        const auto at = [&](Vector3 way) { return ball.at + ball.radius * way; };
        Triangle({at(a), at(b), at(c)}, {a, b, c}, ball.colour);
        Triangle({at(a), at(c), at(d)}, {a, c, d}, ball.colour);
      }
    }
  }

  // sRGB, [side, side, 3].
  std::vector<std::uint8_t> Pixels() const {
    const int side = side_ / kSamples;
    std::vector<std::uint8_t> pixels;
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        for (std::size_t c = 0; c < 3; ++c) {
          float sum = 0.0f;
          for (int s = 0; s < kSamples * kSamples; ++s) {
            const int at = (row * kSamples + s / kSamples) * side_ + column * kSamples + s % kSamples;
            sum += colour_[3 * static_cast<std::size_t>(at) + c];
          }
          const float linear = sum / (kSamples * kSamples);
          const float display =
              linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
          pixels.push_back(static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(display, 0.0f, 1.0f))));
        }
      }
    }
    return pixels;
  }

 private:
  int side_;
  Vector3 eye_, ahead_, right_, down_, light_;
  double scale_;
  std::vector<float> depth_, colour_;
};

cairo_status_t AppendTo(void* bytes, const unsigned char* data, unsigned int count) {
  const auto* first = reinterpret_cast<const std::byte*>(data);
  auto* all = static_cast<std::vector<std::byte>*>(bytes);
  all->insert(all->end(), first, first + count);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

Result<TwinPicture> TwinPicture::Read(const robot::Robot& robot, std::span<const std::byte> glb) {
  const Status no{StatusCode::kDataLoss, "twin.glb is not what `consac twin import` writes; import the robot anew"};
  std::uint32_t length = 0;
  if (glb.size() < kBegin) return no;
  std::memcpy(&length, glb.data() + 12, sizeof(length));
  if (length > glb.size() - kBegin || glb.size() - kBegin - length < 8) return no;
  const Result<Json> json = ReadJson<Json>({reinterpret_cast<const char*>(glb.data()) + kBegin, length}, {});
  if (!json.ok() || !json->is_object() || !json->contains("nodes") || !(*json)["nodes"].is_array()) return no;
  const Scene scene{*json, glb.subspan(kBegin + length + 8)};
  TwinPicture picture(robot);
  for (std::size_t link = 0; link < robot.links.size(); ++link) {
    const Json* node = scene.Row("nodes", 2.0 * static_cast<double>(link));  // robot::NodeNames says how they count
    if (node == nullptr) return no;
    if (!node->contains("children")) continue;
    for (const Json& child : (*node)["children"]) {
      const Json* held = scene.Row("nodes", child.is_number() ? child.get<double>() : -1.0);
      if (held == nullptr || !held->contains("mesh")) continue;
      const Json* mesh = scene.Row("meshes", NumberOf(*held, "mesh", -1));
      if (mesh == nullptr || !mesh->contains("primitives")) return no;
      const robot::Transform place = PlaceOf(*held);
      for (const Json& primitive : (*mesh)["primitives"]) {
        if (!primitive.is_object() || !primitive.contains("attributes")) return no;
        const Json& attributes = primitive["attributes"];
        Part part;
        part.link = static_cast<std::int32_t>(link);
        part.points = PointsOf(scene.Elements(NumberOf(attributes, "POSITION", -1), 12));
        part.normals = PointsOf(scene.Elements(NumberOf(attributes, "NORMAL", -1), 12));
        for (Vector3& point : part.points) point = place * point;
        for (Vector3& normal : part.normals) normal = Rotate(place.rotation, normal);
        const std::span<const std::byte> corners = scene.Elements(NumberOf(primitive, "indices", -1), 4);
        part.corners.resize(corners.size() / 12 * 3);
        std::memcpy(part.corners.data(), corners.data(), part.corners.size() * 4);
        if (part.normals.size() != part.points.size() ||
            std::any_of(part.corners.begin(), part.corners.end(), [&](auto i) { return i >= part.points.size(); }))
          return no;
        part.colour = {0.6f, 0.6f, 0.6f};
        const Json* material = scene.Row("materials", NumberOf(primitive, "material", -1));
        const Json::json_pointer at("/pbrMetallicRoughness/baseColorFactor");
        if (material != nullptr && material->contains(at) && (*material)[at].is_array() &&
            (*material)[at].size() == 4) {
          for (std::size_t i = 0; i < 3; ++i) part.colour[i] = (*material)[at][i].get<float>();
        }
        picture.parts_.push_back(std::move(part));
      }
    }
  }
  return picture;
}

std::size_t TwinPicture::triangles() const {
  std::size_t count = 0;
  for (const Part& part : parts_) count += part.corners.size() / 3;
  return count;
}

std::vector<std::uint8_t> TwinPicture::Draw(const PictureFrame& frame, int side, const PictureCamera& camera) const {
  Canvas canvas(side, camera);
  robot::Kinematics kinematics(*robot_);
  kinematics.Forward(frame.positions);
  std::vector<Vector3> points, normals;
  for (const Part& part : parts_) {
    const robot::Transform at = kinematics.links()[static_cast<std::size_t>(part.link)];
    points.clear(), normals.clear();
    for (const Vector3& point : part.points) points.push_back(at * point);
    for (const Vector3& normal : part.normals) normals.push_back(Rotate(at.rotation, normal));
    for (std::size_t i = 0; i < part.corners.size(); i += 3) {
      const std::uint32_t a = part.corners[i], b = part.corners[i + 1], c = part.corners[i + 2];
      canvas.Triangle({points[a], points[b], points[c]}, {normals[a], normals[b], normals[c]}, part.colour);
    }
  }
  for (const PictureBall& ball : frame.balls) canvas.Ball(ball);
  return canvas.Pixels();
}

Status TwinPicture::WriteStrip(const std::string& path, std::span<const PictureFrame> frames, int columns, int side,
                               const PictureCamera& camera) const {
  const int count = static_cast<int>(frames.size()), rows = (count + columns - 1) / columns;
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, columns * side, rows * side), cairo_surface_destroy);
  if (cairo_surface_status(surface.get()) == CAIRO_STATUS_SUCCESS) {
    unsigned char* pixels = cairo_image_surface_get_data(surface.get());
    const int stride = cairo_image_surface_get_stride(surface.get());
    for (int i = 0; i < count; ++i) {
      const std::vector<std::uint8_t> drawn = Draw(frames[static_cast<std::size_t>(i)], side, camera);
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          const std::uint8_t* from = drawn.data() + 3 * (y * side + x);
          const std::uint32_t pixel = std::uint32_t{from[0]} << 16 | std::uint32_t{from[1]} << 8 | from[2];
          std::memcpy(pixels + (i / columns * side + y) * stride + 4 * (i % columns * side + x), &pixel, 4);
        }
      }
    }
    cairo_surface_mark_dirty(surface.get());
  }
  std::vector<std::byte> png;
  const cairo_status_t encoded = cairo_surface_write_to_png_stream(surface.get(), AppendTo, &png);
  if (encoded != CAIRO_STATUS_SUCCESS)
    return {StatusCode::kInternal, "cannot draw " + Quote(path) + ": " + cairo_status_to_string(encoded)};
  return WriteFileAtomically(path, png);
}

}  // namespace consac::cli
