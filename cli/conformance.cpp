// The trainer's end of the conformance cases. It keeps to the protocol itself: what may come between answers may, and
// every RESULT is judged.
#include "cli/conformance.h"

#include <fmt/format.h>

#include <chrono>
#include <cstring>
#include <map>
#include <thread>
#include <utility>

#include "cli/conformance_frames.h"
#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/protocol/result_check.h"
#include "consac/space/layout.h"

namespace consac::cli {
namespace {

using Case = nlohmann::json;
using protocol2::Frame;
using protocol2::FrameType;

constexpr int kReconnects = 100;

/// Payloads of RESET and STEP for what a SPEC offers, right ones and wrong ones.
class Payloads {
 public:
  Payloads() = default;
  explicit Payloads(const EnvSpec& env) : env_(&env), blocks_(env) {}

  /// What the cases call `kind`. `result`: the latest RESULT, whose masks say what is legal.
  std::string Of(const std::string& kind, const std::string& result) const {
    if (kind == "empty") return "";
    if (kind == "none") return Reset(0, 0);
    if (kind == "all") return Reset(0, 1);
    if (kind == "two reset") return With(Reset(0, 1), protocol2::kActiveOffset, 2);
    if (kind == "first reset") return OnlyFirst(Reset(0, 0), 1);
    if (kind == "unknown flag") return With(Reset(0, 1), 0, 64);
    if (kind == "seeded") return Reset(protocol2::kWithSeeds, 1);
    if (kind == "negative seed") return With(Reset(protocol2::kWithSeeds, 1), blocks_.seeds + 7, 0x80);
    if (kind == "options") return Options("{\"difficulty\":1}");
    if (kind == "bad options") return Options("{\"difficulty\"");
    if (kind == "short reset") return Reset(0, 1).substr(0, blocks_.seeds - 8);
    if (kind == "long reset") return Reset(0, 1) + std::string(8, '\0');
    if (kind == "short") return Step(1, result).substr(0, blocks_.step_bytes - 1);
    if (kind == "long") return Step(1, result) + std::string(8, '\0');
    if (kind == "nonzero") return With(Step(1, result), 4, 1);
    if (kind == "two") return With(Step(1, result), protocol2::kActiveOffset, 2);
    if (kind == "first") return OnlyFirst(Step(0, result), 1);
    if (kind == "others") return OnlyFirst(Step(1, result), 0);
    if (kind == "illegal") return Illegal(Step(1, result));
    if (kind == "illegal but not stepped") return Illegal(OnlyFirst(Step(1, result), 0));
    return Step(1, result);
  }

  /// RESET of the environments for which `chosen` is true.
  template <class Chosen>
  std::string ResetWhere(Chosen chosen) const {
    std::string payload = Reset(0, 0);
    for (std::size_t i = 0; i < blocks_.environments; ++i)
      payload[protocol2::kActiveOffset + i] = static_cast<char>(chosen(i));
    return payload;
  }

 private:
  static std::string With(std::string payload, std::size_t at, int value) {
    payload[at] = static_cast<char>(value);
    return payload;
  }
  static std::string OnlyFirst(std::string payload, int value) {
    return With(std::move(payload), protocol2::kActiveOffset, value);
  }

  std::string Reset(std::uint32_t flags, int chosen) const {
    const bool seeded = (flags & protocol2::kWithSeeds) != 0;
    std::string payload(seeded ? blocks_.options : blocks_.seeds, '\0');
    std::memcpy(payload.data(), &flags, sizeof(flags));
    std::memset(payload.data() + protocol2::kActiveOffset, chosen, blocks_.environments);
    for (std::size_t i = 0; seeded && i < blocks_.environments; ++i) {
      const std::uint64_t seed = 11 + i;
      std::memcpy(payload.data() + blocks_.seeds + i * sizeof(seed), &seed, sizeof(seed));
    }
    return payload;
  }

  std::string Options(const std::string& text) const {
    std::string payload = With(Reset(0, 1), 0, protocol2::kWithOptions);
    const auto length = static_cast<std::uint32_t>(text.size());
    payload.append(reinterpret_cast<const char*>(&length), sizeof(length)).append(text);
    payload.resize(protocol2::AlignBlock(payload.size()));
    return payload;
  }

