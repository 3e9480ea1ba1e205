#pragma once
// The engine's end of a conformance case, step by step. Every RESET and STEP that arrives is judged; RESULTs are those
// of the case.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "cli/conformance_frames.h"
#include "cli/conformance_requests.h"
#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"

namespace consac::cli {

inline constexpr std::uint32_t kSessionNumber = 7;
inline constexpr const char* kResumeToken = "conformance";

/// Bytes that a case cuts into pieces of hex.
inline std::string BytesOf(const nlohmann::json& pieces) {
  std::string bytes;
  for (const nlohmann::json& piece : pieces) bytes += FromHex(piece);
  return bytes;
}

/// One case under way: an engine that is driven step by step.
class EngineScript {
 public:
  using Case = nlohmann::json;
  using Frame = protocol2::Frame;
  using FrameType = protocol2::FrameType;

  EngineScript(Listener& listener, double patience_s, const Case& spec, const Case& results,
               const std::string& autoreset = "same_step")
      : listener_(listener), patience_(patience_s), spec_(spec), results_(results), autoreset_(autoreset) {
    spec_["autoreset"] = autoreset;
  }
  ~EngineScript() {
    if (transport_ == nullptr) return;
    (void)Send(FrameType::kGoAway, 0, R"({"reason":"the next case"})");
    transport_->Close();
  }

  Status Accept() {
    Result<std::unique_ptr<Transport>> transport = listener_.Accept(patience_);
    if (!transport.ok()) return transport.status();
    if (*transport == nullptr)
      return {StatusCode::kUnavailable, fmt::format("no trainer has connected for {} s", patience_)};
    transport_ = std::move(*transport);
    reader_ = protocol2::FrameReader(protocol2::kLargestFrame);
    return Status::Ok();
  }

  Status Do(const Case& step) {
    if (step.contains("begin")) return Begin(step);
    if (step.contains("send")) return DoSend(step["send"]);
    if (step.contains("silent")) return Silent(step["silent"], true);
    if (step.contains("mute")) return Silent(step["mute"], false);
    if (step.contains("resume")) return AwaitResume(step["resume"]);
    if (step.contains("anew")) return AwaitAnew();
    if (step.contains("deserted")) return Desert();
    return DoExpect(step["expect"]);
  }

  /// HELLO and CONFIGURE are answered; with "RESULT" RESET too.
  Status Begin(const Case& how) {
    may_resume_ = how.contains("may_resume");
    CONSAC_RETURN_IF_ERROR(DoExpect({{"type", "HELLO"}}));
    CONSAC_RETURN_IF_ERROR(DoSend({{"type", "WELCOME"}, {"welcome", how.value("welcome", Case::object())}}));
    CONSAC_RETURN_IF_ERROR(DoExpect({{"type", "CONFIGURE"}}));
    Case spec = how.value("spec", Case::object());
    if (how.contains("behaviour")) {
      spec["behaviours"] = spec_["behaviours"];
      spec["behaviours"][0].update(how["behaviour"]);
    }
    CONSAC_RETURN_IF_ERROR(DoSend({{"type", "SPEC"}, {"request", "answer"}, {"spec", spec}}));
    if (how["begin"] == "SPEC") return Status::Ok();
    CONSAC_RETURN_IF_ERROR(DoExpect({{"type", "RESET"}}));
    return Answer(BytesOf(results_["first"]));
  }

