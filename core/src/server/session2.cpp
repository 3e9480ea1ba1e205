// The engine's end of protocol 2. One request at a time: each is carried out once, its answer kept until the next, so
// that a trainer whose connection broke may ask again.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "base/entropy.h"
#include "consac/base/text.h"
#include "consac/base/version.h"
#include "consac/protocol/protocol2.h"
#include "server/limits.h"
#include "server/outbox.h"
#include "server/secret.h"
#include "server/session.h"
#include "server/shared_channel.h"
#include "server/stepper.h"

namespace consac {
namespace {

using protocol2::Fault;
using protocol2::Frame;
using protocol2::FrameHeader;
using protocol2::FrameType;

constexpr std::size_t kLargestPing = 64;
constexpr std::size_t kTokenBytes = 16;
constexpr unsigned kSharedLooks = 16;  // polls in vain between looks at the connection beside shared memory

class Session2Server final : public Session2 {
 public:
  explicit Session2Server(const SessionHost& host)
      : env_(host.env), options_(host.options), steps_(host.steps), stepper_(host.env) {
    result_.Resize(protocol2::kHeaderBytes + stepper_.result_room());
    PlaceResult(result_.data());
  }
  ~Session2Server() override { DropUnderWay(); }

  Status Connect(Arrival arrival) override {
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
    finished_ = through_memory_ = false;
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
    }
    resumable_ = false;
    answer_wanted_ = false;
    const std::vector<std::string>& able = arrival.hello.capabilities;
    const auto offer = [&](std::string_view name) {
      if (std::find(able.begin(), able.end(), name) != able.end()) welcome.capabilities.emplace_back(name);
    };
    offer(kSharedMemory);
    if (env_.renders()) offer(kRendering);
    const std::vector<std::string>& agreed = welcome.capabilities;
    renders_ = std::find(agreed.begin(), agreed.end(), kRendering) != agreed.end();
    welcome.server = std::string("consac ") + kVersion;
    welcome.session = number_;
    welcome.heartbeat_s = std::min(welcome.heartbeat_s, options_.deadline_s / 3.0);
    welcome.resume = resume_;
    max_frame_ = welcome.max_frame = std::min(arrival.hello.max_frame, protocol2::kLargestFrame);
    if (welcome.resumed && result_room() > max_frame_)
      return Fatal(Fault("FRAME_TOO_LARGE", "a RESULT may take " + std::to_string(result_room()) +
                                                " bytes, which does not fit over TCP; begin a new session"));
    welcome.last_request = request_;
    reader_.SetLimit(std::min(welcome.max_frame, LargestRequest()));
    return SendJson(FrameType::kWelcome, arrival.request, protocol2::EncodeWelcome(welcome));
  }

  bool Owns(std::string_view token) const override {
    return (resumable() || (connected_ && phase_ == Phase::kRun)) && SameSecret(resume_, token);
  }

  Result<bool> Pump(double timeout_s) override {
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
    if (!whole.ok()) return Fatal(whole.status());
    if (!*whole) return CheckTime();
    last_heard_ = Now();  // of a whole frame: bytes that trickle are silence
    const Status status = Handle(frame);
    if (!status.ok()) return status;
    return true;
  }

  Status End(const Status& why) override {
    if (why.code() == StatusCode::kCancelled && under_way_ == UnderWay::kWaitsForTime) (void)StepWorlds();
    through_memory_ = false;
    if (why.code() == StatusCode::kCancelled)
      (void)SendJson(FrameType::kGoAway, 0, protocol2::EncodeGoAway(why.message()));
    if (!outbox_.empty()) (void)outbox_.Flush(*transport_, 0.0, options_.write_s);
    transport_->Close();
    reader_ = protocol2::FrameReader();  // what had come of a frame goes
    outbox_.Clear();
    connected_ = false;
    broke_at_ = Now();
    resumable_ = !finished_ && phase_ == Phase::kRun && why.code() == StatusCode::kUnavailable;
    if (finished_ || why.code() != StatusCode::kUnavailable) return finished_ ? Status::Ok() : why;
    if (phase_ != Phase::kRun) return {StatusCode::kUnavailable, "the trainer left before the session began"};
    return {StatusCode::kUnavailable, "the trainer left after " + std::to_string(steps_.session()) + " of " +
                                          std::to_string(options_.training_length) + " steps: " + why.message()};
  }

  std::string peer() const override { return transport_->peer(); }
  bool finished() const override { return finished_; }
  void Forget() override {
    resumable_ = false;
    DropUnderWay();
  }
  bool resumable() const override { return resumable_ && Now() - broke_at_ < options_.resume_s; }

  void LookForTrainer() override { shared_idle_ = kSharedLooks - 1; }

