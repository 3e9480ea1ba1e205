// A trainer's requests. What comes to them: client2_answers.cpp.
#include "server/client2.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "consac/base/text.h"
#include "server/limits.h"
#include "server/peer.h"
#include "server/writing.h"

namespace consac {
namespace {

using protocol2::Frame;
using protocol2::FrameType;
using protocol2::HasCapability;

}  // namespace

Status Client2::Begin() {
  const Status status = BeginSession();
  return NamingPeer(status, *transport_);
}

Status Client2::BeginSession() {
  CONSAC_RETURN_IF_ERROR(SayHello());
  const bool here = transport_->peer().starts_with("127.") || transport_->peer().starts_with("::1");
  return AskForSpec(here && options_.shared_memory && HasCapability(welcome_.capabilities, kSharedMemory));
}

Status Client2::Reset(std::uint64_t seed, std::span<Batch> batches) {
  Status status = takes_seeds_ ? ResetAll(seed, batches) : ResetAll(std::nullopt, batches);
  if (takes_seeds_ && refused_ && open_ && refusal_ == "UNSUPPORTED") {  // R47
    takes_seeds_ = false;
    const std::string why = status.message();
    status = ResetAll(std::nullopt, batches);
    if (status.ok()) Log(LogLevel::kWarning, why + "; its episodes begin without seeds");
  }
  return NamingPeer(status, *transport_);
}

Status Client2::ResetAll(std::optional<std::uint64_t> seed, std::span<Batch> batches) {
  std::byte* payload =
      BeginMove(seed.has_value() ? protocol2::kWithSeeds : 0, seed.has_value() ? blocks_.options : blocks_.seeds);
  std::memset(payload + protocol2::kActiveOffset, 1, blocks_.environments);
  for (std::size_t i = 0; seed.has_value() && i < blocks_.environments; ++i) {
    const std::uint64_t own = *seed + i;
    std::memcpy(payload + blocks_.seeds + i * sizeof(own), &own, sizeof(own));
  }
  return Exchange(FrameType::kReset, batches);
}

Status Client2::Step(std::span<Batch> batches, MoreSteps) {
  std::byte* payload = BeginMove(0, blocks_.step_bytes);
  std::memset(payload + protocol2::kActiveOffset, 1, blocks_.environments);
  for (std::size_t b = 0; b < std::min(batches.size(), spec_.behaviours.size()); ++b) {
    const BehaviourSpec& behaviour = spec_.behaviours[b];
    std::memcpy(payload + blocks_.behaviours[b].actions, batches[b].actions,
                static_cast<std::size_t>(behaviour.slots) * behaviour.action_layout.row_bytes);
  }
  ++steps_;
  const Status stepped = Exchange(FrameType::kStep, batches);
  if (stepped.ok()) return stepped;
  const Status status = NamingPeer(stepped, *transport_);
  return {status.code(), "at step " + std::to_string(steps_) + WhoseStep() + ": " + status.message()};
}

std::span<const std::uint8_t> Client2::present(std::size_t b) const {
  return agents_leave_ ? std::span<const std::uint8_t>(present_[b]) : std::span<const std::uint8_t>();
}

bool Client2::prices_goals() const {
  return HasCapability(welcome_.capabilities, kRelabelling);
}

// As few requests as the engine takes.
Status Client2::PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) {
  if (!prices_goals()) return EnvClient::PriceGoals(b, observations, rows, rewards);
  const BehaviourSpec& behaviour = spec_.behaviours[b];
  const std::int64_t most = protocol2::MostRelabelledRows(behaviour, welcome_.max_frame);
  for (std::int64_t begin = 0; begin < rows; begin += most) {
    const std::int64_t some = std::min(most, rows - begin);
    const std::byte* from = observations + static_cast<std::size_t>(begin) * behaviour.observation_layout.row_bytes;
    const Status asked = ExchangeGoals({b, some, from}, rewards + begin);
    if (asked.ok()) continue;
    const std::string why = "while asking what other goals would have paid: ";
    const Status status = NamingPeer(asked, *transport_);
    if (open_) over_ = ", " + why + status.message();
    Close();
    return {status.code(), why + status.message()};
  }
  return Status::Ok();
}

