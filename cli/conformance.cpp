#include "cli/conformance.h"

#include <fmt/format.h>

#include <chrono>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "consac/space/layout.h"

namespace consac::cli {
namespace {

using nlohmann::json;
using protocol2::Frame;
using protocol2::FrameType;

constexpr double kPatience = 10.0;  // s for an answer
constexpr int kReconnects = 100;

constexpr std::pair<const char*, FrameType> kTypes[] = {
    {"HELLO", FrameType::kHello},   {"WELCOME", FrameType::kWelcome}, {"CONFIGURE", FrameType::kConfigure},
    {"SPEC", FrameType::kSpec},     {"RESET", FrameType::kReset},     {"STEP", FrameType::kStep},
    {"RESULT", FrameType::kResult}, {"ERROR", FrameType::kError},     {"GOAWAY", FrameType::kGoAway},
    {"BYE", FrameType::kBye},       {"PING", FrameType::kPing},       {"PONG", FrameType::kPong}};

FrameType TypeOf(const json& name) {
  if (name.is_number()) return static_cast<FrameType>(name.get<std::uint16_t>());
  for (const auto& [text, type] : kTypes) {
    if (name == text) return type;
  }
  return static_cast<FrameType>(0);
}

std::string NameOf(FrameType type) {
  for (const auto& [text, known] : kTypes) {
    if (type == known) return text;
  }
  return fmt::format("type {}", static_cast<int>(type));
}

Status Failed(const std::string& what) {
  return {StatusCode::kProtocol, what};
}

std::string FromHex(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return bytes;
}

/// One case under way.
class Conversation {
 public:
  Conversation(const Endpoint& endpoint, const std::string& token) : endpoint_(endpoint), token_(token) {}
  ~Conversation() {
    if (transport_ == nullptr) return;
    (void)Send(FrameType::kBye, 0, "");
    transport_->Close();
  }

  Status Connect() {
    Result<std::unique_ptr<Transport>> transport = ConnectTcp(endpoint_, 3.0);
    if (!transport.ok()) return transport.status();
    transport_ = std::move(*transport);
    reader_ = protocol2::FrameReader(protocol2::kLargestFrame);
    return Status::Ok();
  }

  Status Do(const json& step) {
    if (step.contains("send")) return DoSend(step["send"]);
    if (step.contains("reconnect")) return Reconnect();
    return DoExpect(step["expect"]);
  }

 private:
  Status Send(FrameType type, std::uint64_t request, const std::string& payload) {
    std::string frame(protocol2::kHeaderBytes, '\0');
    protocol2::WriteHeader({type, false, static_cast<std::uint32_t>(payload.size()), 0, request, session_},
                           reinterpret_cast<std::byte*>(frame.data()));
    return Write(frame + payload);
  }
  Status Write(const std::string& bytes) { return transport_->Write(std::as_bytes(std::span(bytes)), kPatience); }

  Status DoSend(const json& what) {
    if (what.contains("hex")) return Write(FromHex(what["hex"]));
    std::string payload;
    if (what.contains("json")) {
      json value = what["json"];
      if (what["type"] == "HELLO" && !token_.empty()) value["token"] = token_;
      payload = value.dump();
    }
    if (what.contains("text")) payload = what["text"];
    if (what.contains("payload")) payload = Payload(what["payload"]);
    return Send(TypeOf(what["type"]), what.value("request", std::uint64_t{0}), payload);
  }

  /// The next frame that is no PING; kUnavailable once the connection has ended.
  Result<Frame> Next() {
    const double deadline = Now() + kPatience;
    while (true) {
      Frame frame;
      const Result<bool> whole = reader_.Next(&frame);
      if (!whole.ok()) return whole.status();
      if (*whole && frame.header.type != FrameType::kPing) return frame;
      if (*whole) continue;
      const Result<std::size_t> count = transport_->Read(reader_.Writable(), deadline - Now());
      if (!count.ok()) return count.status();
      if (*count == 0) return Failed("no answer within 10 s");
      reader_.Commit(*count);
    }
  }

  Status DoExpect(const json& what) {
    const Result<Frame> frame = Next();
    if (what.contains("closed")) {
      const bool closed = !frame.ok() && frame.status().code() == StatusCode::kUnavailable;
      return closed ? Status::Ok() : Failed("the connection stays open");
    }
    if (!frame.ok()) return Failed(fmt::format("expected {}, but {}", what["type"].dump(), frame.status().message()));
    std::string payload(reinterpret_cast<const char*>(frame->payload.data()), frame->payload.size());
    if (frame->header.type == FrameType::kResult && payload.size() >= 8)
      protocol2::WriteEngineTime(0.0, reinterpret_cast<std::byte*>(payload.data()));  // the same world, another day
    if (frame->header.type != TypeOf(what["type"])) {
      return Failed(
          fmt::format("expected {}, got {} {}", what["type"].dump(), NameOf(frame->header.type), Quote(payload, 120)));
    }
    if (what.contains("request") && frame->header.request != what["request"])
      return Failed(
          fmt::format("the answer is to request {}, expected {}", frame->header.request, what["request"].dump()));
    if (what.contains("text") && payload != what["text"]) return Failed("the payload is " + Quote(payload));
    if (what.contains("same_as") && payload != kept_[what["same_as"]])
      return Failed("the payload differs from the one before");
    if (what.contains("keep")) kept_[what["keep"]] = payload;
    return CheckMessage(what, *frame, payload);
  }