  void SetPaused(bool paused) override {
    last_heard_ = Now();  // the trainer's silence meanwhile was not its own
    if (phase_ == Phase::kRun) (void)SendFrame(paused ? FrameType::kPaused : FrameType::kResumed, 0, {});
  }

 private:
  enum class Phase : std::uint8_t { kConfigure, kBegin, kRun };  // kBegin: before the first RESET
  /// What the latest request waits for: the frame rate, or worlds that have not settled.
  enum class UnderWay : std::uint8_t { kNothing, kWaitsForTime, kReset, kStep };

  std::size_t result_room() const { return protocol2::kHeaderBytes + stepper_.result_room(); }

  /// No request of this session is longer: what a trainer may make the engine hold.
  std::size_t LargestRequest() const {
    const protocol2::Blocks& blocks = stepper_.blocks();
    return std::max(blocks.step_bytes, blocks.options + protocol2::kLargestJson);
  }

  void PlaceResult(std::byte* at) {
    result_at_ = at;
    stepper_.WriteTo(at + protocol2::kHeaderBytes);
  }

  // ---- shared memory

  Status EnterSharedMemory() {
    Result<SharedChannel> channel = SharedChannel::Create(stepper_.blocks(), stepper_.result_room());
    if (!channel.ok()) return channel.status();
    LeaveSharedMemory();
    std::memcpy(channel->result(), result_at_, result_room());
    shared_ = std::move(*channel);
    PlaceResult(shared_->result());
    return Status::Ok();
  }

  /// What was answered last stays, should it be asked for again.
  void LeaveSharedMemory() {
    if (!shared_.has_value()) return;
    if (!covered_) std::memcpy(result_.data(), result_at_, result_room());
    covered_ = false;
    PlaceResult(result_.data());
    shared_.reset();
    through_memory_ = false;
  }

  Status HandleShared() {
    std::byte head[protocol2::kHeaderBytes];
    std::memcpy(head, shared_->request(), sizeof(head));
    const Result<FrameHeader> header = protocol2::ReadHeader(head, shared_->request_bytes - sizeof(head));
    if (!header.ok()) return Fatal(header.status());
    last_heard_ = Now();
    through_memory_ = true;
    const Status status = Handle({*header, {shared_->request() + sizeof(head), header->length}});
    if (under_way_ == UnderWay::kNothing) through_memory_ = false;
    return status;
  }

  // ---- a request that takes its time