  /// Legal actions, the same each time.
  std::string Step(int chosen, const std::string& result) const {
    std::string payload(blocks_.step_bytes, '\0');
    std::memset(payload.data() + protocol2::kActiveOffset, chosen, blocks_.environments);
    Rng rng(1, StreamId("conformance"));
    for (std::size_t b = 0; b < blocks_.behaviours.size(); ++b) {
      const BehaviourSpec& behaviour = env_->behaviours[b];
      const Layout& layout = behaviour.action_layout;
      auto* row = reinterpret_cast<std::byte*>(payload.data()) + blocks_.behaviours[b].actions;
      const auto* mask = reinterpret_cast<const std::uint8_t*>(result.data()) + blocks_.behaviours[b].masks;
      for (std::int32_t slot = 0; slot < behaviour.slots; ++slot, row += layout.row_bytes, mask += layout.mask_bytes) {
        SampleRow(layout, rng, row);
        if (behaviour.masks_actions && result.size() >= blocks_.result_bytes) MakeLegal(layout, mask, row);
      }
    }
    return payload;
  }

  std::string Illegal(std::string payload) const {
    const Leaf& leaf = env_->behaviours[0].action_layout.leaves[0];
    const bool box = leaf.space.kind() == SpaceKind::kBox;
    WriteElement(leaf, reinterpret_cast<std::byte*>(payload.data()) + blocks_.behaviours[0].actions, 0,
                 box ? std::numeric_limits<double>::quiet_NaN() : 100000.0);
    return payload;
  }

