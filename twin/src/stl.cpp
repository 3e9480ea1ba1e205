// STL in and out.
#include <cmath>
#include <cstring>

#include "consac/base/text.h"
#include "consac/twin/mesh.h"
#include "pieces.h"
#include "triangles.h"

namespace consac::twin {
namespace {

constexpr std::size_t kStlHeader = 84, kStlTriangle = 50;  // bytes

std::uint32_t ReadU32(const std::byte* at) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | std::to_integer<std::uint32_t>(at[i]);
  return value;
}

void PutU32(std::uint32_t value, std::byte* at) {
  for (int i = 0; i < 4; ++i) at[i] = static_cast<std::byte>(value >> (8 * i));
}

Status TooMany(const std::string& triangles) {
  return {StatusCode::kResourceExhausted,
          "it has " + triangles + " triangles; at most " + std::to_string(kMostTriangles) + " are read"};
}

Result<Triangles> ReadBinaryStl(std::span<const std::byte> bytes) {
  const std::size_t count = ReadU32(bytes.data() + 80);
  Triangles triangles;
  triangles.corners.reserve(9 * count);
  for (std::size_t t = 0; t < count; ++t) {
    float corners[9];
    for (std::size_t i = 0; i < 9; ++i) {
      const std::uint32_t bits = ReadU32(bytes.data() + kStlHeader + kStlTriangle * t + 12 + 4 * i);
      std::memcpy(&corners[i], &bits, sizeof bits);
      if (!(std::abs(corners[i]) <= 1e9f))
        return Status{StatusCode::kDataLoss, "its triangle " + std::to_string(t) + " has a corner at " +
                                                 NumberText(static_cast<double>(corners[i]))};
    }
    AddTriangle(corners, &triangles.corners);
  }
  return triangles;
}

Result<Triangles> ReadTextStl(std::string_view text) {
  Triangles triangles;
  float corners[9];
  std::size_t have = 0, line = 1;
  bool ended = false;
  while (!text.empty()) {
    std::string_view row = NextLine(&text);
    const std::string_view word = NextPiece(&row);
    if (!word.empty()) ended = word == "endsolid";
    if (word == "outer") have = 0;
    if (word == "vertex") {
      for (int i = 0; i < 3; ++i) {
        double value = 0.0;
        if (have >= 9 || !ParseNumber(NextPiece(&row), &value) || std::abs(value) > 1e9)
          return Status{StatusCode::kDataLoss,
                        "line " + std::to_string(line) + ": a vertex of three numbers is expected"};
        corners[have++] = static_cast<float>(value);
      }
    }
    if (word == "endloop") {
      if (have != 9)
        return Status{StatusCode::kDataLoss,
                      "line " + std::to_string(line) + ": a facet of three vertices is expected"};
      if (triangles.count() >= kMostTriangles) return TooMany("more than " + std::to_string(kMostTriangles));
      AddTriangle(corners, &triangles.corners);
      have = 0;
    }
    ++line;
  }
  if (have != 0) return Status{StatusCode::kDataLoss, "it ends in the middle of a facet"};
  if (!ended) return Status{StatusCode::kDataLoss, "it is cut: its last line is not 'endsolid'"};
  return triangles;
}

}  // namespace

Result<Triangles> ReadStl(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t count = bytes.size() >= kStlHeader ? ReadU32(bytes.data() + 80) : 0;
  const bool whole = bytes.size() >= kStlHeader && bytes.size() == kStlHeader + kStlTriangle * count;
  if (!whole && !text.starts_with("solid"))
    return Status{StatusCode::kDataLoss, "it is no STL, or is cut: " + std::to_string(count) + " triangles would be " +
                                             std::to_string(kStlHeader + kStlTriangle * count) + " bytes, there are " +
                                             std::to_string(bytes.size())};
  if (whole && count > kMostTriangles) return TooMany(std::to_string(count));
  Result<Triangles> triangles = whole ? ReadBinaryStl(bytes) : ReadTextStl(text);
  if (triangles.ok()) triangles->parts = {{0, triangles->count(), std::nullopt}};
  return triangles;
}

std::vector<std::byte> WriteStl(const Triangles& triangles) {
  std::vector<std::byte> bytes(kStlHeader + kStlTriangle * triangles.count());
  constexpr std::string_view kTitle = "binary STL by consac";  // must not begin with "solid"
  std::memcpy(bytes.data(), kTitle.data(), kTitle.size());
  PutU32(static_cast<std::uint32_t>(triangles.count()), bytes.data() + 80);
  for (std::size_t t = 0; t < triangles.count(); ++t) {
    for (std::size_t i = 0; i < 9; ++i) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &triangles.corners[9 * t + i], sizeof bits);
      PutU32(bits, bytes.data() + kStlHeader + kStlTriangle * t + 12 + 4 * i);
    }
  }
  return bytes;
}

}  // namespace consac::twin
