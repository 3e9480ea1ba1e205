// STL in and out.
#include <cmath>
#include <cstring>

#include "consac/base/text.h"
#include "consac/twin/mesh.h"
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
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view row = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const auto piece = [&] {
      while (!row.empty() && (row[0] == ' ' || row[0] == '\t' || row[0] == '\r')) row.remove_prefix(1);
      const std::string_view next = row.substr(0, std::min(row.find_first_of(" \t\r"), row.size()));
      row.remove_prefix(next.size());
      return next;
    };
    const std::string_view word = piece();
    if (word == "outer") have = 0;
    if (word == "vertex") {
      for (int i = 0; i < 3; ++i) {
        const std::string_view number = piece();
        double value = 0.0;
        if (have >= 9 || !ParseNumber(number.substr(number.starts_with('+') ? 1 : 0), &value) || std::abs(value) > 1e9)
          return Status{StatusCode::kDataLoss,
                        "line " + std::to_string(line) + ": a vertex of three numbers is expected"};
        corners[have++] = static_cast<float>(value);
      }
    }
    if (word == "endloop") {
      if (have != 9)
        return Status{StatusCode::kDataLoss,
                      "line " + std::to_string(line) + ": a facet of three vertices is expected"};
      AddTriangle(corners, &triangles.corners);
      have = 0;
    }
    ++line;
  }
  if (have != 0) return Status{StatusCode::kDataLoss, "it ends in the middle of a facet"};
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
  if (whole && count > kMostTriangles)
    return Status{StatusCode::kResourceExhausted, "it has " + std::to_string(count) + " triangles; at most " +
                                                      std::to_string(kMostTriangles) + " are read"};
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
