#include "cli/conformance_engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "cli/conformance_requests.h"
#include "consac/base/json.h"
#include "consac/base/text.h"

namespace consac::cli {
namespace {

constexpr std::uint32_t kSessionNumber = 7;
constexpr const char* kResumeToken = "conformance";

bool IsMove(protocol2::FrameType type) {
  return type == protocol2::FrameType::kReset || type == protocol2::FrameType::kStep;
}

std::string TextOf(const protocol2::Frame& frame) {
  return {reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size()};
}

/// What an `expect` waits for.
std::string Wanted(const nlohmann::json& what) {
  return what.contains("moves") ? "RESET or STEP" : JsonText(what["type"]);
}

}  // namespace

EngineScript::EngineScript(Listener& listener, double patience_s, const Case& spec, const Case& results,
                           const std::string& autoreset)
    : listener_(listener), patience_(patience_s), spec_(spec), results_(results), autoreset_(autoreset) {
  spec_["autoreset"] = autoreset;
}

EngineScript::~EngineScript() {
  if (transport_ == nullptr) return;
  (void)Send(FrameType::kGoAway, 0, R"({"reason":"the next case"})");
  transport_->Close();
}

Status EngineScript::Accept() {
  Result<std::unique_ptr<Transport>> transport = listener_.Accept(patience_);
  if (!transport.ok()) return transport.status();
  if (*transport == nullptr)
    return {StatusCode::kUnavailable,
            fmt::format("no trainer has connected within {} s; start it while this listens, or raise --timeout",
                        patience_)};
  transport_ = std::move(*transport);
  reader_ = protocol2::FrameReader(protocol2::kLargestFrame);
  return Status::Ok();
}

Status EngineScript::AcceptAgain() {
  const Status status = Accept();
  return status.code() == StatusCode::kUnavailable ? Failed("the trainer does not come back: " + status.message())
                                                   : status;
}

Status EngineScript::Do(const Case& step) {
  if (step.contains("begin")) return Begin(step);
  if (step.contains("send")) return DoSend(step["send"]);
  if (step.contains("silent")) return Silent(step["silent"], true);
  if (step.contains("mute")) return Silent(step["mute"], false);
  if (step.contains("resume")) return AwaitResume(step["resume"]);
  if (step.contains("anew")) return AwaitAnew();
  if (step.contains("deserted")) return Desert();
  if (step.contains("fails")) return AwaitMending(step["fails"]);
  if (step.contains("relabels")) return AwaitRelabel(step["relabels"] == "or moves");
  return DoExpect(step["expect"]);
}

Status EngineScript::Begin(const Case& how) {
  may_resume_ = how.contains("may_resume");
  CONSAC_RETURN_IF_ERROR(DoExpect({{"type", "HELLO"}}));
  const Case welcome = how.value("welcome", Case::object());
  session_capabilities_ = welcome.value("capabilities", std::vector<std::string>());
  agreed_ = AgreedIn(session_capabilities_);
  relabels_ = protocol2::HasCapability(session_capabilities_, "relabel");
  CONSAC_RETURN_IF_ERROR(CheckNamed(session_capabilities_));
  CONSAC_RETURN_IF_ERROR(DoSend({{"type", "WELCOME"}, {"welcome", welcome}}));
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

Status EngineScript::CheckNamed(const std::vector<std::string>& capabilities) const {
  const std::string lacking = protocol2::LackingCapability(capabilities_, capabilities);
  return lacking.empty() ? Status::Ok()
                         : Status{StatusCode::kCancelled, "its HELLO does not name the capability " + lacking};
}

Status EngineScript::Answer(const std::string& payload) {
  result_ = payload;
  return Send(FrameType::kResult, request_, payload);
}

Status EngineScript::GoesOnOrLeaves() {
  const double deadline = Now() + kConformancePatience;
  while (true) {
    const Result<Frame> frame = Next(std::max(0.0, deadline - Now()));
    if (!frame.ok()) return Failed("the trainer neither goes on nor says BYE: " + frame.status().message());
    if (IsMove(frame->header.type)) return Status::Ok();
    if (frame->header.type == FrameType::kBye) {
      peeked_ = *frame;
      return ExpectClosed({{"bye", true}});
    }
    const Result<bool> aside = Take({{"moves", true}}, *frame);
    if (!aside.ok()) return aside.status();
  }
}

Status EngineScript::DoExpect(const Case& what) {
  if (what.contains("closed")) return ExpectClosed(what);
  const double deadline = Now() + kConformancePatience;  // a heartbeat between restarts no clock
  while (true) {
    const Result<Frame> frame = Next(std::max(0.0, deadline - Now()));
    if (!frame.ok() && frame.status().code() == StatusCode::kUnavailable && refused_) return EndsAtRefusal();
    if (!frame.ok()) return Failed(fmt::format("expected {}, but {}", Wanted(what), frame.status().message()));
    const Result<bool> taken = Take(what, *frame);
    if (!taken.ok()) return taken.status();
    if (*taken) return Status::Ok();
  }
}

Status EngineScript::Send(FrameType type, std::uint64_t request, const std::string& payload) {
  return Write(WholeFrame(type, request, kSessionNumber, payload, false));
}

Status EngineScript::Write(const std::string& bytes, const Case& how) {
  return writer_.Write(*transport_, how, bytes);
}

Status EngineScript::DoSend(const Case& what) {
  if (what.contains("hex")) return Write(FromHex(what["hex"]));
  std::string payload = what.value("text", "");
  if (what.contains("json")) payload = JsonText(what["json"]);
  if (what.contains("result")) result_ = payload = Fitted(what["result"]);
  if (what.contains("rewards")) payload = RewardsOf(relabelled_, what["rewards"]);
  if (what.contains("spec")) {
    Case spec = spec_;
    spec.update(what["spec"]);
    offered_ = payload = JsonText(spec);
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

std::string EngineScript::Fitted(const std::string& name) const {
  const Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(std::as_bytes(std::span(offered_)), agreed_);
  std::string payload = BytesOf(results_[name == "on" && last_type_ == FrameType::kReset ? "first" : name]);
  if (!spec.ok()) return payload;
  const protocol2::Blocks blocks(spec->env);
  if (relabels_ && payload.size() >= blocks.result_bytes) {  // every reward is 0, as the REWARDS that are right are
    const std::size_t rewards = blocks.environments * sizeof(double);
    payload.replace(blocks.behaviours[0].rewards, rewards, rewards, '\0');
  }
  if (name != "on") return payload;
  for (std::size_t i = 0; i < blocks.environments && IsMove(last_type_); ++i) {
    if (last_[protocol2::kActiveOffset + i] != 0 || result_.size() < blocks.result_bytes) continue;
    const protocol2::BehaviourBlocks& at = blocks.behaviours[0];  // of one agent
    payload.replace(at.rewards + i * sizeof(double), sizeof(double), sizeof(double), '\0');
    payload[at.states + i] = static_cast<char>(result_[at.states + i] & (protocol2::kFirst | protocol2::kActive));
  }
  return payload;
}

Result<protocol2::Frame> EngineScript::Next(double patience_s) {
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

Result<bool> EngineScript::Take(const Case& what, const Frame& frame) {
  const FrameType type = frame.header.type;
  const std::string payload = TextOf(frame);
  const bool awaited = what.contains("moves") ? IsMove(type) : type == FrameTypeOf(what["type"]);
  if (!awaited && type == FrameType::kPing) {
    CONSAC_RETURN_IF_ERROR(Send(FrameType::kPong, 0, payload));
    return false;
  }
  if (!awaited && (type == FrameType::kPong || (static_cast<std::uint16_t>(type) & protocol2::kOptionalType) != 0))
    return false;
  if (!awaited && type == FrameType::kBye && refused_) return EndsAtRefusal();
  if (!awaited) return Failed(fmt::format("expected {}, got {}", Wanted(what), FrameText(frame)));
  if (what.contains("text") && what["text"] != payload) return Failed("the payload is " + Quote(payload));
  if (type == FrameType::kHello) return TakeHello(frame);
  if (type == FrameType::kPong) return true;
  CONSAC_RETURN_IF_ERROR(CheckNumbers(frame.header));
  if (IsMove(type)) CONSAC_RETURN_IF_ERROR(CheckRequest(offered_, agreed_, frame, result_));
  request_ = frame.header.request;
  last_type_ = type;
  last_ = payload;
  if (what.contains("environments")) CONSAC_RETURN_IF_ERROR(CheckOrder(what));
  if (what.contains("seeds")) CONSAC_RETURN_IF_ERROR(CheckSeeds(what["seeds"] == true));
  return type == FrameType::kConfigure ? TakeConfigure(payload) : Result<bool>(true);
}

Status EngineScript::CheckOrder(const Case& what) const {
  Case chosen = Case::array();
  for (std::size_t i = 0; i < what["environments"].size(); ++i)
    chosen.push_back(std::to_integer<int>(static_cast<std::byte>(last_[protocol2::kActiveOffset + i])));
  const std::string asked = MoveText(FrameName(last_type_), chosen);
  const std::string wanted = MoveText(what["moves"], what["environments"]);
  return asked == wanted
             ? Status::Ok()
             : Status{StatusCode::kCancelled, fmt::format("request {} is {}, the case's {}", request_, asked, wanted)};
}

Status EngineScript::CheckSeeds(bool wanted) const {
  std::uint32_t flags = 0;
  std::memcpy(&flags, last_.data(), sizeof(flags));
  if (((flags & protocol2::kWithSeeds) != 0) == wanted) return Status::Ok();
  if (wanted) return {StatusCode::kCancelled, "its RESET has no seeds"};
  return Failed("a RESET with seeds again, though they were UNSUPPORTED (R47)");
}

Result<bool> EngineScript::TakeHello(const Frame& frame) {
  const Result<protocol2::Hello> hello = protocol2::ParseHello(frame.payload);
  if (!hello.ok()) return hello.status();
  if (hello->lowest > protocol2::kVersion || hello->highest < protocol2::kVersion)
    return Failed("HELLO's versions do not hold 2");
  max_frame_ = hello->max_frame;
  capabilities_ = hello->capabilities;
  if (hello->resume.empty() || resuming_) return true;
  const protocol2::ErrorMessage over{"AUTH_FAILED", true, "that session is over", {}, 0.0};
  CONSAC_RETURN_IF_ERROR(Send(FrameType::kError, 0, protocol2::EncodeError(over)));
  transport_->Close();
  CONSAC_RETURN_IF_ERROR(AcceptAgain());
  return false;
}

Result<bool> EngineScript::TakeConfigure(const std::string& payload) {
  const Result<protocol2::Configure> configure = protocol2::ParseConfigure(std::as_bytes(std::span(payload)));
  if (!configure.ok()) return configure.status();
  const std::string autoreset = ReadCase(payload).value("autoreset", "same_step");
  refused_ = autoreset != autoreset_;
  if (!refused_) return true;
  asked_.insert(autoreset);
  const protocol2::ErrorMessage no{"UNSUPPORTED", false, autoreset_ + " only", {}, 0.0};
  CONSAC_RETURN_IF_ERROR(Send(FrameType::kError, request_, protocol2::EncodeError(no)));
  return false;
}

Status EngineScript::EndsAtRefusal() const {
  return {StatusCode::kCancelled,
          fmt::format("it ends where its autoreset is refused, as it may (R81); have it ask for {}", autoreset_)};
}

Status EngineScript::CheckNumbers(const protocol2::FrameHeader& header) const {
  if (header.session != kSessionNumber)
    return Failed(fmt::format("session {} in its header, WELCOME said {} (R13)", header.session, kSessionNumber));
  if (header.request == request_ + 1) return Status::Ok();
  return Failed(fmt::format("request {} behind request {} (R10)", header.request, request_));
}

Status EngineScript::ExpectClosed(const Case& what) {
  bool bye = false, after = what.contains("after");
  const double deadline = Now() + kConformancePatience;
  while (true) {
    const Result<Frame> frame = Next(std::max(0.0, deadline - Now()));
    if (!frame.ok() && frame.status().code() == StatusCode::kUnavailable) {
      transport_ = nullptr;
      return bye || !what.contains("bye") ? Status::Ok() : Failed("the trainer left without BYE (R85)");
    }
    if (!frame.ok()) return Failed("the trainer stays: " + frame.status().message());
    const FrameType type = frame->header.type;
    bye = bye || type == FrameType::kBye;
    if (type == FrameType::kBye || type == FrameType::kPing || type == FrameType::kPong) continue;
    if (!after || !IsMove(type)) return Failed("the trainer goes on with " + FrameName(type));
    after = false;
  }
}

Status EngineScript::AwaitAnew() {
  CONSAC_RETURN_IF_ERROR(AcceptAgain());
  const Result<Frame> hello = Next();
  if (!hello.ok()) return hello.status();
  const Result<protocol2::Hello> said = protocol2::ParseHello(hello->payload);
  if (!said.ok()) return said.status();
  return said->resume.empty() ? Status::Ok() : Failed("it takes up a session that it has ended itself (R15)");
}

Status EngineScript::Desert() {
  constexpr double kLongestAnswer = 60.0;  // s, of a trainer to whom nobody said otherwise
  const double begun = Now();
  for (int steps = 0;; ++steps) {
    CONSAC_RETURN_IF_ERROR(Answer(BytesOf(results_["nobody"])));
    const double deadline = Now() + kConformancePatience;
    for (bool moves = false; !moves;) {
      const Result<Frame> frame = Next(std::max(0.0, deadline - Now()));
      if (!frame.ok()) return Failed("the trainer neither steps on nor says BYE: " + frame.status().message());
      if (frame->header.type == FrameType::kBye)
        return steps > 0 ? Status::Ok() : Failed("the trainer leaves at once where nobody takes part yet (R77)");
      const Result<bool> moved = Take({{"moves", true}}, *frame);
      if (!moved.ok()) return moved.status();
      moves = *moved;
    }
    if (Now() - begun > std::max(patience_, 2.0 * kLongestAnswer))
      return Failed(fmt::format("the trainer steps on for {:.0f} s though nobody takes part (R77)", Now() - begun));
    if (Now() - begun > patience_ && patience_ <= kLongestAnswer)
      return {StatusCode::kCancelled, "it waits for longer than --timeout"};
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

Status EngineScript::AwaitRelabel(bool or_moves) {
  constexpr int kMostMoves = 1000;  // whoever learns from goals has begun to by then
  const std::size_t environments = spec_["environments"].get<std::size_t>();
  int steps = 0;  // every third ends an episode: goals are of those that are over
  for (int moves = 0; moves < kMostMoves;) {
    const Result<Frame> frame = Next();
    if (!frame.ok()) return Failed("expected RESET, STEP or RELABEL, but " + frame.status().message());
    if (frame->header.type == FrameType::kBye) break;
    const bool relabels = frame->header.type == FrameType::kRelabel;
    const Result<bool> taken = Take(relabels ? Case{{"type", "RELABEL"}} : Case{{"moves", true}}, *frame);
    if (!taken.ok()) return taken.status();
    if (!*taken) continue;
    if (relabels) {
      const Result<std::int64_t> rows = RelabelledRows(offered_, last_, max_frame_);
      if (!rows.ok()) return Failed("its RELABEL is wrong: " + rows.status().message());
      relabelled_ = *rows;
      if (relabelled_ > 0) return Status::Ok();
      CONSAC_RETURN_IF_ERROR(Send(FrameType::kRewards, request_, ""));
      continue;
    }
    if (or_moves) return Status::Ok();
    ++moves;
    const bool all = last_.substr(protocol2::kActiveOffset, environments) == std::string(environments, '\1');
    const bool over = last_type_ == FrameType::kStep && all && ++steps % 3 == 0;
    CONSAC_RETURN_IF_ERROR(Answer(Fitted(over ? "over" : "on")));
  }
  return {StatusCode::kCancelled, "it has not asked what other goals would have paid"};
}

Status EngineScript::AwaitMending(const std::string& code) {
  constexpr int kMostRequests = 100;
  const std::size_t environments = spec_["environments"];
  std::string broken;  // environments: 1 where it needs a RESET
  for (int moves = 0; moves < kMostRequests;) {
    const Result<Frame> frame = Next();
    const bool left = !frame.ok() && frame.status().code() == StatusCode::kUnavailable;
    if (left || (frame.ok() && frame->header.type == FrameType::kBye)) {
      transport_->Close();
      transport_ = nullptr;
      return broken.empty() ? Failed("the trainer leaves before it has stepped") : Status::Ok();
    }
    if (!frame.ok()) return frame.status();
    const Result<bool> taken = Take({{"moves", true}}, *frame);
    if (!taken.ok()) return taken.status();
    if (!*taken) continue;
    ++moves;
    const std::string chosen = last_.substr(protocol2::kActiveOffset, environments);
    const std::size_t first = chosen.find('\1');
    if (broken.empty() && last_type_ == FrameType::kStep && first != std::string::npos) {
      broken = chosen;
      for (std::size_t i = 0; i < environments && code == "RESET_REQUIRED"; ++i) broken[i] = i == first ? '\1' : '\0';
      protocol2::ErrorMessage error{code, false, "environment " + std::to_string(first) + " needs a RESET", {}, 0.0};
      error.environment = static_cast<std::int64_t>(first);
      CONSAC_RETURN_IF_ERROR(Send(FrameType::kError, request_, protocol2::EncodeError(error)));
      continue;
    }
    for (std::size_t i = 0; i < broken.size(); ++i) {
      if (broken[i] == '\0' || chosen[i] == '\0') continue;
      if (last_type_ == FrameType::kStep)
        return Failed(fmt::format("environment {} is stepped, which needs a RESET since {} (R46, R81)", i, code));
      broken[i] = '\0';
    }
    if (!broken.empty() && broken.find('\1') == std::string::npos) return Answer(Fitted("on"));
    CONSAC_RETURN_IF_ERROR(Answer(Fitted("on")));
  }
  return {StatusCode::kCancelled, "it steps no environment, or none of those that need a RESET"};
}

Status EngineScript::Silent(double seconds, bool answers) {
  const double deadline = Now() + seconds;
  while (true) {
    const Result<Frame> frame = Next(std::max(0.0, deadline - Now()));
    if (!frame.ok()) return frame.status().code() == StatusCode::kDeadlineExceeded ? Status::Ok() : frame.status();
    if (frame->header.type != FrameType::kPing)
      return Failed(FrameName(frame->header.type) + " came before the answer (R10)");
    if (answers) CONSAC_RETURN_IF_ERROR(Send(FrameType::kPong, 0, TextOf(*frame)));
  }
}

Status EngineScript::AwaitResume(const Case& how) {
  const std::string before = last_;
  transport_->Close();
  CONSAC_RETURN_IF_ERROR(AcceptAgain());
  resuming_ = true;
  const Result<Frame> hello = Next();
  if (!hello.ok()) return hello.status();
  const Result<protocol2::Hello> said = protocol2::ParseHello(hello->payload);
  if (!said.ok()) return said.status();
  if (said->resume.empty()) return {StatusCode::kCancelled, "it does not resume, and need not"};
  if (said->resume != kResumeToken) return Failed("HELLO resumes with " + Quote(said->resume));
  const std::string lacking = protocol2::LackingCapability(said->capabilities, session_capabilities_);
  if (!lacking.empty()) return Failed("its HELLO takes the session up and does not name " + Quote(lacking) + " (R27)");
  if (how.is_object()) CONSAC_RETURN_IF_ERROR(CheckNamed(how.value("capabilities", std::vector<std::string>())));
  Case welcome = {
      {"resumed", true}, {"last_request", request_}, {"resume", kResumeToken}, {"capabilities", session_capabilities_}};
  if (how.is_object()) welcome.update(how);
  const bool right = welcome.erase("right") != 0 || !how.is_object();
  CONSAC_RETURN_IF_ERROR(DoSend({{"type", "WELCOME"}, {"welcome", welcome}}));
  if (!right) return Status::Ok();
  --request_;
  CONSAC_RETURN_IF_ERROR(DoExpect({{"moves", true}}));
  return last_ == before ? Status::Ok() : Failed("the request comes once more with other bytes (R24)");
}

}  // namespace consac::cli
