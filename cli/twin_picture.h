#pragma once
// Draws a twin on the processor: the meshes of its twin.glb in a given pose, as an image or as a strip of them. For
// `consac demo yumi`; the viewer draws by WebGL.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "consac/base/status.h"
#include "consac/robot/kinematics.h"

namespace consac::cli {

/// A ball that is drawn with the robot.
struct PictureBall {
  robot::Vector3 at;  ///< m, in the base's frame
  double radius = 0.02;
  std::array<float, 3> colour{};  ///< linear, 0 to 1
};

/// One picture of a strip.
struct PictureFrame {
  std::vector<double> positions;  ///< [positions] of the robot, rad or m
  std::vector<PictureBall> balls;
};

/// From where it is looked at: perspective, z up.
struct PictureCamera {
  robot::Vector3 eye{1.45, -0.85, 0.95}, at{0.14, 0.02, 0.36};  ///< m, in the base's frame
  double width = 0.62;                                          ///< of the field of view at a distance of 1
};

/// The meshes of a twin, each on its link.
class TwinPicture {
 public:
  /// Of the twin.glb that `consac twin import` wrote for `robot`, which must outlive this. kDataLoss where it is not.
  static Result<TwinPicture> Read(const robot::Robot& robot, std::span<const std::byte> glb);
  /// Writes a PNG of `frames`, `columns` in a row, each `side` pixels wide and high.
  Status WriteStrip(const std::string& path, std::span<const PictureFrame> frames, int columns, int side,
                    const PictureCamera& camera) const;
  /// How many triangles a picture has.
  std::size_t triangles() const;

 private:
  struct Part {
    std::int32_t link = 0;
    std::array<float, 3> colour{};
    std::vector<robot::Vector3> points, normals;  // in the link's frame
    std::vector<std::uint32_t> corners;           // [triangles, 3]
  };

  explicit TwinPicture(const robot::Robot& robot) : robot_(&robot) {}
  std::vector<std::uint8_t> Draw(const PictureFrame& frame, int side, const PictureCamera& camera) const;

  const robot::Robot* robot_;
  std::vector<Part> parts_;
};

}  // namespace consac::cli
