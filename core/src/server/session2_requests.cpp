// What a trainer asks of its session, carried out or refused.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>

#include "consac/base/text.h"
#include "consac/protocol/relabel.h"
#include "protocol/protocol2_json.h"
#include "server/limits.h"
#include "server/session2.h"

namespace consac {
namespace {

using protocol2::Fault;
using protocol2::Frame;
using protocol2::FrameHeader;
using protocol2::FrameType;

}  // namespace

Status Session2Server::Handle(const Frame& frame) {
  const FrameHeader& header = frame.header;
  const auto type = static_cast<std::uint16_t>(header.type);
  switch (header.type) {
    case FrameType::kPing:
      if (frame.payload.size() > protocol2::kLargestPing)
        return Fatal(Fault("MALFORMED", "a PING has more than 64 bytes"), header.request);
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
    case FrameType::kRelabel:
      if (relabels_) return OnRelabel(frame.payload);
      [[fallthrough]];  // to who has not agreed to it, it is as to who does not know it (R90)
    default:
      return Refuse(Fault("UNKNOWN_MESSAGE", "a frame of type " + std::to_string(type) + " is not known"));
  }
}

Status Session2Server::OnConfigure(const Frame& frame) {
  if (phase_ == Phase::kRun) return Refuse(Fault("BAD_STATE", "CONFIGURE comes before the first RESET"));
  const Result<protocol2::Configure> configure = protocol2::ParseConfigure(frame.payload);
  if (!configure.ok()) return Refuse(configure.status());
  if (configure->shared_memory && !shares_)
    return Refuse(Fault("UNSUPPORTED", "transport 'shm' without the capability 'shm' in HELLO; ask for 'tcp' (R30)"));
  if (!configure->expect_json.empty()) {
    std::string path;
    const Status same =
        protocol2::CompareBehaviours(configure->expect_json, protocol2::BehavioursJson(env_.spec()), &path);
    if (!same.ok()) return Refuse(same, path);
  }
  const protocol2::Blocks& blocks = stepper_.blocks();
  std::size_t largest = std::max(blocks.largest_result, blocks.step_bytes);
  if (agreed_.parameters)
    largest = std::max(largest, std::max(blocks.step_bytes, blocks.options) + blocks.parameter_bytes());
  if (!configure->shared_memory && largest > max_frame_) {
    return Refuse(Fault("UNSUPPORTED", "STEP or RESULT may take " + std::to_string(largest) +
                                           " bytes, more than the trainer's max_frame of " +
                                           std::to_string(max_frame_)));
  }
  const Status autoreset = stepper_.SetAutoreset(configure->autoreset);
  if (!autoreset.ok()) return Refuse(autoreset);
  protocol2::SpecMessage spec;
  spec.env = env_.spec();
  if (!agreed_.parameters) spec.env.parameters.clear();
  if (!agreed_.groups) spec.env.groups.clear();
  spec.autoreset = configure->autoreset;
  spec.training_length = options_.training_length;
  spec.model_name = options_.model_name;
  LeaveSharedMemory();
  if (configure->shared_memory) {
    const Status shared = EnterSharedMemory();
    if (!shared.ok()) return Refuse(Fault("UNSUPPORTED", shared.message()));
    spec.shared_memory = shared_->Spec();
  }
  const std::string text = protocol2::EncodeSpec(spec);
  if (text.size() > max_frame_) {
    return Refuse(Fault("UNSUPPORTED", "SPEC has " + std::to_string(text.size()) +
                                           " bytes, more than the trainer's max_frame of " +
                                           std::to_string(max_frame_)));
  }
  if (!protocol2::ParseObject(std::as_bytes(std::span(text))).ok())
    return Refuse(Fault("UNSUPPORTED", "SPEC has more bytes, values or levels than JSON of a message may have (R7)"));
  phase_ = Phase::kBegin;
  CONSAC_RETURN_IF_ERROR(Answer(FrameType::kSpec, text));
  return SayPaused();
}

Status Session2Server::OnReset(std::span<const std::byte> payload) {
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

Status Session2Server::OnStep(std::span<const std::byte> payload) {
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

Status Session2Server::StepWorlds() {
  if (options_.min_step_s > 0.0) last_step_ = std::max(Now(), last_step_ + options_.min_step_s);
  Uncover();
  stepper_.Step();
  return Await(UnderWay::kStep);
}

Status Session2Server::SendResult() {
  const std::size_t size = stepper_.result_bytes();
  const FrameHeader header{FrameType::kResult, false, static_cast<std::uint32_t>(size), 0, request_, number_};
  protocol2::WriteHeader(header, result_at_);
  result_size_ = protocol2::kHeaderBytes + size;
  answer_is_result_ = true;
  protocol2::WriteEngineTime(Now() - step_begins_, result_at_ + protocol2::kHeaderBytes);
  return answer_wanted_ ? Deliver({result_at_, result_size_}) : Status::Ok();
}

Status Session2Server::OnRender(std::span<const std::byte> payload) {
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

// Judged and priced in memory of our own: who shares theirs could write there meanwhile, and rows are to be aligned.
Status Session2Server::OnRelabel(std::span<const std::byte> payload) {
  if (phase_ != Phase::kRun) return Refuse(Fault("BAD_STATE", "RELABEL comes after the first RESET"));
  relabel_.Resize(payload.size());
  if (!payload.empty()) std::memcpy(relabel_.data(), payload.data(), payload.size());
  const Result<protocol2::Relabel> asked =
      protocol2::ReadRelabel(env_.spec(), {relabel_.data(), payload.size()}, max_frame_);
  if (!asked.ok()) return Refuse(asked.status());
  prices_.resize(static_cast<std::size_t>(asked->rows));
  env_.PriceGoals(asked->behaviour, asked->observations, asked->rows, prices_.data());
  if (const Status priced = protocol2::CheckRewards(prices_); !priced.ok()) return Refuse(priced);
  protocol2::WriteRewards(prices_, BeginAnswer(FrameType::kRewards, prices_.size() * sizeof(double)));
  return Deliver(answer_);
}

}  // namespace consac
