#include "mjcf_values.h"

#include <cmath>
#include <cstring>

#include "consac/base/text.h"

namespace consac::twin {

using robot::Quaternion;
using robot::Transform;
using robot::Vector3;

namespace {

constexpr std::size_t kMostClasses = 500, kMostDefaults = 2000;  // attributes of each; some 100 MB together

}  // namespace

Vector3 UnitOrZ(Vector3 v) {
  const double length = Norm(v);
  return length > 1e-12 ? (1.0 / length) * v : Vector3{0, 0, 1};
}

Quaternion TurnOfZInto(Vector3 axis) {
  const Vector3 about = Cross({0, 0, 1}, axis);
  if (Norm(about) < 1e-12) return axis.z > 0.0 ? Quaternion{} : Quaternion{1, 0, 0, 0};
  return robot::RotationAbout(UnitOrZ(about), std::atan2(Norm(about), axis.z));
}

void MjcfValues::ReadCompiler(pugi::xml_node compiler) {
  const std::string_view angle = compiler.attribute("angle").value();
  if (!angle.empty()) in_degrees_ = angle != "radian";
  if (compiler.attribute("eulerseq")) euler_ = compiler.attribute("eulerseq").value();
  if (euler_.size() != 3 || euler_.find_first_not_of("xyzXYZ") != std::string::npos)
    xml_.Refuse(compiler, "eulerseq " + Quote(euler_) + " is no sequence of three axes");
}

void MjcfValues::ReadClasses(pugi::xml_node root) {
  classes_["main"];
  for (const pugi::xml_node node : root.children("default")) {  // which may be several, and have another name
    ReadDefaults(node, "main", classes_["main"]);
    if (node.attribute("class")) classes_[node.attribute("class").value()] = classes_["main"];
  }
  for (const char* part : {"asset", "worldbody", "equality"}) {
    for (const pugi::xml_node node : root.children(part)) CheckClasses(node);
  }
}

void MjcfValues::CheckClasses(pugi::xml_node node) {
  for (const pugi::xml_node child : node.children()) {
    for (const char* name : {"class", "childclass"}) {
      const pugi::xml_attribute attribute = child.attribute(name);
      if (attribute && !classes_.contains(std::string_view(attribute.value())))
        return xml_.Refuse(child, "<" + std::string(child.name()) + " " + name + "=" + Quote(attribute.value()) +
                                      ">: no <default> has that class");
    }
    CheckClasses(child);
  }
}

void MjcfValues::ReadDefaults(pugi::xml_node node, const std::string& name, Defaults defaults) {
  for (const pugi::xml_node child : node.children()) {
    if (std::strcmp(child.name(), "default") == 0) continue;
    for (const pugi::xml_attribute attribute : child.attributes())
      defaults[child.name()][attribute.name()] = attribute.value();
  }
  std::size_t many = 0;
  for (const auto& [element, attributes] : defaults) many += attributes.size();
  if (many > kMostDefaults || classes_.size() > kMostClasses)
    return xml_.Refuse(node, "there are more than " + std::to_string(kMostClasses) + " classes of defaults, or " +
                                 std::to_string(kMostDefaults) + " attributes in one");
  for (const pugi::xml_node child : node.children("default")) ReadDefaults(child, xml_.Text(child, "class"), defaults);
  classes_[name] = std::move(defaults);
}

std::string_view MjcfValues::Say(pugi::xml_node node, const char* name, const std::string& enclosing) const {
  if (const pugi::xml_attribute own = node.attribute(name)) return own.value();
  const auto of_class = classes_.find(node.attribute("class") ? std::string_view(node.attribute("class").value())
                                                              : std::string_view(enclosing));
  if (of_class == classes_.end()) return {};
  const auto element = of_class->second.find(std::string_view(node.name()));
  if (element == of_class->second.end()) return {};
  const auto value = element->second.find(std::string_view(name));
  return value == element->second.end() ? std::string_view() : std::string_view(value->second);
}

std::vector<double> MjcfValues::List(pugi::xml_node node, const char* name, const std::string& enclosing,
                                     std::size_t count) {
  const std::string_view text = Say(node, name, enclosing);
  std::vector<double> list = xml_.ListOf(node, name, text, count);
  if (!text.empty() && list.size() != count) {
    xml_.Refuse(node, "<" + std::string(node.name()) + " " + name + "=" + Quote(text) + ">: " + std::to_string(count) +
                          " numbers are needed");
    list.clear();
  }
  return list;
}

Vector3 MjcfValues::Vector(pugi::xml_node node, const char* name, const std::string& enclosing, Vector3 otherwise) {
  const std::vector<double> list = List(node, name, enclosing, 3);
  return list.empty() ? otherwise : Vector3{list[0], list[1], list[2]};
}

double MjcfValues::Number(pugi::xml_node node, const char* name, const std::string& enclosing, double otherwise) {
  const std::vector<double> list = List(node, name, enclosing, 1);
  return list.empty() ? otherwise : list[0];
}

double MjcfValues::Angle(double value) const {
  return in_degrees_ ? value * robot::kPiRadians / 180.0 : value;
}

Quaternion MjcfValues::Euler(const std::vector<double>& angles) const {
  Quaternion turn;
  for (std::size_t i = 0; i < 3; ++i) {
    const char letter = euler_[i];
    const char axis = static_cast<char>(letter | 0x20);
    const Quaternion step = robot::RotationAbout(
        {axis == 'x' ? 1.0 : 0.0, axis == 'y' ? 1.0 : 0.0, axis == 'z' ? 1.0 : 0.0}, Angle(angles[i]));
    turn = letter >= 'a' ? turn * step : step * turn;  // lower case turns with the body, upper case about fixed axes
  }
  return turn;
}

Quaternion MjcfValues::Rotation(pugi::xml_node node, const std::string& enclosing) {
  if (const auto q = List(node, "quat", enclosing, 4); !q.empty()) return robot::Normalised({q[1], q[2], q[3], q[0]});
  if (const auto e = List(node, "euler", enclosing, 3); !e.empty()) return Euler(e);
  if (const auto a = List(node, "axisangle", enclosing, 4); !a.empty())
    return robot::RotationAbout(UnitOrZ({a[0], a[1], a[2]}), Angle(a[3]));
  if (const auto a = List(node, "xyaxes", enclosing, 6); !a.empty()) {
    const Vector3 x = UnitOrZ({a[0], a[1], a[2]}), y_about{a[3], a[4], a[5]};
    const Vector3 y = UnitOrZ(y_about - Dot(x, y_about) * x), z = Cross(x, y);
    return robot::FromMatrix({x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z});
  }
  if (const auto a = List(node, "zaxis", enclosing, 3); !a.empty()) return TurnOfZInto(UnitOrZ({a[0], a[1], a[2]}));
  return {};
}

Transform MjcfValues::Place(pugi::xml_node node, const std::string& enclosing) {
  return {Rotation(node, enclosing), Vector(node, "pos", enclosing, {})};
}

}  // namespace consac::twin