Status Client2::ExchangeGoals(const protocol2::Relabel& relabel, float* rewards) {
  std::byte* payload = BeginMessage(protocol2::RelabelBytes(spec_.behaviours[relabel.behaviour], relabel.rows));
  protocol2::WriteRelabel(spec_, relabel, payload);
  const Result<Frame> answer = Perform(FrameType::kRelabel);
  if (!answer.ok()) return answer.status();
  if (answer->header.type != FrameType::kRewards) return Unexpected(*answer, "REWARDS");
  return protocol2::ReadRewards(answer->payload, relabel.rows, rewards);
}

void Client2::KeepAlive() {
  const double now = Now();
  if (!open_ || now - alive_at_ < welcome_.heartbeat_s / 2.0) return;
  alive_at_ = now;
  (void)SendControl(FrameType::kPing, {});  // if that fails, the next request tells
}

void Client2::Close() {
  if (open_) (void)SendControl(FrameType::kBye, {});
  open_ = false;
  transport_->Close();
}

std::string Client2::description() const {
  const std::int32_t copies = spec_.environments();
  return transport_->peer() + ", protocol 2" + (shared_.has_value() ? " in shared memory" : "") +
         (copies > 1 ? ", " + std::to_string(copies) + " environments" : "");
}

const char* Client2::WhoseStep() const {
  std::int64_t slots = 0;
  for (const BehaviourSpec& behaviour : spec_.behaviours) slots += behaviour.slots;
  return slots > 1 ? " of each environment" : "";
}

std::byte* Client2::BeginMessage(std::size_t payload_bytes) {
  message_.assign(protocol2::kHeaderBytes + payload_bytes, std::byte{0});
  return message_.data() + protocol2::kHeaderBytes;
}

std::byte* Client2::BeginMove(std::uint32_t flags, std::size_t payload_bytes) {
  if (!sets_parameters_) {
    std::byte* payload = BeginMessage(payload_bytes);
    std::memcpy(payload, &flags, sizeof(flags));
    return payload;
  }
  flags |= protocol2::kWithParameters;
  std::byte* payload = BeginMessage(payload_bytes + blocks_.parameter_bytes());
  std::memcpy(payload, &flags, sizeof(flags));
  std::memcpy(payload + payload_bytes, parameters_.data(), blocks_.parameter_bytes());
  return payload;
}

void Client2::SetParameters(std::int32_t environment, std::span<const double> values) {
  const std::size_t count = spec_.parameters.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isnan(values[i])) continue;
    parameters_[static_cast<std::size_t>(environment) * count + i] = values[i];
    sets_parameters_ = true;
  }
}

Status Client2::SendControl(FrameType type, const std::string& json) {
  const auto payload = std::as_bytes(std::span(json));
  std::vector<std::byte> frame(protocol2::kHeaderBytes);
  protocol2::WriteHeader({type, false, static_cast<std::uint32_t>(json.size()), 0, 0, welcome_.session}, frame.data());
  frame.insert(frame.end(), payload.begin(), payload.end());
  return WriteUnlessStopped(*transport_, frame, kWriteTimeout, options_.stop);
}