  Status CheckMessage(const json& what, const Frame& frame, const std::string& payload) {
    if (frame.header.type == FrameType::kSpec) {
      Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(frame.payload);
      if (!spec.ok()) return spec.status();
      spec_ = std::move(*spec);
      blocks_ = protocol2::Blocks(spec_.env);
      return Status::Ok();
    }
    if (frame.header.type != FrameType::kError && frame.header.type != FrameType::kWelcome) return Status::Ok();
    const json message = json::parse(payload, nullptr, false);
    if (!message.is_object()) return Failed("its payload is no JSON object");
    if (frame.header.type == FrameType::kWelcome) {
      session_ = message.value("session", 0u);
      resume_ = message.value("resume", std::string());
    }
    for (const auto& [key, value] : what.items()) {
      if (key != "code" && key != "severity" && key != "resumed" && key != "last_request" && key != "path") continue;
      const json found = message.contains(key) ? message[key] : json();
      const bool one_of = value.is_array() && std::find(value.begin(), value.end(), found) != value.end();
      const bool there = key == "path" && found.is_string();
      if (found == value || one_of || there) continue;
      return Failed(fmt::format("{} is {}, expected {}", key, found.dump(), value.dump()));
    }
    return Status::Ok();
  }

  /// The engine may not have noticed yet that the connection is gone.
  Status Reconnect() {
    transport_->Close();
    for (int attempt = 0; attempt < kReconnects; ++attempt) {
      CONSAC_RETURN_IF_ERROR(Connect());
      json hello = {{"protocol", {2, 2}}, {"client", "conformance"}, {"resume", resume_}};
      if (!token_.empty()) hello["token"] = token_;
      CONSAC_RETURN_IF_ERROR(Send(FrameType::kHello, 0, hello.dump()));
      const Result<std::size_t> count = transport_->Read(reader_.Writable(), kPatience);
      if (!count.ok()) return count.status();
      reader_.Commit(*count);
      protocol2::FrameReader peek = reader_;
      Frame frame;
      const Result<bool> whole = peek.Next(&frame);
      if (whole.ok() && *whole && frame.header.type == FrameType::kWelcome) return Status::Ok();
      transport_->Close();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return Failed("the session cannot be taken up again");
  }

  std::string Payload(const std::string& kind) const {
    if (kind == "all" || kind == "none" || kind == "seeded") return ResetPayload(kind);
    std::string payload = StepPayload(kind == "illegal");
    if (kind == "short") payload.pop_back();
    return payload;
  }

  std::string ResetPayload(const std::string& kind) const {
    std::string payload(kind == "seeded" ? blocks_.options : blocks_.seeds, '\0');
    const std::uint32_t flags = kind == "seeded" ? protocol2::kWithSeeds : 0;
    std::memcpy(payload.data(), &flags, sizeof(flags));
    if (kind != "none") std::memset(payload.data() + protocol2::kActiveOffset, 1, blocks_.environments);
    for (std::size_t i = 0; kind == "seeded" && i < blocks_.environments; ++i) {
      const std::uint64_t seed = 11 + i;
      std::memcpy(payload.data() + blocks_.seeds + i * sizeof(seed), &seed, sizeof(seed));
    }
    return payload;
  }

  /// Legal actions, the same each time; or a first one outside its space.
  std::string StepPayload(bool illegal) const {
    std::string payload(blocks_.step_bytes, '\0');
    std::memset(payload.data() + protocol2::kActiveOffset, 1, blocks_.environments);
    Rng rng(1, StreamId("conformance"));
    for (std::size_t b = 0; b < blocks_.behaviours.size(); ++b) {
      const BehaviourSpec& behaviour = spec_.env.behaviours[b];
      auto* rows = reinterpret_cast<std::byte*>(payload.data()) + blocks_.behaviours[b].actions;
      for (std::int32_t slot = 0; slot < behaviour.slots; ++slot)
        SampleRow(behaviour.action_layout, rng,
                  rows + static_cast<std::size_t>(slot) * behaviour.action_layout.row_bytes);
      if (illegal && b == 0) {
        const Leaf& leaf = behaviour.action_layout.leaves[0];
        const bool box = leaf.space.kind() == SpaceKind::kBox;
        WriteElement(leaf, rows, 0, box ? std::numeric_limits<double>::quiet_NaN() : 100000.0);
      }
    }
    return payload;
  }

  const Endpoint endpoint_;
  const std::string token_;
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_{protocol2::kLargestFrame};
  protocol2::SpecMessage spec_;
  protocol2::Blocks blocks_;
  std::uint32_t session_ = 0;
  std::string resume_;
  std::map<std::string, std::string> kept_;
};

Status RunCase(const json& entry, const Endpoint& endpoint, const std::string& token) {
  Conversation conversation(endpoint, token);
  CONSAC_RETURN_IF_ERROR(conversation.Connect());
  int number = 0;
  for (const json& step : entry["steps"]) {
    ++number;
    const Status status = conversation.Do(step);
    if (!status.ok())
      return {status.code(), fmt::format("step {} ({}): {}", number, step.dump().substr(0, 80), status.message())};
  }
  return Status::Ok();
}

}  // namespace

Result<int> RunConformance(const Endpoint& endpoint, const std::string& token,
                           const std::function<void(const ConformanceVerdict&)>& say) {
  const Result<std::unique_ptr<Transport>> there = ConnectTcp(endpoint, 3.0);
  if (!there.ok()) return there.status();
  (*there)->Close();
  int failed = 0;
  for (const json& entry : json::parse(ConformanceCases())) {
    const ConformanceVerdict verdict{entry["name"], RunCase(entry, endpoint, token)};
    failed += verdict.status.ok() ? 0 : 1;
    say(verdict);
  }
  return failed;
}

}  // namespace consac::cli
