// A file of hints: docs/twin.md, "From a STEP file".
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/twin/cad_joints.h"

namespace consac::twin {
namespace {

using HintsJson = nlohmann::json;

constexpr std::size_t kMostHints = 2000;  // links, and joints

// Reads members and remembers the first thing that is wrong.
class HintsReader {
 public:
  Result<JointHints> Read(const HintsJson& json) {
    JointHints hints;
    if (!Know(json, "the file", {"base", "automatic", "links", "joints"})) return status_;
    hints.base = Text(json, "base", "");
    if (json.contains("automatic") && !json["automatic"].is_boolean()) Fail("\"automatic\" is true or false");
    hints.automatic = json.value("automatic", HintsJson(true)) != false;
    if (json.contains("links")) ReadLinks(json["links"], &hints);
    if (json.contains("joints")) ReadJoints(json["joints"], &hints);
    if (!status_.ok()) return status_;
    return hints;
  }

 private:
  void Fail(const std::string& what) {
    if (status_.ok()) status_ = {StatusCode::kInvalidArgument, "hints: " + what};
  }

  // Whether it is an object with members that are known alone.
  bool Know(const HintsJson& json, const std::string& where, const std::vector<std::string_view>& known) {
    if (!json.is_object()) {
      Fail(where + " is to be a JSON object, {...}");
      return false;
    }
    for (const auto& [key, value] : json.items()) {
      if (std::find(known.begin(), known.end(), key) == known.end())
        Fail(where + " has no member " + Quote(key) + Suggestion(key, known));
    }
    return status_.ok();
  }

  std::string Text(const HintsJson& json, const char* key, const std::string& otherwise) {
    const auto at = json.find(key);
    if (at == json.end()) return otherwise;
    if (!at->is_string()) Fail(Quote(key) + " is to be a text");
    return at->is_string() ? at->get<std::string>() : otherwise;
  }

  double Number(const HintsJson& json, const char* key, double otherwise) {
    const auto at = json.find(key);
    if (at == json.end()) return otherwise;
    const double value = at->is_number() ? at->get<double>() : NAN;
    if (!(std::abs(value) <= 1e9)) Fail(Quote(key) + " is to be a number");
    return std::abs(value) <= 1e9 ? value : otherwise;
  }

  std::vector<double> Numbers(const HintsJson& json, const std::string& key, std::size_t count) {
    std::vector<double> out;
    for (const HintsJson& each : json) {
      if (each.is_number() && std::abs(each.get<double>()) <= 1e9) out.push_back(each.get<double>());
    }
    if (!json.is_array() || json.size() != count || out.size() != count) {
      Fail(Quote(key) + " is to be a list of " + std::to_string(count) + " numbers");
      out.assign(count, 0.0);
    }
    return out;
  }

  std::string Name(const std::string& what, const std::string& name) {
    const Status status = CheckName(what, name);
    if (!status.ok()) Fail(status.message());
    return name;
  }

  void ReadLinks(const HintsJson& links, JointHints* hints) {
    if (!links.is_object() || links.size() > kMostHints)
      return Fail("\"links\" is to be an object, {\"name\": [\"pattern\"]}, of at most " + std::to_string(kMostHints));
    for (const auto& [name, value] : links.items()) {
      LinkHint link{Name("link", name), {}, 0.0};
      const HintsJson* parts = &value;
      if (value.is_object()) {
        Know(value, "link " + Quote(name), {"parts", "mass"});
        link.mass = Number(value, "mass", 0.0);
        if (value.contains("mass") && !(link.mass > 0.0))
          Fail("link " + Quote(name) + ": \"mass\" is to be above 0, kg");
        if (!value.contains("parts")) return Fail("link " + Quote(name) + " has no \"parts\"");
        parts = &value["parts"];
      }
      if (!parts->is_array() || parts->empty() || parts->size() > kMostHints)
        return Fail("link " + Quote(name) + " is to have a list of patterns, [\"Base*\"]");
      for (const HintsJson& each : *parts) {
        if (!each.is_string()) return Fail("link " + Quote(name) + ": a pattern is a text");
        link.parts.push_back(each.get<std::string>());
      }
      hints->links.push_back(std::move(link));
    }
  }

  void ReadJoints(const HintsJson& joints, JointHints* hints) {
    if (!joints.is_array() || joints.size() > kMostHints)
      return Fail("\"joints\" is to be a list of at most " + std::to_string(kMostHints));
    std::set<std::string> names;
    for (const HintsJson& each : joints) {
      ReadJoint(each, "joint " + std::to_string(hints->joints.size() + 1), hints);
      if (!status_.ok()) return;
      if (!names.insert(hints->joints.back().name).second)
        Fail("two joints are called " + Quote(hints->joints.back().name));
    }
  }

  void ReadJoint(const HintsJson& json, const std::string& where, JointHints* hints) {
    if (!Know(json, where, {"name", "type", "parent", "child", "axis", "limit", "velocity", "effort", "drawn_at"}))
      return;
    JointHint joint;
    joint.name = Name(where, Text(json, "name", ""));
    const std::string type = Text(json, "type", "revolute");
    if (!robot::ParseJointType(type, &joint.type))
      Fail(where + ": " + Quote(type) + " is no type; fixed, revolute, continuous and prismatic are");
    joint.parent = Text(json, "parent", ""), joint.child = Text(json, "child", "");
    if (joint.parent.empty() || joint.child.empty()) Fail(where + " needs a \"parent\" and a \"child\"");
    if (json.contains("axis") && json["axis"].is_object()) {
      const HintsJson& axis = json["axis"];
      if (!Know(axis, where + ": \"axis\"", {"origin", "direction"})) return;
      const std::vector<double> o = Numbers(axis.value("origin", HintsJson()), "origin", 3);
      const std::vector<double> d = Numbers(axis.value("direction", HintsJson()), "direction", 3);
      joint.axis.clear();
      joint.origin = {o[0], o[1], o[2]};
      joint.direction = {d[0], d[1], d[2]};
      const double length = Norm(joint.direction);
      if (!(length > 1e-9)) return Fail(where + ": its direction has no length");
      joint.direction = (1.0 / length) * joint.direction;
    } else {
      joint.axis = Text(json, "axis", "auto");
      if (joint.axis != "auto" && !joint.axis.starts_with("candidate:") && !joint.axis.starts_with("component:"))
        Fail(where + ": " + Quote(joint.axis) +
             " is no axis; \"auto\", \"candidate:N\", \"component:PATH#Z\" and {\"origin\", \"direction\"} are");
    }
    if (json.contains("limit")) {
      const std::vector<double> limit = Numbers(json["limit"], "limit", 2);
      joint.drive.lower = limit[0], joint.drive.upper = limit[1];
      joint.limited = true;
      if (limit[0] > limit[1]) Fail(where + ": its lower limit is above its upper one");
    }
    joint.drive.velocity = Number(json, "velocity", robot::kNoLimit);
    joint.drive.effort = Number(json, "effort", robot::kNoLimit);
    joint.drawn_at = Number(json, "drawn_at", 0.0);
    hints->joints.push_back(std::move(joint));
  }

  Status status_;
};

}  // namespace

Result<JointHints> ReadHints(std::string_view text) {
  const Result<HintsJson> json = ReadJson<HintsJson>(text);
  if (!json.ok()) return Status{json.status().code(), "hints: " + json.status().message()};
  return HintsReader().Read(*json);
}

}  // namespace consac::twin
