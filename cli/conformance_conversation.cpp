#include "cli/conformance_conversation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "cli/conformance_answers.h"
#include "consac/base/json.h"
#include "consac/base/text.h"

namespace consac::cli {

Conversation::~Conversation() {
  if (transport_ == nullptr) return;
  if (ended_ && !resume_.empty()) (void)TakeUp();
  (void)Send(FrameType::kBye, 0, "");
  transport_->Close();
}

Status Conversation::Connect() {
  Result<std::unique_ptr<Transport>> transport = ConnectTcp(endpoint_, 3.0);
  if (!transport.ok()) return transport.status();
  transport_ = std::move(*transport);
  reader_ = protocol2::FrameReader(protocol2::kLargestFrame);
  return Status::Ok();
}

Status Conversation::Do(const Case& step) {
  if (step.contains("send")) return DoSend(step["send"]);
  if (step.contains("play")) return Play(step["play"]);
  if (step.contains("reconnect")) return Reconnect(step["reconnect"]);
  if (step.contains("connect")) return ConnectAgain();
  if (step.contains("beside")) return KnockBeside();
  if (step.contains("wait")) return Wait(step["wait"]);
  if (step.contains("half_close")) {
    transport_->CloseWriting();
    return Status::Ok();
  }
  return DoExpect(step["expect"]);
}

Status Conversation::Wait(double seconds) {
  if (patience_s_ <= kConformancePatience) return Over(fmt::format("it takes {:g} s; give --timeout 11", seconds));
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  return Status::Ok();
}

Status Conversation::Send(FrameType type, std::uint64_t request, const std::string& payload, const Case& how) {
  const std::uint32_t session = how.contains("no_session")      ? 0
                                : how.contains("other_session") ? session_ + 1
                                                                : session_;
  return writer_.Write(*transport_, how, WholeFrame(type, request, session, payload, crc_, how));
}

Status Conversation::TakeUp() {
  CONSAC_RETURN_IF_ERROR(ConnectAgain());
  CONSAC_RETURN_IF_ERROR(SayHello(capabilities_));
  return Next().status();
}

Status Conversation::SayHello(const std::vector<std::string>& capabilities) {
  Case hello = {{"protocol", {2, 2}}, {"client", "conformance"}, {"resume", resume_}, {"capabilities", capabilities}};
  if (!token_.empty()) hello["token"] = token_;
  return Send(FrameType::kHello, 0, JsonText(hello));
}

Status Conversation::ConnectAgain() {
  if (transport_ != nullptr) transport_->Close();
  session_ = 0;
  crc_ = false;
  return Connect();
}

Status Conversation::KnockBeside() const {
  Conversation other(endpoint_, token_, patience_s_);
  CONSAC_RETURN_IF_ERROR(other.Connect());
  CONSAC_RETURN_IF_ERROR(other.SayHello());
  const Result<Frame> answer = other.Next();
  if (!answer.ok()) return Failed("a second HELLO: " + answer.status().message());
  if (answer->header.type == FrameType::kWelcome) return Status::Ok();
  const Result<protocol2::ErrorMessage> error = protocol2::ParseError(answer->payload);
  const bool full = answer->header.type == FrameType::kError && error.ok() && error->code == "CAPACITY";
  return full ? Status::Ok() : Failed("a second HELLO is answered with neither WELCOME nor CAPACITY");
}

std::string Conversation::TokenOf(const Case& what) const {
  const std::string instead = what.value("token", "");
  if (token_.empty() || instead.empty()) return token_;
  return instead == "none" ? "" : instead;
}

Status Conversation::DoSend(const Case& what) {
  if (what.contains("token") && token_.empty()) return Over("no --token was given");
  if (what.contains("hex"))
    return writer_.Write(*transport_, what, FromHex(what["hex"]) + std::string(what.value("zeros", 0u), '\0'));
  std::string payload;
  if (what.contains("json")) {
    Case value = what["json"];
    const std::string token = TokenOf(what);
    if (what["type"] == "HELLO" && !token.empty()) value["token"] = token;
    if (value.value("max_frame", Case()) == "too small") {
      if (payloads_.longest() < protocol2::kLargestBeforeWelcome + 8) return Over("its frames are short");
      value["max_frame"] = payloads_.longest() - 8;
    }
    if (what.contains("resume") && resume_.empty()) return Over(kKeepsNone);
    if (what.contains("resume")) value["resume"] = resume_;
    if (what.contains("expect")) value["expect"] = Expected(what["expect"], offered_);
    payload = JsonText(value);
  }
  if (what.contains("text")) payload = what["text"];
  const bool hello = what.contains("text") && what["type"] == "HELLO" && payload.starts_with("{");
  if (hello && !token_.empty()) payload.insert(1, "\"token\":" + JsonText(Case(token_)) + ",");
  const std::string kind = what.value("payload", ""), leaf = what.value("leaf", "");
  if (kind.starts_with("illegal") && !payloads_.CanBeIllegal(leaf))
    return Over("no action can be outside its space" + (leaf.empty() ? "" : " by a " + leaf));
  const std::string how = HowItSets(kind), moved = kind.substr(0, kind.find(kSet));
  if (Payloads::IsSpoilt(moved)) {
    world_at_fault_ = payloads_.WorldAtFault(moved, result_, leaf);
    if (world_at_fault_ < 0)
      return Over("nobody takes part whose action can be " + (leaf.empty() ? moved : moved + " by a " + leaf));
  }
  if (agreed_.parameters && !how.empty() && !CanBeSet(spec_.env.parameters, how))
    return Over("no parameter can be set to " + how);
  if (IsWrongSetting(how)) world_at_fault_ = IsOfFirst(how) ? 0 : payloads_.last_world();
  if (kind == "goals, as they were") {
    if (paid_.empty()) return Over("no step has led to a row of a behaviour with goals");
    payload = payloads_.GoalsAsTheyWere(paid_rows_);
  } else if (kind.starts_with("goals") && !payloads_.CanBeAsked(kind)) {
    return Over(kind == "goals of others"     ? "every behaviour has goals"
                : kind == "goals of the last" ? "no two behaviours have goals"
                                              : "no observation has such a number");
  } else if (!kind.empty()) {
    payload = payloads_.Of(kind, result_, leaf);
  }
  payload.resize(std::max(payload.size(), what.value("blanks", std::size_t{0})), ' ');
  const std::uint64_t request = what["request"] == "next"    ? request_ + 1
                                : what["request"] == "again" ? request_
                                                             : what["request"].get<std::uint64_t>();
  return Ask(FrameTypeOf(what["type"]), request, payload, what);
}

Status Conversation::Over(const std::string& why) {
  over_ = why;
  return Status::Ok();
}

Status Conversation::Ask(FrameType type, std::uint64_t request, const std::string& payload, const Case& how) {
  const bool whole = payload.size() >= protocol2::kActiveOffset + blocks_.environments;
  if ((type == FrameType::kReset || type == FrameType::kStep) && whole && request != judged_)
    check_.Ask(type, std::as_bytes(std::span(payload)).subspan(protocol2::kActiveOffset));
  const auto is_chosen = [](char chosen) { return chosen == 1; };
  all_stepped_ = type == FrameType::kStep && whole &&
                 std::all_of(payload.begin() + protocol2::kActiveOffset,
                             payload.begin() + protocol2::kActiveOffset + blocks_.environments, is_chosen);
  if (type == FrameType::kRelabel) relabelled_ = Payloads::RowsOf(payload);
  if (request == request_ + 1 && type != FrameType::kHello) request_ = request;
  return Send(type, request, payload, how);
}

Result<protocol2::Frame> Conversation::Next() {
  if (std::exchange(held_, false)) return held_frame_;
  const double deadline = Now() + patience_s_;
  bool paused = false;
  while (true) {
    Frame frame;
    const Result<bool> whole = reader_.Next(&frame);
    if (!whole.ok()) return whole.status();
    if (*whole) {
      const Result<bool> aside = IsAside(frame, &paused);
      if (!aside.ok()) return aside.status();
      if (!*aside) return frame;
      if (Now() > deadline) return Silent(paused);
      continue;
    }
    const Result<std::size_t> count = transport_->Read(reader_.Writable(), std::max(0.0, deadline - Now()));
    if (!count.ok()) return count.status();
    if (*count == 0 && Now() >= deadline) return Silent(paused);
    reader_.Commit(*count);
  }
}

Status Conversation::Silent(bool paused) const {
  return Failed(fmt::format("no answer within {} s", patience_s_) +
                (paused ? ": the server says PAUSED and no RESUMED; end its pause, or raise --timeout" : ""));
}

Result<bool> Conversation::IsAside(const Frame& frame, bool* paused) {
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
  if (type == FrameType::kPong)  // one that nobody asked for may come too (R10)
    return std::string_view(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size()) != pong_;
  return (static_cast<std::uint16_t>(type) & protocol2::kOptionalType) != 0;
}

Status Conversation::ExpectGone(Transport& connection, double seconds) const {
  std::array<std::byte, 4096> thrown_away;
  const double deadline = Now() + seconds;
  while (Now() < deadline) {
    const Result<std::size_t> count = connection.Read(thrown_away, std::max(0.0, deadline - Now()));
    if (!count.ok()) return Status::Ok();
  }
  return Failed(fmt::format("the connection stays open for {:g} s", seconds));
}

Status Conversation::DoExpect(const Case& what) {
  if (what.contains("gone")) return ExpectGone(*transport_, what.value("within", patience_s_));
  pong_ = what.contains("type") && what["type"] == "PONG" ? std::optional<std::string>(what["text"]) : std::nullopt;
  const Result<Frame> frame = Next();
  if (what.contains("closed")) {
    const bool closed = !frame.ok() && frame.status().code() == StatusCode::kUnavailable;
    ended_ = true;
    return closed ? Status::Ok() : Failed("the connection stays open");
  }
  if (!frame.ok()) return Failed(fmt::format("expected {}, but {}", JsonText(what["type"]), frame.status().message()));
  const std::string payload(reinterpret_cast<const char*>(frame->payload.data()), frame->payload.size());
  if (Refuses(*frame, what.value("unless", ""))) return Over("it answers " + FrameText(*frame));
  if (Refuses(*frame, what.value("or", ""))) return Status::Ok();
  if (frame->header.type != FrameTypeOf(what["type"])) {
    return Failed(fmt::format("expected {}, got {}", JsonText(what["type"]), FrameText(*frame)));
  }
  if (what.contains("request") && frame->header.request != what["request"])
    return Failed(
        fmt::format("the answer is to request {}, expected {}", frame->header.request, JsonText(what["request"])));
  if (what.contains("crc") && crc_ && !frame->header.checked) return Failed("crc was agreed, but flag 1 is not set");
  if (what.contains("text") && what["text"] != payload) return Failed("the payload is " + Quote(payload));
  CONSAC_RETURN_IF_ERROR(
      Compare(what, payload, frame->header.type == FrameType::kResult ? results_.LookedAt(payload) : payload));
  return CheckMessage(what, *frame, payload);
}

Status Conversation::CheckMessage(const Case& what, const Frame& frame, const std::string& payload) {
  if (frame.header.type == FrameType::kSpec) return TakeSpec(what, frame);
  if (frame.header.type == FrameType::kResult) return TakeResult(frame.header.request, payload);
  if (frame.header.type == FrameType::kRewards) return TakeRewards(what, payload);
  if (frame.header.type != FrameType::kError && frame.header.type != FrameType::kWelcome) return Status::Ok();
  Case message = ReadCase(payload);
  if (!message.is_object()) return Failed("its payload is no JSON object");
  if (frame.header.type == FrameType::kError && payload.size() > protocol2::kLargestBeforeWelcome)
    return Failed(fmt::format("an ERROR of {} bytes, at most 4096 are sent: cut its message (R17)", payload.size()));
  if (frame.header.type == FrameType::kError) CONSAC_RETURN_IF_ERROR(protocol2::ParseError(frame.payload).status());
  if (frame.header.type == FrameType::kWelcome) {
    CONSAC_RETURN_IF_ERROR(TakeWelcome(frame));
    Case defaults = {{"capabilities", Case::array()},
                     {"max_frame", protocol2::kLargestFrame},
                     {"last_request", 0},
                     {"resumed", false}};
    defaults.update(message);
    message = defaults;
  }
  CheckNeeds(what, message);
  CONSAC_RETURN_IF_ERROR(CheckMembers(what, message));
  if (!what.contains("env")) return Status::Ok();
  const Case env = message.value("env", Case());
  if (what["env"] == "none") return message.contains("env") ? Failed("it has an env") : Status::Ok();
  if (!env.is_number_integer()) return Failed("it has no env");
  if (what["env"] == "first" && env != world_at_fault_)
    return Failed(fmt::format("env is {}, at fault is {}", JsonText(env), world_at_fault_));
  return Status::Ok();
}

void Conversation::CheckNeeds(const Case& what, Case message) {
  const Case needs = what.value("needs", Case::object());
  for (const auto& [key, range] : needs.items()) {
    if (range.contains("has")) {
      for (const Case& one : range["has"].is_array() ? range["has"] : Case::array({range["has"]})) {
        const bool has = std::ranges::find(message[key], one) != message[key].end();
        if (!has) over_ = fmt::format("its {} lack {}", key, JsonText(one));
      }
      continue;
    }
    if (message[key] < range["from"] || message[key] > range["to"])
      over_ = fmt::format("{} is {}", key, JsonText(message[key]));
  }
}

Status Conversation::TakeWelcome(const Frame& frame) {
  const Result<protocol2::Welcome> welcome = protocol2::ParseWelcome(frame.payload);
  if (!welcome.ok()) return welcome.status();
  if (welcome->resumed && (welcome->session != welcomed_ || welcome->resume != resume_))
    return Failed("a session that is taken up keeps its number and its resume (R24)");
  const std::string lost = protocol2::LackingCapability(welcome->capabilities, capabilities_);
  const std::string gained = protocol2::LackingCapability(capabilities_, welcome->capabilities);
  if (welcome->resumed && !lost.empty())
    return Failed("the session is taken up without its capability " + Quote(lost) + " (R27)");
  if (welcome->resumed && !gained.empty())
    return Failed("the session is taken up with capability " + Quote(gained) + ", which it has not (R27)");
  session_ = welcomed_ = welcome->session;
  resume_ = welcome->resume;
  limit_ = welcome->max_frame;
  reader_.SetLimit(limit_);
  crc_ = protocol2::HasCapability(welcome->capabilities, "crc");
  capabilities_ = welcome->capabilities;
  agreed_ = AgreedIn(capabilities_);
  return Status::Ok();
}

Status Conversation::TakeSpec(const Case& what, const Frame& frame) {
  Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(frame.payload, agreed_);
  if (!spec.ok()) return spec.status();
  spec_ = std::move(*spec);
  blocks_ = protocol2::Blocks(spec_.env);
  payloads_ = Payloads(spec_.env);
  results_ = Results(spec_.env);
  if (payloads_.longest() > limit_)
    return Failed(fmt::format("STEP or RESULT has up to {} bytes, max_frame is {}: CONFIGURE is UNSUPPORTED (R34)",
                              payloads_.longest(), limit_));
  check_ = protocol2::ResultCheck(spec_.env, spec_.autoreset, protocol2::Numbers::kJudged, agreed_);
  const Case said = ReadCase({reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size()});
  offered_ = said.value("behaviours", Case());
  CheckNeeds(what, said);
  const std::string autoreset = said.value("autoreset", "same_step"), asked = what.value("autoreset", "same_step");
  return autoreset == asked ? Status::Ok() : Failed("SPEC's autoreset is " + autoreset + ", asked for was " + asked);
}

Status Conversation::TakeResult(std::uint64_t request, const std::string& payload) {
  if (request == judged_) return Status::Ok();
  CONSAC_RETURN_IF_ERROR(check_.Judge(std::as_bytes(std::span(payload)), std::as_bytes(std::span(result_))));
  judged_ = request;
  result_ = payload;
  if (all_stepped_ && paid_.size() < kMostPaid) payloads_.AddPaid(result_, &paid_rows_, &paid_);
  return Status::Ok();
}

Status Conversation::TakeRewards(const Case& what, const std::string& payload) const {
  std::vector<float> rewards(static_cast<std::size_t>(relabelled_));
  CONSAC_RETURN_IF_ERROR(protocol2::ReadRewards(std::as_bytes(std::span(payload)), relabelled_, rewards.data()));
  const auto is_close = [&](std::size_t i, double paid) {
    return std::fabs(static_cast<double>(rewards[i]) - paid) <= 1e-4 + 1e-4 * std::fabs(paid);
  };
  for (std::size_t i = 0; what.contains("paid") && i < rewards.size(); ++i) {
    if (!is_close(i, paid_[i]))
      return Failed(fmt::format("row {} is as a RESULT brought it, which paid {}, and REWARDS says {} (R96)", i,
                                paid_[i], rewards[i]));
  }
  for (std::size_t i = 0; what.contains("alike") && i < rewards.size(); ++i) {
    if (!is_close(i, static_cast<double>(rewards[0])))
      return Failed(
          fmt::format("row {} is the same as row 0, and is paid {} and not {} (R97)", i, rewards[i], rewards[0]));
  }
  return Status::Ok();
}

Status Conversation::Reconnect(const Case& how) {
  if (resume_.empty()) return Over(kKeepsNone);
  std::unique_ptr<Transport> before;
  if (how == "beside") before = std::move(transport_);
  for (int attempt = 0; attempt < kMostReconnects; ++attempt) {
    CONSAC_RETURN_IF_ERROR(ConnectAgain());
    std::vector<std::string> named = capabilities_;
    for (const Case& also : how.is_object() ? how["also"] : Case::array()) named.push_back(also.get<std::string>());
    CONSAC_RETURN_IF_ERROR(SayHello(named));
    const Result<Frame> answer = Next();
    held_ = answer.ok() && answer->header.type == FrameType::kWelcome;
    if (held_) held_frame_ = *answer;  // for the step that expects it
    if (held_) return before == nullptr ? Status::Ok() : ExpectGone(*before, patience_s_);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return Failed("the session cannot be taken up again");
}

}  // namespace consac::cli
