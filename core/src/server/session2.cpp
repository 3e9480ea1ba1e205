// A session's connection: how it comes, breaks and comes again, in memory or not; what is sent, and in what time.
#include "server/session2.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "base/entropy.h"
#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/protocol/relabel.h"
#include "server/limits.h"
#include "server/secret.h"

namespace consac {
namespace {

using protocol2::Fault;
using protocol2::Frame;
using protocol2::FrameHeader;
using protocol2::FrameType;

constexpr std::size_t kTokenBytes = 16;

}  // namespace

Status Session2Server::Connect(Arrival arrival) {
  LeaveSharedMemory();
  if (transport_ != nullptr) transport_->Close();
  outbox_.Clear();
  transport_ = std::move(arrival.transport);
  reader_ = std::move(arrival.reader);
  connected_ = true;
  if (under_way_ == UnderWay::kWaitsForTime) {  // was asked for, but not carried out: it may be asked for again
    --request_;
    under_way_ = UnderWay::kNothing;
  }
  finished_ = through_memory_ = refused_ = damaged_ = false;
  connected_at_ = arrival.since;
  last_heard_ = Now();

  protocol2::Welcome welcome;
  welcome.resumed = !arrival.hello.resume.empty();
  if (!welcome.resumed) {
    number_ = arrival.number;
    request_ = 0;
    answer_.clear();
    answer_is_result_ = false;
    stepper_.Forget();
    resume_ = UnguessableHex(kTokenBytes);
    DropUnderWay();
    steps_.Restart();
    phase_ = Phase::kConfigure;
    Agree(arrival.hello);
  }
  resumable_ = false;
  answer_wanted_ = false;
  welcome.capabilities = capabilities_;
  welcome.server = std::string("consac ") + kVersion;
  welcome.session = number_;
  welcome.heartbeat_s = std::min(welcome.heartbeat_s, options_.deadline_s / 3.0);
  welcome.resume = resume_;
  max_frame_ = welcome.max_frame = std::min(arrival.hello.max_frame, protocol2::kLargestFrame);
  stepper_.LimitInfos(max_frame_);
  if (welcome.resumed && stepper_.blocks().largest_result > max_frame_)
    return Fatal(Fault("AUTH_FAILED", "a RESULT may take " + std::to_string(stepper_.blocks().largest_result) +
                                          " bytes, which does not fit over TCP; begin a new session"));
  welcome.last_request = request_;
  reader_.SetLimit(std::min(welcome.max_frame, LargestRequest()));
  CONSAC_RETURN_IF_ERROR(SendJson(FrameType::kWelcome, 0, protocol2::EncodeWelcome(welcome)));
  return welcome.resumed ? SayPaused() : Status::Ok();
}

bool Session2Server::Owns(const protocol2::Hello& hello) const {
  const bool there = resumable() || (connected_ && phase_ == Phase::kRun);
  return there && SameSecret(resume_, hello.resume);
}

Status Session2Server::MayComeBack(const protocol2::Hello& hello) const {
  const std::string session = "session " + std::to_string(number_);
  if (hello.max_frame < max_frame_) {
    return Fault("AUTH_FAILED", session + " had a max_frame of " + std::to_string(max_frame_) + ", this HELLO has " +
                                    std::to_string(hello.max_frame) + "; raise it, or begin a new session (R23)");
  }
  const std::string lacking = protocol2::LackingCapability(hello.capabilities, capabilities_);
  if (lacking.empty()) return Status::Ok();
  return Fault("AUTH_FAILED", session + " has the capability '" + lacking +
                                  "', which this HELLO does not name; name it, or begin a new session (R27)");
}

void Session2Server::Agree(const protocol2::Hello& hello) {
  capabilities_.clear();
  const auto agree = [&](std::string_view name, bool offered) {
    const bool agreed = offered && protocol2::HasCapability(hello.capabilities, name);
    if (agreed) capabilities_.emplace_back(name);
    return agreed;
  };
  shares_ = agree(kSharedMemory, true);
  renders_ = agree(kRendering, env_.renders());
  relabels_ = agree(kRelabelling, env_.prices_goals());
  agreed_.parameters = agree(kParameters, !env_.spec().parameters.empty());
  agreed_.statistics = agree(kStatistics, env_.tells_statistics());
  agreed_.groups = agree(kGroups, !env_.spec().groups.empty());
  stepper_.Agree(agreed_);
}

Result<bool> Session2Server::Pump(double timeout_s) {
  if (phase_ < Phase::kBegin && Now() - connected_at_ > options_.handshake_s)
    return Fatal({StatusCode::kDeadlineExceeded, "the handshake with " + transport_->peer() + " took more than " +
                                                     NumberText(options_.handshake_s) + " s"});
  if (!outbox_.empty()) {
    CONSAC_RETURN_IF_ERROR(outbox_.Flush(*transport_, timeout_s, options_.write_s));
    return outbox_.empty();
  }
  if (under_way_ != UnderWay::kNothing) return GoOn(timeout_s);
  if (shared_.has_value() && shared_->request_turn.Await(std::min(timeout_s, kSharedWait))) {
    CONSAC_RETURN_IF_ERROR(HandleShared());
    return true;
  }
  if (shared_.has_value()) {
    // Now and then the connection beside it.
    if (++shared_idle_ % kSharedLooks != 0 && timeout_s <= 0.0 && phase_ == Phase::kRun) return false;
    timeout_s = 0.0;
  }
  Frame frame;
  Result<bool> whole = reader_.Next(&frame);
  if (whole.ok() && !*whole) {
    const Result<std::size_t> count = transport_->Read(reader_.Writable(), timeout_s);
    if (!count.ok()) return count.status();
    if (*count == 0) return CheckTime();
    reader_.Commit(*count);
    whole = reader_.Next(&frame);
  }
  if (!whole.ok()) return Fatal(whole.status(), reader_.refused_request());
  if (!*whole) return CheckTime();
  last_heard_ = Now();  // of a whole frame: bytes that trickle are silence
  const Status status = Handle(frame);
  if (!status.ok()) return status;
  return true;
}

Status Session2Server::End(const Status& why) {
  if (why.code() == StatusCode::kCancelled && under_way_ == UnderWay::kWaitsForTime) (void)StepWorlds();
  through_memory_ = false;
  if (why.code() == StatusCode::kCancelled)
    (void)SendJson(FrameType::kGoAway, 0, protocol2::EncodeGoAway(why.message()));
  if (!outbox_.empty()) (void)outbox_.Flush(*transport_, 0.0, options_.write_s);
  if (refused_) {
    farewells_.Add(std::move(transport_));
  } else {
    transport_->Close();
  }
  reader_ = protocol2::FrameReader();  // what had come of a frame goes
  outbox_.Clear();
  connected_ = false;
  broke_at_ = Now();
  resumable_ = !finished_ && phase_ == Phase::kRun && (why.code() == StatusCode::kUnavailable || damaged_);
  if (finished_ || why.code() != StatusCode::kUnavailable) return finished_ ? Status::Ok() : why;
  if (phase_ != Phase::kRun) return {StatusCode::kUnavailable, "the trainer left before the session began"};
  return {StatusCode::kUnavailable, "the trainer left after " + std::to_string(steps_.session()) + " of " +
                                        std::to_string(options_.training_length) + " steps: " + why.message()};
}

void Session2Server::Forget() {
  resumable_ = false;
  DropUnderWay();
}

void Session2Server::SetPaused(bool paused) {
  last_heard_ = Now();  // the trainer's silence meanwhile was not its own
  paused_ = paused;
  if (connected_ && phase_ != Phase::kConfigure)
    (void)SendFrame(paused ? FrameType::kPaused : FrameType::kResumed, 0, {});
}

Status Session2Server::SayPaused() {
  return paused_ ? SendFrame(FrameType::kPaused, 0, {}) : Status::Ok();
}

std::size_t Session2Server::LargestRequest() const {
  const protocol2::Blocks& blocks = stepper_.blocks();
  std::size_t largest = std::max(blocks.step_bytes, blocks.options + protocol2::kLargestJson);
  if (agreed_.parameters) largest += blocks.parameter_bytes();
  for (const BehaviourSpec& behaviour : env_.spec().behaviours)
    if (relabels_) largest = std::max({largest, protocol2::kMostRelabelled, protocol2::RelabelBytes(behaviour, 1)});
  return largest;
}

void Session2Server::PlaceResult(std::byte* at) {
  result_at_ = at;
  stepper_.WriteTo(at + protocol2::kHeaderBytes);
}

Status Session2Server::EnterSharedMemory() {
  Result<SharedChannel> channel =
      SharedChannel::Create(stepper_.blocks(), stepper_.result_room(), relabels_ ? Also::kRelabels : Also::kNothing);
  if (!channel.ok()) return channel.status();
  LeaveSharedMemory();
  std::memcpy(channel->result(), result_at_, result_room());
  shared_ = std::move(*channel);
  PlaceResult(shared_->result());
  return Status::Ok();
}

void Session2Server::LeaveSharedMemory() {
  if (!shared_.has_value()) return;
  if (!covered_) std::memcpy(result_.data(), result_at_, result_room());
  covered_ = false;
  PlaceResult(result_.data());
  shared_.reset();
  through_memory_ = false;
}

Status Session2Server::HandleShared() {
  std::byte head[protocol2::kHeaderBytes];
  std::memcpy(head, shared_->request(), sizeof(head));
  const Result<Frame> frame = SharedChannel::FrameAt(shared_->request(), shared_->request_bytes, head);
  if (!frame.ok()) return Fatal(frame.status(), protocol2::RefusedRequest(head));
  last_heard_ = Now();
  through_memory_ = true;
  const Status status = Handle(*frame);
  if (under_way_ == UnderWay::kNothing) through_memory_ = false;
  return status;
}

Result<bool> Session2Server::GoOn(double timeout_s) {
  if (under_way_ == UnderWay::kWaitsForTime) {
    const double left = not_before_ - Now();
    if (left > 0.0 && timeout_s <= 0.0) return false;
    if (left > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left, timeout_s)));
    if (Now() < not_before_) return false;
    CONSAC_RETURN_IF_ERROR(StepWorlds());
  } else if (!env_.settled()) {
    return false;
  } else {
    CONSAC_RETURN_IF_ERROR(FinishUnderWay());
  }
  if (under_way_ == UnderWay::kNothing) through_memory_ = false;
  return true;
}

