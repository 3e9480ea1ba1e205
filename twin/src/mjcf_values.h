#pragma once
// What an MJCF's elements say, or the classes of defaults for them, and the ways to say a rotation. Private to twin.

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "consac/robot/transform.h"
#include "xml.h"

namespace consac::twin {

/// `v` with length 1; Z where it has none.
robot::Vector3 UnitOrZ(robot::Vector3 v);
/// The smallest rotation that turns Z into `axis`, of length 1.
robot::Quaternion TurnOfZInto(robot::Vector3 axis);

/// Attributes of one file's elements. What is wrong goes to the XmlReader. `enclosing` is the class of elements that
/// name none themselves.
class MjcfValues {
 public:
  /// `xml` must outlive this.
  explicit MjcfValues(XmlReader& xml) : xml_(xml) {}
  /// How angles are written.
  void ReadCompiler(pugi::xml_node compiler);
  /// All classes of <mujoco>; a class that an element names and nobody defines is refused.
  void ReadClasses(pugi::xml_node root);

  /// What an element says, or its class for it; "" nothing. Valid as long as the XmlReader.
  std::string_view Say(pugi::xml_node node, const char* name, const std::string& enclosing) const;
  /// So many numbers; none where nothing is said. Another count is refused.
  std::vector<double> List(pugi::xml_node node, const char* name, const std::string& enclosing, std::size_t count);
  /// Three numbers.
  robot::Vector3 Vector(pugi::xml_node node, const char* name, const std::string& enclosing, robot::Vector3 otherwise);
  /// One number.
  double Number(pugi::xml_node node, const char* name, const std::string& enclosing, double otherwise);
  /// An angle as the file writes it, rad.
  double Angle(double value) const;
  /// Where the element stands in what holds it.
  robot::Transform Place(pugi::xml_node node, const std::string& enclosing);

 private:
  using Attributes = std::map<std::string_view, std::string_view>;  // of the document
  using Defaults = std::map<std::string_view, Attributes>;          // by element

  void ReadDefaults(pugi::xml_node node, const std::string& name, Defaults defaults);
  void CheckClasses(pugi::xml_node node);
  robot::Quaternion Euler(const std::vector<double>& angles) const;
  robot::Quaternion Rotation(pugi::xml_node node, const std::string& enclosing);

  XmlReader& xml_;
  bool in_degrees_ = true;
  std::string euler_ = "xyz";
  std::map<std::string, Defaults, std::less<>> classes_;  // each with what it inherits
};

}  // namespace consac::twin
