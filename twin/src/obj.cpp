// Wavefront OBJ in: vertices and faces. Materials are in other files, which are not read.
#include <algorithm>
#include <array>
#include <cmath>

#include "consac/base/text.h"
#include "consac/twin/mesh.h"
#include "pieces.h"
#include "triangles.h"

namespace consac::twin {
namespace {

Status WrongLine(std::size_t line, const std::string& what) {
  return {StatusCode::kDataLoss, "line " + std::to_string(line) + ": " + what};
}

}  // namespace

Result<Triangles> ReadObj(std::string_view text) {
  std::vector<std::array<float, 3>> points;
  Triangles triangles;
  for (std::size_t line = 1; !text.empty(); ++line) {
    std::string_view row = NextLine(&text);
    const std::string_view word = NextPiece(&row);
    if (word == "v") {
      std::array<float, 3> point{};
      for (float& coordinate : point) {
        double value = 0.0;
        if (!ParseNumber(NextPiece(&row), &value) || std::abs(value) > 1e9)
          return WrongLine(line, "a vertex of three numbers is expected");
        coordinate = static_cast<float>(value);
      }
      points.push_back(point);
    }
    if (word != "f") continue;
    std::vector<std::size_t> corners;
    for (std::string_view corner = NextPiece(&row); !corner.empty(); corner = NextPiece(&row)) {
      std::int64_t number = 0;
      const auto count = static_cast<std::int64_t>(points.size());
      if (!ParseNumber(corner.substr(0, std::min(corner.find('/'), corner.size())), &number) || number == 0 ||
          number > count || number < -count)
        return WrongLine(line, "the face names the vertex " + Quote(corner) + "; there are " + std::to_string(count));
      corners.push_back(static_cast<std::size_t>(number > 0 ? number - 1 : count + number));
    }
    if (corners.size() < 3) return WrongLine(line, "a face needs three corners");
    if (triangles.count() + corners.size() > kMostTriangles)
      return Status{StatusCode::kResourceExhausted,
                    "it has more than " + std::to_string(kMostTriangles) + " triangles"};
    for (std::size_t i = 2; i < corners.size(); ++i) {
      const auto &a = points[corners[0]], &b = points[corners[i - 1]], &c = points[corners[i]];
      AddTriangle({a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]}, &triangles.corners);
    }
  }
  triangles.parts = {{0, triangles.count(), std::nullopt}};
  return triangles;
}

}  // namespace consac::twin