  /// A RESULT to the request that has come last.
  Status Answer(const std::string& payload) {
    result_ = payload;
    return Send(FrameType::kResult, request_, payload);
  }
  /// Whether the trainer's next request is a RESET or STEP (`to`) of just these environments, of all where none are
  /// named.
  Result<bool> Asks(const Case& answer) {
    for (Result<Frame> frame = Next();; frame = Next()) {
      if (!frame.ok()) return frame.status();
      const FrameType type = frame->header.type;
      if (type != FrameType::kReset && type != FrameType::kStep) {
        const Result<bool> aside = Take({{"type", answer["to"]}}, *frame);
        if (!aside.ok()) return aside.status();
        continue;
      }
      peeked_ = *frame;
      if (type != FrameTypeOf(answer["to"])) return false;
      const Case all = Case::array();
      const Case& chosen = answer.contains("environments") ? answer["environments"] : all;
      for (std::size_t i = 0; i < spec_["environments"]; ++i) {
        const std::size_t at = protocol2::kActiveOffset + i;
        const int wanted = chosen.empty() ? 1 : chosen[i].get<int>();
        if (at >= frame->payload.size() || std::to_integer<int>(frame->payload[at]) != wanted) return false;
      }
      return true;
    }
  }
  /// Another STEP or RESET comes.
  Status GoesOn() {
    const Result<bool> asks = Asks({{"to", "STEP"}});
    return asks.ok() ? Status::Ok() : asks.status();
  }
  /// That, or it leaves with BYE.
  Status GoesOnOrLeaves() {
    while (true) {
      const Result<Frame> frame = Next();
      if (!frame.ok()) return Failed("the trainer neither goes on nor says BYE: " + frame.status().message());
      peeked_ = *frame;
      if (frame->header.type == FrameType::kBye) return ExpectClosed({{"bye", true}});
      if (frame->header.type != FrameType::kPing && frame->header.type != FrameType::kPong) return GoesOn();
      const Result<bool> aside = Take({{"type", "STEP"}}, *std::exchange(peeked_, std::nullopt));
      if (!aside.ok()) return aside.status();
    }
  }
  /// What the trainer has asked for last, "STEP of 1 0".
  std::string Asked() const {
    if (!peeked_.has_value()) return "nothing";
    std::string text = FrameName(peeked_->header.type) + " of";
    for (std::size_t i = 0; i < spec_["environments"] && protocol2::kActiveOffset + i < peeked_->payload.size(); ++i)
      text += fmt::format(" {}", std::to_integer<int>(peeked_->payload[protocol2::kActiveOffset + i]));
    return text;
  }
  /// Other ways to begin an episode that the trainer has asked for.
  const std::set<std::string>& asked() const { return asked_; }
  Status DoExpect(const Case& what) {
    if (what.contains("closed")) return ExpectClosed(what);
    while (true) {
      const Result<Frame> frame = Next();
      if (!frame.ok())
        return Failed(fmt::format("expected {}, but {}", JsonText(what["type"]), frame.status().message()));
      const Result<bool> taken = Take(what, *frame);
      if (!taken.ok()) return taken.status();
      if (*taken) return Status::Ok();
    }
  }

 private:
  Status Send(FrameType type, std::uint64_t request, const std::string& payload) {
    return Write(WholeFrame(type, request, kSessionNumber, payload, false));
  }
  Status Write(const std::string& bytes, const Case& how = Case::object()) {
    return writer_.Write(*transport_, how, bytes);
  }

  Status DoSend(const Case& what) {
    if (what.contains("hex")) return Write(FromHex(what["hex"]));
    std::string payload = what.value("text", "");
    if (what.contains("json")) payload = JsonText(what["json"]);
    if (what.contains("result")) result_ = payload = Fitted(what["result"]);
    if (what.contains("spec")) {
      Case spec = spec_;
      spec.update(what["spec"]);
      payload = JsonText(spec);
    }
    if (what.contains("welcome")) {
      Case welcome = {{"protocol", 2},
                      {"session", kSessionNumber},
                      {"resume", may_resume_ ? kResumeToken : ""},
                      {"max_frame", max_frame_}};
      welcome.update(what["welcome"]);
      payload = JsonText(welcome);
    }
    payload.resize(std::max(payload.size(), what.value("blanks", std::size_t{0})), ' ');
    const bool answers = what.contains("result") || what.value("request", Case()) == "answer";
    const Case& number = what.contains("request") ? what["request"] : Case();
    const std::uint64_t request = number.is_number() ? number.get<std::uint64_t>() : answers ? request_ : 0;
    return Write(WholeFrame(FrameTypeOf(what["type"]), request, kSessionNumber, payload, false, what), what);
  }

  /// One of the file's RESULTs. "on" steps all; of environments that the trainer has not stepped it says what was.
  std::string Fitted(const std::string& name) const {
    std::string payload = BytesOf(results_[name]);
    const std::string text = JsonText(spec_);
    const Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(std::as_bytes(std::span(text)));
    if (name != "on" || !spec.ok()) return payload;
    const protocol2::Blocks blocks(spec->env);
    for (std::size_t i = 0; i < blocks.environments && last_.size() == blocks.step_bytes; ++i) {
      if (last_[protocol2::kActiveOffset + i] != 0 || result_.size() < blocks.result_bytes) continue;
      const protocol2::BehaviourBlocks& at = blocks.behaviours[0];  // of one agent
      payload.replace(at.rewards + i * sizeof(double), sizeof(double), sizeof(double), '\0');
      payload[at.states + i] = static_cast<char>(result_[at.states + i] & (protocol2::kFirst | protocol2::kActive));
    }
    return payload;
  }