Status Session2Server::Await(UnderWay what) {
  under_way_ = what;
  answer_wanted_ = true;
  return env_.settled() ? FinishUnderWay() : Status::Ok();
}

Status Session2Server::FinishUnderWay() {
  if (std::exchange(under_way_, UnderWay::kNothing) == UnderWay::kReset) {
    stepper_.FinishReset();
    phase_ = Phase::kRun;
  } else {
    stepper_.FinishStep();
    steps_.Add(stepper_.agents_stepped());
  }
  return SendResult();
}

void Session2Server::DropUnderWay() {
  if (under_way_ == UnderWay::kReset || under_way_ == UnderWay::kStep) env_.Abandon();
  under_way_ = UnderWay::kNothing;
}

Status Session2Server::Deliver(std::span<const std::byte> frame) {
  last_heard_ = Now();  // from now on the trainer's silence is its own
  if (!through_memory_ || frame.size() > shared_->result_bytes) return outbox_.Send(*transport_, frame);
  if (frame.data() != shared_->result()) {
    if (!covered_) std::memcpy(result_.data(), shared_->result(), result_room());  // see Uncover
    covered_ = true;
    std::memcpy(shared_->result(), frame.data(), frame.size());
  }
  shared_->result_turn.Take();
  return Status::Ok();
}