  const EnvSpec* env_ = nullptr;
  protocol2::Blocks blocks_;
};

/// One case under way.
class Conversation {
 public:
  Conversation(const Endpoint& endpoint, const std::string& token) : endpoint_(endpoint), token_(token) {}
  ~Conversation() {
    if (transport_ == nullptr) return;
    if (ended_ && !resume_.empty()) (void)TakeUp();
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

  Status Do(const Case& step) {
    if (step.contains("send")) return DoSend(step["send"]);
    if (step.contains("play")) return Play(step["play"]);
    if (step.contains("reconnect")) return Reconnect();
    if (step.contains("connect")) return ConnectAgain();
    return DoExpect(step["expect"]);
  }

  /// Nothing more is to be asked: the engine cannot do what the case is of, and said so.
  bool over() const { return over_; }

 private:
  Status Send(FrameType type, std::uint64_t request, const std::string& payload) {
    return Write(WholeFrame(type, request, session_, payload, crc_));
  }
  Status Write(const std::string& bytes) {
    return transport_->Write(std::as_bytes(std::span(bytes)), kConformancePatience);
  }

  /// What has ended without BYE is kept for a while; an engine of few sessions would have none for the next case.
  Status TakeUp() {
    CONSAC_RETURN_IF_ERROR(ConnectAgain());
    CONSAC_RETURN_IF_ERROR(SayHello());
    return Next().status();
  }

  Status SayHello() {
    Case hello = {{"protocol", {2, 2}}, {"client", "conformance"}, {"resume", resume_}};
    if (!token_.empty()) hello["token"] = token_;
    return Send(FrameType::kHello, 0, JsonText(hello));
  }

  Status ConnectAgain() {
    transport_->Close();
    session_ = 0;
    crc_ = false;
    return Connect();
  }

  Status DoSend(const Case& what) {
    if (what.contains("hex")) return Write(FromHex(what["hex"]));
    std::string payload;
    if (what.contains("json")) {
      Case value = what["json"];
      if (what["type"] == "HELLO" && !token_.empty()) value["token"] = token_;
      if (what.contains("resume") && resume_.empty()) over_ = true;
      if (what.contains("resume")) value["resume"] = resume_;
      payload = JsonText(value);
    }
    if (what.contains("text")) payload = what["text"];
    if (what.contains("payload")) payload = payloads_.Of(what["payload"], result_);
    const std::uint64_t request = what["request"] == "next" ? request_ + 1 : what["request"].get<std::uint64_t>();
    if (what.contains("other_session"))
      return Write(WholeFrame(FrameTypeOf(what["type"]), request, session_ + 1, payload, crc_));
    return Ask(FrameTypeOf(what["type"]), request, payload);
  }

  /// Sends; the judge hears of RESET and STEP.
  Status Ask(FrameType type, std::uint64_t request, const std::string& payload) {
    const bool whole = payload.size() >= protocol2::kActiveOffset + blocks_.environments;
    if ((type == FrameType::kReset || type == FrameType::kStep) && whole && request != judged_)
      check_.Ask(type, std::as_bytes(std::span(payload)).subspan(protocol2::kActiveOffset));
    if (request == request_ + 1) request_ = request;
    return Send(type, request, payload);
  }

  /// The next frame that is an answer; kUnavailable once the connection has ended. Time stands still during a pause.
  Result<Frame> Next() {
    if (std::exchange(held_, false)) return held_frame_;
    double deadline = Now() + kConformancePatience;
    bool paused = false;
    while (true) {
      Frame frame;
      const Result<bool> whole = reader_.Next(&frame);
      if (!whole.ok()) return whole.status();
      if (*whole) {
        const Result<bool> aside = IsAside(frame, &paused);
        if (!aside.ok()) return aside.status();
        if (!*aside) return frame;
        deadline = Now() + kConformancePatience;
        continue;
      }
      const Result<std::size_t> count =
          transport_->Read(reader_.Writable(), paused ? kConformancePatience : deadline - Now());
      if (!count.ok()) return count.status();
      if (*count == 0 && !paused) return Failed("no answer within 10 s");
      reader_.Commit(*count);
    }
  }

  /// What may come between a request and its answer.
  Result<bool> IsAside(const Frame& frame, bool* paused) {
    const FrameType type = frame.header.type;
    if (type == FrameType::kPing) {
      const std::string payload(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size());
      CONSAC_RETURN_IF_ERROR(Send(FrameType::kPong, 0, payload));
      return true;
    }
    if (type == FrameType::kPaused || type == FrameType::kResumed) {
      *paused = type == FrameType::kPaused;
      return true;
    }
    return (static_cast<std::uint16_t>(type) & protocol2::kOptionalType) != 0;
  }

  Status DoExpect(const Case& what) {
    const Result<Frame> frame = Next();
    if (what.contains("closed")) {
      const bool closed = !frame.ok() && frame.status().code() == StatusCode::kUnavailable;
      ended_ = true;
      return closed ? Status::Ok() : Failed("the connection stays open");
    }
    if (!frame.ok())
      return Failed(fmt::format("expected {}, but {}", JsonText(what["type"]), frame.status().message()));
    std::string payload(reinterpret_cast<const char*>(frame->payload.data()), frame->payload.size());
    if (frame->header.type == FrameType::kResult && payload.size() >= 8)
      protocol2::WriteEngineTime(0.0, reinterpret_cast<std::byte*>(payload.data()));  // the same world, another day
    if (what.contains("unless") && frame->header.type == FrameType::kError) {
      const Result<protocol2::ErrorMessage> error = protocol2::ParseError(frame->payload);
      over_ = error.ok() && error->code == what["unless"] && !error->ends_connection;
      if (over_) return Status::Ok();
    }
    if (frame->header.type != FrameTypeOf(what["type"])) {
      return Failed(fmt::format("expected {}, got {} {}", JsonText(what["type"]), FrameName(frame->header.type),
                                Quote(payload, 120)));
    }
    if (what.contains("request") && frame->header.request != what["request"])
      return Failed(
          fmt::format("the answer is to request {}, expected {}", frame->header.request, JsonText(what["request"])));
    if (what.contains("crc") && crc_ && !frame->header.checked) return Failed("crc was agreed, but flag 1 is not set");
    if (what.contains("text") && payload != what["text"]) return Failed("the payload is " + Quote(payload));
    if (what.contains("same_as") && payload != kept_[what["same_as"]])
      return Failed("the payload differs from the one before");
    if (what.contains("keep")) kept_[what["keep"]] = payload;
    return CheckMessage(what, *frame, payload);
  }

  Status CheckMessage(const Case& what, const Frame& frame, const std::string& payload) {
    if (frame.header.type == FrameType::kSpec) return TakeSpec(what, frame);
    if (frame.header.type == FrameType::kResult) return TakeResult(what, frame.header.request, payload);
    if (frame.header.type != FrameType::kError && frame.header.type != FrameType::kWelcome) return Status::Ok();
    const Case message = ReadCase(payload);
    if (!message.is_object()) return Failed("its payload is no JSON object");
    if (frame.header.type == FrameType::kWelcome) CONSAC_RETURN_IF_ERROR(TakeWelcome(frame));
    Case members = what.value("members", Case::object());
    for (const char* key : {"code", "severity"}) {
      if (what.contains(key)) members[key] = what[key];
    }
    for (const auto& [key, value] : members.items()) {
      const Case found = message.contains(key) ? message[key] : Case();
      const bool one_of = value.is_array() && std::find(value.begin(), value.end(), found) != value.end();
      if (found != value && !one_of)
        return Failed(fmt::format("{} is {}, expected {}", key, JsonText(found), JsonText(value)));
    }
    if (what.contains("path") && !message.value("path", Case()).is_string()) return Failed("it has no path");
    if (what.contains("env") && !message.value("env", Case()).is_number_integer()) return Failed("it has no env");
    return Status::Ok();
  }

  Status TakeWelcome(const Frame& frame) {
    const Result<protocol2::Welcome> welcome = protocol2::ParseWelcome(frame.payload);
    if (!welcome.ok()) return welcome.status();
    session_ = welcome->session;
    resume_ = welcome->resume;
    const auto& able = welcome->capabilities;
    crc_ = std::find(able.begin(), able.end(), "crc") != able.end();
    return Status::Ok();
  }

  Status TakeSpec(const Case& what, const Frame& frame) {
    Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(frame.payload);
    if (!spec.ok()) return spec.status();
    spec_ = std::move(*spec);
    blocks_ = protocol2::Blocks(spec_.env);
    payloads_ = Payloads(spec_.env);
    check_ = protocol2::ResultCheck(spec_.env, spec_.autoreset);
    const Case said = ReadCase({reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size()});
    const std::string autoreset = said.value("autoreset", "same_step"), asked = what.value("autoreset", "same_step");
    return autoreset == asked ? Status::Ok() : Failed("SPEC's autoreset is " + autoreset + ", asked for was " + asked);
  }

  /// One that comes once more is not judged anew.
  Status TakeResult(const Case& what, std::uint64_t request, const std::string& payload) {
    if (request == judged_) return Status::Ok();
    CONSAC_RETURN_IF_ERROR(check_.Judge(std::as_bytes(std::span(payload)), std::as_bytes(std::span(result_))));
    judged_ = request;
    result_ = payload;
    if (what.contains("somebody") && !check_.anyone())
      return Failed("nobody takes part: state 16 is set for no slot (R77)");
    return Status::Ok();
  }

  /// Steps all environments on and on; with `disabled` those whose episode is over are reset.
  Status Play(const Case& what) {
    for (int step = 0; step < what["steps"].get<int>(); ++step) {
      std::size_t ended = 0;
      for (std::size_t i = 0; i < blocks_.environments; ++i) ended += check_.over(i) ? 1 : 0;
      if (what.contains("until") && ended > 0) return Status::Ok();
      const bool reset = spec_.autoreset == protocol2::Autoreset::kDisabled && ended > 0;
      const std::string payload =
          reset ? payloads_.ResetWhere([&](std::size_t i) { return check_.over(i); }) : payloads_.Of("legal", result_);
      const std::uint64_t request = request_ + 1;
      CONSAC_RETURN_IF_ERROR(Ask(reset ? FrameType::kReset : FrameType::kStep, request, payload));
      const Status status = DoExpect({{"type", "RESULT"}, {"request", request}});
      if (!status.ok()) return {status.code(), fmt::format("at its step {}: {}", step + 1, status.message())};
    }
    over_ = over_ || what.contains("until");  // no episode ended
    return Status::Ok();
  }

  /// The engine may not have noticed yet that the connection is gone.
  Status Reconnect() {
    over_ = resume_.empty();  // a lost connection is the end of this engine's sessions, and it said so
    for (int attempt = 0; attempt < kReconnects && !over_; ++attempt) {
      CONSAC_RETURN_IF_ERROR(ConnectAgain());
      CONSAC_RETURN_IF_ERROR(SayHello());
      const Result<Frame> answer = Next();
      held_ = answer.ok() && answer->header.type == FrameType::kWelcome;
      if (held_) held_frame_ = *answer;  // for the step that expects it
      if (held_) return Status::Ok();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return over_ ? Status::Ok() : Failed("the session cannot be taken up again");
  }

  const Endpoint endpoint_;
  const std::string token_;
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_{protocol2::kLargestFrame};
  protocol2::SpecMessage spec_;
  protocol2::Blocks blocks_;
  Payloads payloads_;
  protocol2::ResultCheck check_;
  std::uint32_t session_ = 0;
  std::uint64_t request_ = 0, judged_ = 0;
  std::string resume_, result_;  // result_: the latest RESULT's payload
  Frame held_frame_;             // WELCOME of a session that was taken up, while held_
  bool crc_ = false, over_ = false, ended_ = false, held_ = false;
  std::map<std::string, std::string> kept_;
};

Status RunCase(const Case& entry, const Endpoint& endpoint, const std::string& token) {
  Conversation conversation(endpoint, token);
  CONSAC_RETURN_IF_ERROR(conversation.Connect());
  int number = 0;
  for (const Case& step : entry["steps"]) {
    ++number;
    const Status status = conversation.Do(step);
    if (!status.ok())
      return {status.code(), fmt::format("step {} ({}): {}", number, JsonText(step).substr(0, 80), status.message())};
    if (conversation.over()) break;
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
  for (const Case& entry : ReadCase(ConformanceServerCases())) {
    const ConformanceVerdict verdict{entry["name"], RulesText(entry["rules"]), RunCase(entry, endpoint, token)};
    failed += verdict.status.ok() ? 0 : 1;
    say(verdict);
  }
  return failed;
}

}  // namespace consac::cli