  /// The next frame of any kind; kUnavailable once the trainer is gone.
  Result<Frame> Next(double patience_s = kConformancePatience) {
    if (peeked_.has_value()) return *std::exchange(peeked_, std::nullopt);
    const double deadline = Now() + patience_s;
    while (true) {
      Frame frame;
      const Result<bool> whole = reader_.Next(&frame);
      if (!whole.ok()) return whole.status();
      if (*whole) return frame;
      const Result<std::size_t> count = transport_->Read(reader_.Writable(), deadline - Now());
      if (!count.ok()) return count.status();
      if (*count == 0) return Status{StatusCode::kDeadlineExceeded, fmt::format("nothing came for {} s", patience_s)};
      reader_.Commit(*count);
    }
  }

  /// True when it was the frame that is waited for; false when it may come between.
  Result<bool> Take(const Case& what, const Frame& frame) {
    const FrameType type = frame.header.type;
    const std::string payload(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size());
    const bool awaited = type == FrameTypeOf(what["type"]);
    if (!awaited && type == FrameType::kPing) {
      CONSAC_RETURN_IF_ERROR(Send(FrameType::kPong, 0, payload));
      return false;
    }
    if (!awaited && (type == FrameType::kPong || (static_cast<std::uint16_t>(type) & protocol2::kOptionalType) != 0))
      return false;
    if (!awaited) return Failed(fmt::format("expected {}, got {}", JsonText(what["type"]), FrameText(frame)));
    if (what.contains("text") && payload != what["text"]) return Failed("the payload is " + Quote(payload));
    if (type == FrameType::kHello) return TakeHello(frame);
    if (type == FrameType::kPong) return true;
    CONSAC_RETURN_IF_ERROR(CheckNumbers(frame.header));
    if (type == FrameType::kReset || type == FrameType::kStep)
      CONSAC_RETURN_IF_ERROR(CheckRequest(spec_, frame, result_));
    request_ = frame.header.request;
    last_ = payload;
    return type == FrameType::kConfigure ? TakeConfigure(payload) : Result<bool>(true);
  }

  /// One that would resume a session of another case begins anew.
  Result<bool> TakeHello(const Frame& frame) {
    const Result<protocol2::Hello> hello = protocol2::ParseHello(frame.payload);
    if (!hello.ok()) return hello.status();
    if (hello->lowest > protocol2::kVersion || hello->highest < protocol2::kVersion)
      return Failed("HELLO's versions do not hold 2");
    max_frame_ = hello->max_frame;
    if (hello->resume.empty() || resuming_) return true;
    const protocol2::ErrorMessage over{"AUTH_FAILED", true, "that session is over", {}, 0.0};
    CONSAC_RETURN_IF_ERROR(Send(FrameType::kError, 0, protocol2::EncodeError(over)));
    transport_->Close();
    CONSAC_RETURN_IF_ERROR(Accept());
    return false;
  }

  /// Other ways than the case's are refused; a trainer may then ask anew.
  Result<bool> TakeConfigure(const std::string& payload) {
    const Result<protocol2::Configure> configure = protocol2::ParseConfigure(std::as_bytes(std::span(payload)));
    if (!configure.ok()) return configure.status();
    const std::string autoreset = ReadCase(payload).value("autoreset", "same_step");
    if (autoreset == autoreset_) return true;
    asked_.insert(autoreset);
    const protocol2::ErrorMessage no{"UNSUPPORTED", false, autoreset_ + " only", {}, 0.0};
    CONSAC_RETURN_IF_ERROR(Send(FrameType::kError, request_, protocol2::EncodeError(no)));
    return false;
  }

  Status CheckNumbers(const protocol2::FrameHeader& header) const {
    if (header.session != kSessionNumber)
      return Failed(fmt::format("session {} in its header, WELCOME said {} (R13)", header.session, kSessionNumber));
    if (header.request == request_ + 1) return Status::Ok();
    return Failed(fmt::format("request {} behind request {} (R10)", header.request, request_));
  }

  /// The trainer leaves without another request; BYE and PING are none. `bye`: it says so. `after`: one request of that
  /// type may have been on its way.
  Status ExpectClosed(const Case& what) {
    bool bye = false, after = what.contains("after");
    while (true) {
      const Result<Frame> frame = Next();
      if (!frame.ok() && frame.status().code() == StatusCode::kUnavailable) {
        transport_ = nullptr;
        return bye || !what.contains("bye") ? Status::Ok() : Failed("the trainer left without BYE (R85)");
      }
      if (!frame.ok()) return Failed("the trainer stays: " + frame.status().message());
      const FrameType type = frame->header.type;
      bye = bye || type == FrameType::kBye;
      if (type == FrameType::kBye || type == FrameType::kPing || type == FrameType::kPong) continue;
      if (!after || type != FrameTypeOf(what["after"])) return Failed("the trainer goes on with " + FrameName(type));
      after = false;
    }
  }