void Session2Server::Uncover() {
  if (covered_) std::memcpy(shared_->result(), result_.data(), result_room());
  covered_ = false;
}

Status Session2Server::SendFrame(FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
  control_.resize(protocol2::kHeaderBytes + payload.size());
  FrameHeader header{type, false, static_cast<std::uint32_t>(payload.size()), 0, request, number_};
  protocol2::WriteHeader(header, control_.data());
  if (!payload.empty()) std::memcpy(control_.data() + protocol2::kHeaderBytes, payload.data(), payload.size());
  return outbox_.Send(*transport_, control_);
}

Status Session2Server::SendJson(FrameType type, std::uint64_t request, const std::string& json) {
  return SendFrame(type, request, std::as_bytes(std::span(json)));
}

std::byte* Session2Server::BeginAnswer(FrameType type, std::size_t payload_bytes) {
  answer_.resize(protocol2::kHeaderBytes + payload_bytes);
  FrameHeader header{type, false, static_cast<std::uint32_t>(payload_bytes), 0, request_, number_};
  protocol2::WriteHeader(header, answer_.data());
  answer_is_result_ = false;
  return answer_.data() + protocol2::kHeaderBytes;
}

Status Session2Server::Answer(FrameType type, std::span<const std::byte> payload) {
  std::byte* to = BeginAnswer(type, payload.size());
  if (!payload.empty()) std::memcpy(to, payload.data(), payload.size());
  return Deliver(answer_);
}

Status Session2Server::Repeat() {
  if (!answer_is_result_) return Deliver(answer_);
  return Deliver({result_at_, result_size_});
}

Status Session2Server::Refuse(const Status& why, const std::string& path) {
  if (protocol2::FaultName(why) == "MALFORMED") return Fatal(why, request_--);  // uses no number up
  protocol2::ErrorMessage error{
      std::string(protocol2::FaultName(why)), false, protocol2::FaultText(why), path, 0.0, stepper_.TakeBlamed()};
  return Answer(FrameType::kError, protocol2::EncodeError(error));
}

Status Session2Server::RefuseUncounted(std::uint64_t request, const std::string& why) {
  const protocol2::ErrorMessage error{"BAD_STATE", false, why, {}, 0.0};
  return SendJson(FrameType::kError, request, protocol2::EncodeError(error));
}

Status Session2Server::Fatal(const Status& why, std::uint64_t request) {
  protocol2::ErrorMessage error{std::string(protocol2::FaultName(why)), true, protocol2::FaultText(why), {}, 0.0, -1};
  (void)SendJson(FrameType::kError, request, protocol2::EncodeError(error));
  refused_ = true;
  damaged_ = protocol2::FaultName(why) == "CRC_MISMATCH";
  return why;
}

Result<bool> Session2Server::CheckTime() {
  const double now = Now();
  if (now - last_heard_ > options_.deadline_s) {
    return Status{StatusCode::kDeadlineExceeded,
                  transport_->peer() + " is silent for " + NumberText(options_.deadline_s) + " s; its session is over"};
  }
  return false;
}

std::unique_ptr<Session2> Session2::Create(const SessionHost& host) {
  return std::make_unique<Session2Server>(host);
}

}  // namespace consac
