#pragma once
// USD's text, line by line into a file. Knows blocks, names and values, nothing of robots. Private to twin. Source:
// openusd.org, the .usda format.

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "consac/base/file.h"
#include "consac/robot/transform.h"

namespace consac::twin {

/// Prims' names beside each other: letters, digits and '_', no two the same.
class UsdNames {
 public:
  /// A name like `wanted`; "_2" and so on at its end where there is one already.
  std::string Make(std::string_view wanted);

 private:
  std::set<std::string> used_;
};

/// `text` as a string of USD's.
std::string UsdQuoted(std::string_view text);
/// "(1, 2, 3)".
std::string UsdTuple(std::span<const double> numbers);
std::string UsdTuple(robot::Vector3 v);
/// "(w, x, y, z)".
std::string UsdQuaternion(const robot::Quaternion& q);

/// A file of lines. Errors are kept: End() tells the first.
class UsdFile {
 public:
  /// Begins it, with the stage's metadata.
  Status Begin(const std::string& path, std::string_view default_prim, std::string_view creator);
  /// `line`, as far in as blocks are open.
  void Line(std::string_view line);
  /// A prim: `head` is "def Xform", `metadata` are lines in its parentheses, parted by line ends; "" none.
  void Open(std::string_view head, std::string_view name, std::string_view metadata = {});
  /// The end of that prim.
  void Close();
  /// "float3[] name = [(0, 0, 0), ...]", `width` numbers each; 1 without parentheses.
  void Numbers(std::string_view declaration, std::span<const float> numbers, std::size_t width);
  /// The same of whole numbers.
  void Numbers(std::string_view declaration, std::span<const std::uint32_t> numbers);
  /// Where a prim is in its parent, and how it is stretched first.
  void Place(const robot::Transform& at, const std::optional<robot::Vector3>& scale = {});
  /// Whatever went wrong, else the file is put in its place.
  Status End();

 private:
  void Indent();
  void Flush();
  template <class Number>
  void List(std::string_view declaration, std::span<const Number> numbers, std::size_t width);

  AtomicFile file_;
  Status status_;
  std::string text_;  // not written yet
  std::size_t depth_ = 0;
};

}  // namespace consac::twin
