// The control messages of protocol 2 as JSON, but for those in which an engine and a trainer agree on what is stepped
// (protocol2_spec.cpp).
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "protocol/protocol2_json.h"
#include "protocol/protocol2_members.h"

namespace consac::protocol2 {
namespace {

constexpr JsonLimits kMessageLimits = {.bytes = kLargestJson, .values = std::size_t{1} << 18};
constexpr std::size_t kEscapedBytes = 6;   // of JSON for a byte of text, at most
constexpr std::size_t kLongestPath = 512;  // bytes in an ERROR

}  // namespace

Result<Json> ParseObject(std::span<const std::byte> payload) {
  const std::string_view text(reinterpret_cast<const char*>(payload.data()), payload.size());
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // which the library would pass over
  if (text.starts_with(kByteOrderMark)) return Fault("MALFORMED", "a payload begins with a byte order mark");
  Result<Json> json = ReadJson<Json>(text, kMessageLimits);
  if (!json.ok()) return Fault("MALFORMED", json.status().message() + ", in " + Quote(text));
  if (!json->is_object()) return Fault("MALFORMED", "a payload is no JSON object: " + Quote(text));
  return json;
}

bool HasCapability(std::span<const std::string> capabilities, std::string_view name) {
  return std::find(capabilities.begin(), capabilities.end(), name) != capabilities.end();
}

std::string LackingCapability(std::span<const std::string> capabilities, std::span<const std::string> names) {
  const auto lacking = std::find_if_not(names.begin(), names.end(),
                                        [&](const std::string& name) { return HasCapability(capabilities, name); });
  return lacking == names.end() ? std::string() : *lacking;
}

std::string EncodeHello(const Hello& hello) {
  Json json = {{"protocol", {hello.lowest, hello.highest}},
               {"client", hello.client},
               {"capabilities", hello.capabilities},
               {"max_frame", hello.max_frame}};
  if (!hello.token.empty()) json["token"] = hello.token;
  if (!hello.resume.empty()) json["resume"] = hello.resume;
  return JsonText(json);
}

Result<Hello> ParseHello(std::span<const std::byte> payload) {
  const Result<Json> json = ParseObject(payload);
  if (!json.ok()) return json.status();
  const Members members{*json};
  const Json* range = members.Find("protocol");
  const bool whole =
      range != nullptr && range->is_array() && range->size() == 2 && IsWhole((*range)[0]) && IsWhole((*range)[1]);
  if (!whole) return Fault("MALFORMED", "HELLO lacks \"protocol\": [lowest, highest]");
  Hello hello;
  hello.lowest = static_cast<int>(std::clamp<std::int64_t>((*range)[0].get<std::int64_t>(), 0, 1 << 30));
  hello.highest = static_cast<int>(std::clamp<std::int64_t>((*range)[1].get<std::int64_t>(), 0, 1 << 30));
  if (hello.lowest > kVersion || hello.highest < kVersion) return hello;  // of another version nothing else is known
  hello.client = members.Text("client");
  hello.capabilities = members.Texts("capabilities");
  hello.token = members.Text("token");
  hello.resume = members.Text("resume");
  hello.max_frame = members.FrameLimit();
  return members.Checked("HELLO", std::move(hello));
}

std::string EncodeWelcome(const Welcome& welcome) {
  const Json json = {{"protocol", kVersion},
                     {"server", welcome.server},
                     {"session", welcome.session},
                     {"resume", welcome.resume},
                     {"capabilities", welcome.capabilities},
                     {"max_frame", welcome.max_frame},
                     {"heartbeat_s", welcome.heartbeat_s},
                     {"last_request", welcome.last_request},
                     {"resumed", welcome.resumed}};
  return JsonText(json);
}

Result<Welcome> ParseWelcome(std::span<const std::byte> payload) {
  const Result<Json> json = ParseObject(payload);
  if (!json.ok()) return json.status();
  const Members members{*json};
  members.Need("protocol");
  const std::int64_t version = members.Whole("protocol");
  if (members.wrong.empty() && version != kVersion)
    return Fault("UNSUPPORTED_VERSION",
                 "the engine chose protocol " + std::to_string(version) + ", which was not offered");
  Welcome welcome;
  members.Need("session");
  welcome.server = members.Text("server");
  const std::int64_t session = members.Whole("session");
  if (members.wrong.empty() && (session < 1 || session > std::numeric_limits<std::uint32_t>::max()))
    return Fault("MALFORMED", "WELCOME: session is " + std::to_string(session) + ", expected 1 to 2^32-1");
  welcome.session = static_cast<std::uint32_t>(session);
  welcome.resume = members.Text("resume");
  welcome.capabilities = members.Texts("capabilities");
  welcome.max_frame = members.FrameLimit();
  const double heartbeat_s = members.Number("heartbeat_s", 10.0);
  if (!(heartbeat_s > 0.0)) return Fault("MALFORMED", "WELCOME: heartbeat_s is not above 0");
  welcome.heartbeat_s = std::clamp(heartbeat_s, 0.1, 1e6);
  welcome.last_request = static_cast<std::uint64_t>(members.Count("last_request"));
  welcome.resumed = members.Truth("resumed");
  return members.Checked("WELCOME", std::move(welcome));
}

Result<std::int64_t> ParseRender(std::span<const std::byte> payload) {
  const Result<Json> json = ParseObject(payload);
  if (!json.ok()) return json.status();
  const Members members{*json};
  return members.Checked("RENDER", members.Whole("env"));
}

std::string EncodePicture(const Picture& picture) {
  const std::uint32_t size[2] = {static_cast<std::uint32_t>(picture.height), static_cast<std::uint32_t>(picture.width)};
  std::string payload(sizeof(size), '\0');
  std::memcpy(payload.data(), size, sizeof(size));
  payload.append(picture.rgb.begin(), picture.rgb.end());
  return payload;
}

std::string EncodeError(const ErrorMessage& error) {
  std::string message(CutAtCharacter(error.message, kLargestBeforeWelcome));
  Json json = {
      {"code", error.code}, {"severity", error.ends_connection ? "connection" : "request"}, {"message", message}};
  if (!error.path.empty()) json["path"] = std::string(CutAtCharacter(error.path, kLongestPath));
  if (error.retry_after_s > 0.0) json["retry_after_s"] = error.retry_after_s;
  if (error.environment >= 0) json["env"] = error.environment;
  if (error.code == "UNSUPPORTED_VERSION") json["protocol"] = {kVersion, kVersion};
  std::string text = JsonText(json);
  while (text.size() > kLargestBeforeWelcome && !message.empty()) {  // R17
    const std::size_t over = (text.size() - kLargestBeforeWelcome + kEscapedBytes - 1) / kEscapedBytes;
    message.resize(CutAtCharacter(message, message.size() - std::min(over, message.size())).size());
    json["message"] = message;
    text = JsonText(json);
  }
  return text;
}

Result<ErrorMessage> ParseError(std::span<const std::byte> payload) {
  const Result<Json> json = ParseObject(payload);
  if (!json.ok()) return json.status();
  const Members members{*json};
  for (const char* name : {"code", "severity", "message"}) members.Need(name);
  const std::string severity = members.Text("severity");
  if (members.wrong.empty() && severity != "connection" && severity != "request")
    return Fault("MALFORMED", "ERROR: severity is " + Quote(severity) + ", expected connection or request");
  const ErrorMessage error{members.Text("code"),
                           severity == "connection",
                           members.Text("message"),
                           members.Text("path"),
                           members.Number("retry_after_s", 0.0),
                           members.Whole("env", -1)};
  return members.Checked("ERROR", error);
}

std::string EncodeGoAway(const std::string& reason) {
  return JsonText(Json::object({{"reason", reason}}));
}

Result<GoAway> ParseGoAway(std::span<const std::byte> payload) {
  const Result<Json> json = ParseObject(payload);
  if (!json.ok()) return json.status();
  const Members members{*json};
  return GoAway{members.Text("reason"), members.Number("retry_after_s", 0.0)};
}

}  // namespace consac::protocol2