  /// The trainer, which has ended the session itself, begins a new one.
  Status AwaitAnew() {
    CONSAC_RETURN_IF_ERROR(Accept());
    const Result<Frame> hello = Next();
    if (!hello.ok()) return hello.status();
    const Result<protocol2::Hello> said = protocol2::ParseHello(hello->payload);
    if (!said.ok()) return said.status();
    return said->resume.empty() ? Status::Ok() : Failed("it takes up a session that it has ended itself (R15)");
  }

  /// RESULT after RESULT nobody takes part; the trainer goes on for a while, then leaves with BYE (R77). How long an
  /// answer may take is the trainer's own affair: one that waits for longer than we do is not judged, up to 60 s.
  Status Desert() {
    constexpr double kLongestAnswer = 60.0;  // s, of a trainer to whom nobody said otherwise
    const double begun = Now();
    for (int steps = 0;; ++steps) {
      CONSAC_RETURN_IF_ERROR(Answer(BytesOf(results_["nobody"])));
      Result<bool> step = false;
      while (step.ok() && !*step) {
        const Result<Frame> frame = Next();
        if (!frame.ok()) return Failed("the trainer neither steps on nor says BYE: " + frame.status().message());
        if (frame->header.type == FrameType::kBye)
          return steps > 0 ? Status::Ok() : Failed("the trainer leaves at once where nobody takes part yet (R77)");
        step = Take({{"type", "STEP"}}, *frame);
      }
      if (!step.ok()) return step.status();
      if (Now() - begun > std::max(patience_, 2.0 * kLongestAnswer))
        return Failed(fmt::format("the trainer steps on for {:.0f} s though nobody takes part (R77)", Now() - begun));
      if (Now() - begun > patience_ && patience_ <= kLongestAnswer)
        return {StatusCode::kCancelled, "it waits for longer than --timeout"};
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  /// PING is answered all the while, or nothing is.
  Status Silent(double seconds, bool answers) {
    const double deadline = Now() + seconds;
    while (true) {
      const Result<Frame> frame = Next(std::max(0.0, deadline - Now()));
      if (!frame.ok()) return frame.status().code() == StatusCode::kDeadlineExceeded ? Status::Ok() : frame.status();
      if (frame->header.type != FrameType::kPing)
        return Failed(FrameName(frame->header.type) + " came before the answer (R10)");
      const std::string payload(reinterpret_cast<const char*>(frame->payload.data()), frame->payload.size());
      if (answers) CONSAC_RETURN_IF_ERROR(Send(FrameType::kPong, 0, payload));
    }
  }

  /// The connection breaks; the trainer comes back and repeats its request. `how`: true, or members that are wrong in
  /// the WELCOME that it gets.
  Status AwaitResume(const Case& how) {
    const std::string before = last_;
    transport_->Close();
    CONSAC_RETURN_IF_ERROR(Accept());
    resuming_ = true;
    const Result<Frame> hello = Next();
    if (!hello.ok()) return hello.status();
    const Result<protocol2::Hello> said = protocol2::ParseHello(hello->payload);
    if (!said.ok()) return said.status();
    if (said->resume.empty()) return {StatusCode::kCancelled, "it does not resume, and need not"};
    if (said->resume != kResumeToken) return Failed("HELLO resumes with " + Quote(said->resume));
    Case welcome = {{"resumed", true}, {"last_request", request_}, {"resume", kResumeToken}};
    if (how.is_object()) welcome.update(how);
    CONSAC_RETURN_IF_ERROR(DoSend({{"type", "WELCOME"}, {"welcome", welcome}}));
    if (how.is_object()) return Status::Ok();
    --request_;
    CONSAC_RETURN_IF_ERROR(DoExpect({{"type", "STEP"}}));
    return last_ == before ? Status::Ok() : Failed("the request comes once more with other bytes (R24)");
  }

  Listener& listener_;
  const double patience_;
  Case spec_;
  const Case results_;
  const std::string autoreset_;
  std::set<std::string> asked_;
  CaseWriter writer_;
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_;
  std::optional<Frame> peeked_;                       // has been looked at and not been taken
  std::size_t max_frame_ = protocol2::kLargestFrame;  // HELLO's
  std::uint64_t request_ = 0;
  std::string last_, result_;  // payloads of the latest request and the latest RESULT
  bool may_resume_ = false, resuming_ = false;
};

}  // namespace consac::cli