Result<Frame> Client2::Perform(FrameType type) {
  if (!open_) return Status{StatusCode::kUnavailable, "the session with " + transport_->peer() + " is over" + over_};
  const std::size_t payload = message_.size() - protocol2::kHeaderBytes;
  const std::uint64_t next = ++request_;
  refused_ = false;
  refusal_.clear();
  if (payload > welcome_.max_frame) {
    return Status{StatusCode::kInvalidArgument, "a request of " + std::to_string(payload) + " bytes is more than the " +
                                                    std::to_string(welcome_.max_frame) +
                                                    " that the engine takes; use fewer environments"};
  }
  protocol2::WriteHeader({type, false, static_cast<std::uint32_t>(payload), 0, next, welcome_.session},
                         message_.data());
  if (shared_.has_value() && message_.size() <= shared_->request_bytes) {
    Result<Frame> answer = PerformShared(next);
    if (answer.ok() || answer.status().code() != StatusCode::kUnavailable || refused_) return answer;
  }
  double broke_at = -1.0;  // the first time
  while (true) {
    Status status = WriteUnlessStopped(*transport_, message_, kWriteTimeout, options_.stop);
    if (status.code() == StatusCode::kCancelled) return status;
    if (status.ok()) {
      Result<Frame> answer = ReadAnswer(request_, options_.deadline_s);
      if (answer.ok() || answer.status().code() != StatusCode::kUnavailable || refused_) return answer;
      status = answer.status();
    }
    const bool again = broke_at >= 0.0;
    if (!again) broke_at = Now();
    // An engine that takes a session up and closes at once is given time, and is said once.
    if (again) std::this_thread::sleep_for(std::chrono::duration<double>(kRetryPause));
    CONSAC_RETURN_IF_ERROR(ConnectAnew(status, broke_at, again ? Said::kAlready : Said::kNotYet));
  }
}

Result<Frame> Client2::PerformShared(std::uint64_t request) {
  std::memcpy(shared_->request(), message_.data(), message_.size());
  shared_->request_turn.Take();
  Patience patience(options_.deadline_s, paused_);
  while (!shared_->result_turn.Await(kSharedWait)) {
    if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed))
      return Status{StatusCode::kCancelled, "stopped while waiting for " + transport_->peer()};
    const Result<std::size_t> count = transport_->Read(reader_.Writable(), 0.0);
    if (!count.ok()) return count.status();
    reader_.Commit(*count);
    Frame frame;
    for (Result<bool> whole = reader_.Next(&frame);; whole = reader_.Next(&frame)) {
      if (!whole.ok()) return whole.status();
      if (!*whole) break;
      const Result<bool> answer = IsAnswer(frame, request, &patience);
      if (!answer.ok()) return answer.status();
      if (*answer) return frame;
    }
    if (patience.left() <= 0.0) return Silent(patience);
  }
  std::byte head[protocol2::kHeaderBytes];
  std::memcpy(head, shared_->result(), sizeof(head));
  const Result<Frame> frame = SharedChannel::FrameAt(shared_->result(), shared_->result_bytes, head);
  if (!frame.ok()) return frame.status();
  const Result<bool> answer = IsAnswer(*frame, request, &patience);
  if (!answer.ok()) return answer.status();
  return frame;
}

Status Client2::Silent(const Patience& patience) const {
  return {StatusCode::kDeadlineExceeded, transport_->peer() + " is silent for " + NumberText(patience.deadline_s()) +
                                             " s; if it is paused, raise --deadline"};
}

Result<Frame> Client2::Request(FrameType type, const std::string& json) {
  std::byte* payload = BeginMessage(json.size());
  std::memcpy(payload, json.data(), json.size());
  return Perform(type);
}

Status Client2::Exchange(FrameType type, std::span<Batch> batches) {
  if (batches.size() != spec_.behaviours.size()) {
    return {StatusCode::kInvalidArgument, "this engine offers " + std::to_string(spec_.behaviours.size()) +
                                              " behaviours, not " + std::to_string(batches.size())};
  }
  check_.Ask(type, std::span(message_).subspan(protocol2::kHeaderBytes + protocol2::kActiveOffset));
  const Result<Frame> answer = Perform(type);
  if (!answer.ok()) return answer.status();
  if (answer->header.type != FrameType::kResult) return Unexpected(*answer, "RESULT");
  if (const Status judged = check_.Judge(answer->payload); !judged.ok())
    return {judged.code(), transport_->peer() + ": " + judged.message()};
  CONSAC_RETURN_IF_ERROR(protocol2::ReadResult(spec_, blocks_, answer->payload, batches));
  CONSAC_RETURN_IF_ERROR(CheckRewards(answer->payload.data(), batches));
  CONSAC_RETURN_IF_ERROR(ReadExtras(answer->payload));
  engine_seconds_ = protocol2::ReadEngineTime(answer->payload.data());
  ReadPresence(answer->payload.data());
  std::fill(parameters_.begin(), parameters_.end(), std::numeric_limits<double>::quiet_NaN());
  sets_parameters_ = false;  // they arrived; what was refused goes with the next request again
  return CheckAnyone();
}

