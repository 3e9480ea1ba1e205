#include "cli/conformance_answers.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/conformance.h"
#include "cli/conformance_frames.h"
#include "consac/base/json.h"

namespace consac::cli {

bool Refuses(const protocol2::Frame& frame, const std::string& code) {
  if (code.empty() || frame.header.type != protocol2::FrameType::kError) return false;
  const Result<protocol2::ErrorMessage> error = protocol2::ParseError(frame.payload);
  return error.ok() && error->code == code && !error->ends_connection;
}

Status CheckMembers(const nlohmann::json& what, const nlohmann::json& message) {
  nlohmann::json members = what.value("members", nlohmann::json::object());
  for (const char* key : {"code", "severity"}) {
    if (what.contains(key)) members[key] = what[key];
  }
  for (const auto& [key, value] : members.items()) {
    const nlohmann::json found = message.contains(key) ? message[key] : nlohmann::json();
    const bool one_of = value.is_array() && std::find(value.begin(), value.end(), found) != value.end();
    const bool within = value.is_object() && found.is_number() && found >= value["from"] && found <= value["to"];
    if (found != value && !one_of && !within)
      return Failed(fmt::format("{} is {}, expected {}", key, JsonText(found), JsonText(value)));
  }
  if (!what.contains("path")) return Status::Ok();
  const nlohmann::json path = message.value("path", nlohmann::json());
  if (std::find(what["path"].begin(), what["path"].end(), path) != what["path"].end()) return Status::Ok();
  return Failed(fmt::format("path is {}, expected one of {}", JsonText(path), JsonText(what["path"])));
}

namespace {

nlohmann::json WithFractions(const nlohmann::json& value) {
  if (value.is_number()) return value.get<double>();
  nlohmann::json with = value;
  if (value.is_structured()) {
    for (nlohmann::json& inner : with) inner = WithFractions(inner);
  }
  return with;
}

}  // namespace

nlohmann::json Expected(const std::string& how, nlohmann::json offered) {
  if (how == "with fractions") return WithFractions(offered);
  if (how == "with a member more") offered[0]["later"] = nullptr;
  if (how == "of another name") offered[0]["name"] = "somebody else";
  return offered;
}

void ConformanceVerdict::Note(const nlohmann::json& done) {
  ++step;
  if (!expects) sent = asked;
  asked = JsonText(done);
  expects = done.contains("expect");
}

}  // namespace consac::cli