  /// Waits at most `timeout_s`. False while there is nothing to do.
  Result<bool> GoOn(double timeout_s) {
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

  /// The worlds have begun a RESET or a STEP: answers it if they are through with it.
  Status Await(UnderWay what) {
    under_way_ = what;
    answer_wanted_ = true;
    return env_.settled() ? FinishUnderWay() : Status::Ok();
  }

  Status FinishUnderWay() {
    if (std::exchange(under_way_, UnderWay::kNothing) == UnderWay::kReset) {
      stepper_.FinishReset();
      phase_ = Phase::kRun;
    } else {
      stepper_.FinishStep();
      steps_.Add(stepper_.agents_stepped());
    }
    return SendResult();
  }

  /// Nothing is left to answer.
  void DropUnderWay() {
    if (under_way_ == UnderWay::kReset || under_way_ == UnderWay::kStep) env_.Abandon();
    under_way_ = UnderWay::kNothing;
  }

  /// Sends an answer the way its request came.
  Status Deliver(std::span<const std::byte> frame) {
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

  /// The rows that an answer without a RESULT has covered in shared memory are there again: the next RESULT goes on
  /// from them.
  void Uncover() {
    if (covered_) std::memcpy(shared_->result(), result_.data(), result_room());
    covered_ = false;
  }

  // ---- frames out

  Status SendFrame(FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
    control_.resize(protocol2::kHeaderBytes + payload.size());
    FrameHeader header{type, false, static_cast<std::uint32_t>(payload.size()), 0, request, number_};
    protocol2::WriteHeader(header, control_.data());
    if (!payload.empty()) std::memcpy(control_.data() + protocol2::kHeaderBytes, payload.data(), payload.size());
    return outbox_.Send(*transport_, control_);
  }
  Status SendJson(FrameType type, std::uint64_t request, const std::string& json) {
    return SendFrame(type, request, std::as_bytes(std::span(json)));
  }

  /// The answer to a request: kept, should it be asked for again.
  Status Answer(FrameType type, const std::string& json) {
    const auto payload = std::as_bytes(std::span(json));
    answer_.resize(protocol2::kHeaderBytes + payload.size());
    FrameHeader header{type, false, static_cast<std::uint32_t>(payload.size()), 0, request_, number_};
    protocol2::WriteHeader(header, answer_.data());
    std::memcpy(answer_.data() + protocol2::kHeaderBytes, payload.data(), payload.size());
    answer_is_result_ = false;
    return Deliver(answer_);
  }

  Status Repeat() {
    if (!answer_is_result_) return Deliver(answer_);
    return Deliver({result_at_, result_size_});
  }

  /// Tells the trainer and lets the session go on, unless what came cannot be read.
  Status Refuse(const Status& why, const std::string& path = {}) {
    if (protocol2::FaultName(why) == "MALFORMED") return Fatal(why);
    protocol2::ErrorMessage error{
        std::string(protocol2::FaultName(why)), false, protocol2::FaultText(why), path, 0.0, stepper_.TakeBlamed()};
    return Answer(FrameType::kError, protocol2::EncodeError(error));
  }

  /// Tells the trainer; its number is not used up.
  Status RefuseUncounted(std::uint64_t request, const std::string& why) {
    const protocol2::ErrorMessage error{"BAD_STATE", false, why, {}, 0.0};
    return SendJson(FrameType::kError, request, protocol2::EncodeError(error));
  }

  /// Tells the trainer and ends the connection.
  Status Fatal(const Status& why) {
    protocol2::ErrorMessage error{std::string(protocol2::FaultName(why)), true, protocol2::FaultText(why), {}, 0.0, -1};
    (void)SendJson(FrameType::kError, request_, protocol2::EncodeError(error));
    return why;
  }

  // ---- frames in

  Result<bool> CheckTime() {
    const double now = Now();
    if (now - last_heard_ > options_.deadline_s) {
      return Status{StatusCode::kDeadlineExceeded, transport_->peer() + " is silent for " +
                                                       NumberText(options_.deadline_s) + " s; its session is over"};
    }
    return false;
  }

  Status Handle(const Frame& frame) {
    const FrameHeader& header = frame.header;
    const auto type = static_cast<std::uint16_t>(header.type);
    switch (header.type) {
      case FrameType::kPing:
        if (frame.payload.size() > kLargestPing) return Fatal(Fault("MALFORMED", "a PING has more than 64 bytes"));
        return SendFrame(FrameType::kPong, 0, frame.payload);
      case FrameType::kPong:
        return Status::Ok();
      case FrameType::kBye:
        finished_ = true;
        return Status::Ok();
      default:
        break;
    }
    if ((type & protocol2::kOptionalType) != 0) return Status::Ok();
    if (header.type == FrameType::kHello)
      return RefuseUncounted(header.request, "HELLO was said already; it is a connection's first frame");
    if (header.session != number_ && header.session != 0) {
      return RefuseUncounted(header.request, "session " + std::to_string(header.session) +
                                                 " on the connection of session " + std::to_string(number_));
    }
    if (header.request == request_ && (answer_is_result_ || !answer_.empty())) return Repeat();
    if (header.request != request_ + 1) {
      return RefuseUncounted(header.request, "request " + std::to_string(header.request) + " does not follow request " +
                                                 std::to_string(request_));
    }
    request_ = header.request;
    switch (header.type) {
      case FrameType::kConfigure:
        return OnConfigure(frame);
      case FrameType::kReset:
        return OnReset(frame.payload);
      case FrameType::kStep:
        return OnStep(frame.payload);
      case FrameType::kRender:
        return OnRender(frame.payload);
      default:
        return Refuse(Fault("UNKNOWN_MESSAGE", "a frame of type " + std::to_string(type) + " is not known"));
    }
  }

  Status OnConfigure(const Frame& frame) {
    if (phase_ == Phase::kRun) return Refuse(Fault("BAD_STATE", "CONFIGURE comes before the first RESET"));
    const Result<protocol2::Configure> configure = protocol2::ParseConfigure(frame.payload);
    if (!configure.ok()) return Refuse(configure.status());
    if (!configure->expect_json.empty()) {
      std::string path;
      const Status same =
          protocol2::CompareBehaviours(configure->expect_json, protocol2::BehavioursJson(env_.spec()), &path);
      if (!same.ok()) return Refuse(same, path);
    }
    if (!configure->shared_memory && result_room() > max_frame_) {
      return Refuse(Fault("UNSUPPORTED", "a RESULT may take " + std::to_string(result_room()) +
                                             " bytes, more than the trainer's max_frame of " +
                                             std::to_string(max_frame_)));
    }
    const Status autoreset = stepper_.SetAutoreset(configure->autoreset);
    if (!autoreset.ok()) return Refuse(autoreset);
    protocol2::SpecMessage spec;
    spec.env = env_.spec();
    spec.autoreset = configure->autoreset;
    spec.training_length = options_.training_length;
    spec.model_name = options_.model_name;
    LeaveSharedMemory();
    if (configure->shared_memory) {
      const Status shared = EnterSharedMemory();
      if (!shared.ok()) return Refuse(Fault("UNSUPPORTED", shared.message()));
      spec.shared_memory = shared_->Spec();
    }
    phase_ = Phase::kBegin;
    return Answer(FrameType::kSpec, protocol2::EncodeSpec(spec));
  }

  Status OnReset(std::span<const std::byte> payload) {
    if (phase_ < Phase::kBegin) return Refuse(Fault("BAD_STATE", "RESET comes after CONFIGURE"));
    step_begins_ = Now();
    Uncover();
    const Status reset = stepper_.Reset(payload, phase_ == Phase::kBegin, options_.seed + number_ - 1);
    if (!reset.ok()) {
      if (!env_.settled()) env_.Abandon();
      return Refuse(reset);
    }
    return Await(UnderWay::kReset);
  }

  Status OnStep(std::span<const std::byte> payload) {
    if (phase_ != Phase::kRun) return Refuse(Fault("BAD_STATE", "STEP comes after the first RESET"));
    step_begins_ = Now();
    const Status fits = stepper_.ReadStep(payload);
    if (!fits.ok()) return Refuse(fits);
    if (options_.min_step_s > 0.0) {
      not_before_ = last_step_ + options_.min_step_s;
      under_way_ = UnderWay::kWaitsForTime;
      return Status::Ok();
    }
    return StepWorlds();
  }

  Status StepWorlds() {
    if (options_.min_step_s > 0.0) last_step_ = std::max(Now(), last_step_ + options_.min_step_s);
    Uncover();
    stepper_.Step();
    return Await(UnderWay::kStep);
  }

  Status SendResult() {
    const std::size_t size = stepper_.result_bytes();
    const FrameHeader header{FrameType::kResult, false, static_cast<std::uint32_t>(size), 0, request_, number_};
    protocol2::WriteHeader(header, result_at_);
    result_size_ = protocol2::kHeaderBytes + size;
    answer_is_result_ = true;
    protocol2::WriteEngineTime(Now() - step_begins_, result_at_ + protocol2::kHeaderBytes);
    return answer_wanted_ ? Deliver({result_at_, result_size_}) : Status::Ok();
  }

  Status OnRender(std::span<const std::byte> payload) {
    if (!renders_) {
      return Refuse(Fault("UNSUPPORTED", env_.renders() ? "render was not agreed: say so in HELLO's capabilities"
                                                        : "this engine sends no pictures"));
    }
    if (phase_ != Phase::kRun) return Refuse(Fault("BAD_STATE", "RENDER comes after the first RESET"));
    const Result<std::int64_t> world = protocol2::ParseRender(payload);
    if (!world.ok()) return Refuse(world.status());
    if (*world < 0 || *world >= env_.spec().environments())
      return Refuse(Fault("OUT_OF_RANGE", "there is no environment " + std::to_string(*world)));
    Picture picture;
    env_.Render(static_cast<std::int32_t>(*world), &picture);
    if (picture.rgb.size() + protocol2::kHeaderBytes > max_frame_)
      return Refuse(Fault("UNSUPPORTED", "a picture of " + std::to_string(picture.rgb.size()) +
                                             " bytes is more than the trainer's max_frame of " +
                                             std::to_string(max_frame_)));
    return Answer(FrameType::kFrame, protocol2::EncodePicture(picture));
  }

  VectorEnv& env_;
  const EnvServerOptions& options_;
  StepCount& steps_;
  Stepper stepper_;

  // The connection.
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_;
  Outbox outbox_;
  Phase phase_ = Phase::kConfigure;
  double connected_at_ = 0.0, last_heard_ = 0.0, broke_at_ = 0.0;
  std::size_t max_frame_ = protocol2::kLargestFrame;
  bool renders_ = false;  // was agreed
  bool connected_ = false, finished_ = false, resumable_ = false;

  // The session.
  std::uint32_t number_ = 0;
  std::uint64_t request_ = 0;  // number of the latest
  std::string resume_;
  std::vector<std::byte> answer_, control_;  // latest answer that is no RESULT; frames between
  AlignedBytes result_;                      // latest RESULT with its header, unless it is in shared memory
  std::byte* result_at_ = nullptr;           // where it is
  std::size_t result_size_ = 0;
  bool answer_is_result_ = false;

  std::optional<SharedChannel> shared_;
  bool through_memory_ = false;  // the request under way came that way
  bool covered_ = false;         // result_ holds what lay where an answer is now
  unsigned shared_idle_ = 0;

  UnderWay under_way_ = UnderWay::kNothing;
  bool answer_wanted_ = true;  // false: the connection it came by is gone, and the trainer will ask again
  double step_begins_ = 0.0, not_before_ = 0.0, last_step_ = 0.0;
};

}  // namespace

std::unique_ptr<Session2> Session2::Create(const SessionHost& host) {
  return std::make_unique<Session2Server>(host);
}

}  // namespace consac