Status Client2::CheckRewards(const std::byte* payload, std::span<const Batch> batches) {
  for (std::size_t b = 0; b < batches.size(); ++b) {
    const float* rewards = batches[b].rewards;
    for (std::size_t i = 0; i < batches[b].slots.size(); ++i) {
      if (std::fabs(rewards[i]) <= std::numeric_limits<float>::max()) continue;
      double reward = 0.0;
      std::memcpy(&reward, payload + blocks_.behaviours[b].rewards + i * sizeof(reward), sizeof(reward));
      if (!std::isfinite(reward)) continue;  // the check's affair, or the caller's
      const std::string text = transport_->peer() + ": the reward of slot " + std::to_string(i) + " of " +
                               Quote(spec_.behaviours[b].name) + " is " + NumberText(reward) +
                               ", beyond float32's 3.4e38; scale rewards to about 1";
      if (options_.refuse_non_finite) return {StatusCode::kNonFinite, text};
      warnings_.Say(text);
    }
  }
  return Status::Ok();
}

Status Client2::ReadExtras(std::span<const std::byte> payload) {
  statistics_.clear();
  std::fill(group_rewards_.begin(), group_rewards_.end(), 0.0f);
  std::uint32_t said = 0;
  std::memcpy(&said, payload.data(), sizeof(said));
  if ((said & (protocol2::kPartStatistics | protocol2::kPartGroups)) == 0) return Status::Ok();
  const protocol2::ResultParts parts = protocol2::FindParts(spec_, blocks_, payload);
  for (std::size_t i = 0; i < group_rewards_.size() && parts.groups != 0; ++i) {
    double paid = 0.0;
    std::memcpy(&paid, payload.data() + parts.groups + i * sizeof(paid), sizeof(paid));
    group_rewards_[i] = static_cast<float>(paid);
  }
  if (parts.statistics == 0) return Status::Ok();
  const std::size_t begin = parts.statistics + sizeof(std::uint32_t);
  return protocol2::ReadStatistics(payload.subspan(begin, parts.statistics_end - begin), &statistics_);
}

void Client2::ReadPresence(const std::byte* payload) {
  for (std::size_t b = 0; b < present_.size(); ++b) {
    const std::byte* states = payload + blocks_.behaviours[b].states;
    std::uint8_t all = 1;
    for (std::size_t i = 0; i < present_[b].size(); ++i) {
      present_[b][i] = (states[i] & std::byte{protocol2::kActive}) != std::byte{0} ? 1 : 0;
      all &= present_[b][i];
    }
    agents_leave_ = agents_leave_ || all == 0;
  }
}

Status Client2::CheckAnyone() {
  if (check_.anyone()) {
    deserted_at_ = -1.0;
    return Status::Ok();
  }
  if (deserted_at_ < 0.0) deserted_at_ = Now();
  if (Now() - deserted_at_ <= options_.deadline_s) return Status::Ok();
  return {StatusCode::kDeadlineExceeded,
          transport_->peer() + " has had no agent that takes part for " + NumberText(options_.deadline_s) +
              " s: RESULT's state 16 is set for no slot; the engine sets it for every agent whose action counts next "
              "time (R77)"};
}

}  // namespace consac
