// The trainer's end of text protocol 1. States: setup -> observation -> (action -> observation)*.
#include <algorithm>
#include <cstring>

#include "consac/base/refusals.h"
#include "consac/base/text.h"
#include "consac/protocol/text1.h"
#include "server/clients.h"
#include "server/limits.h"
#include "server/peer.h"
#include "server/writing.h"

namespace consac {
namespace {

using text1::Framer;

constexpr std::string_view kMagic2 = "\xC0NSC";  // that every frame of protocol 2 begins with

Status AtStep(const Status& status, std::int64_t step) {
  return {status.code(), "at step " + std::to_string(step) + ": " + status.message()};
}

class TextClient final : public EnvClient {
 public:
  TextClient(std::unique_ptr<Transport> transport, const EnvClientOptions& options, std::span<const std::byte> first)
      : transport_(std::move(transport)), options_(options) {
    if (first.empty()) return;
    std::memcpy(framer_.Writable().data(), first.data(), first.size());
    (void)framer_.Commit(first.size());
  }

  Status ReadSetup() {
    const Status status = AskForSetup();
    return NamingPeer(status, *transport_);
  }

  const EnvSpec& spec() const override { return spec_; }
  const SessionRequest& request() const override { return request_; }

  Status Reset(std::uint64_t, std::span<Batch> batches) override {
    bool done = true;
    float reward = 0.0f;
    // An engine may begin with the end of what it played before; nothing is learned from that.
    for (int ends = 0; done; ++ends) {
      CONSAC_RETURN_IF_ERROR(CheckEnds(ends));
      CONSAC_RETURN_IF_ERROR(ReadObservation(batches[0].next_observations, &reward, &done));
    }
    return Status::Ok();
  }

  Status Step(std::span<Batch> batches, MoreSteps more) override {
    Batch& batch = batches[0];
    const BehaviourSpec& behaviour = spec_.behaviours[0];
    CONSAC_RETURN_IF_ERROR(text1::CheckSendable("action", behaviour.action_layout, batch.actions, 0.0f));
    const std::size_t length =
        text1::EncodeAction(behaviour.action_layout, batch.actions, text1::Terminator::kNewline, action_text_);
    const auto action = std::as_bytes(std::span<const char>(action_text_).first(length));
    ++steps_;
    Status status = WriteUnlessStopped(*transport_, action, options_.deadline_s, options_.stop);
    if (!status.ok()) return AtStep(status, steps_);
    ended_ = false;
    bool done = false;
    status = ReadObservation(batch.next_observations, batch.rewards, &done);
    if (!status.ok()) return AtStep(status, steps_);
    batch.terminated[0] = done ? 1 : 0;
    batch.truncated[0] = 0;
    if (!done) return Status::Ok();
    std::memcpy(batch.final_observations, batch.next_observations, behaviour.observation_layout.row_bytes);
    return more == MoreSteps::kLast ? Status::Ok() : BeginEpisode(batch, action);
  }

  void Close() override { transport_->Close(); }
  std::string description() const override { return transport_->peer() + ", text protocol 1"; }

 private:
  static constexpr const char* kAfterEndHint =
      " is silent after an episode's end; if it waits for an answer there, use --answer-done";

  Status AskForSetup() {
    framer_.SetExpect(Framer::Expect::kSetup, false);
    const double timeout_s = std::min(options_.setup_timeout_s, options_.deadline_s);
    Result<std::string_view> message = ReadMessage(timeout_s, nullptr);
    if (!message.ok()) {
      if (framer_.pending().starts_with(kMagic2)) return SpeaksProtocol2(framer_.pending());
      if (message.status().code() != StatusCode::kDeadlineExceeded) return message.status();
      return {StatusCode::kDeadlineExceeded, transport_->peer() + " accepts connections but sent no setup within " +
                                                 NumberText(timeout_s) +
                                                 " s; an engine sends its setup first, so is this another service?"};
    }
    if (message->starts_with(text1::kBusyPrefix))
      return {StatusCode::kUnavailable, transport_->peer() + " is " + std::string(*message)};
    if (message->starts_with(kMagic2)) return SpeaksProtocol2(*message);
    if (!message->starts_with("D#") && !message->starts_with("B#")) {
      return {StatusCode::kProtocol, transport_->peer() + " is no CONSAC engine: its first bytes are " +
                                         Quote(*message) + ", expected a setup such as D#3#0#B#2#0,0,40,40#1000"};
    }
    Result<text1::Setup> setup = text1::ParseSetup(*message);
    if (!setup.ok()) return setup.status();
    request_ = {setup->training_length, setup->model_name};
    spec_.behaviours.push_back(
        BehaviourSpec::Of("default", std::move(setup->observation_space), std::move(setup->action_space), 1));
    action_text_.resize(text1::MaxText(spec_.behaviours[0].action_layout));
    framer_.SetExpect(Framer::Expect::kObservation, true);
    return Status::Ok();
  }

  /// That it begins with a frame. An engine of protocol 2 may do so to a trainer of text protocol 1, not to another.
  Status SpeaksProtocol2(std::string_view first) const {
    if (options_.protocol == Protocol::kText1) {
      return {StatusCode::kFailedPrecondition,
              transport_->peer() + " speaks protocol 2, and was to speak text protocol 1; leave --protocol out"};
    }
    return {StatusCode::kProtocol, transport_->peer() + " is no CONSAC engine: its first bytes are " + Quote(first) +
                                       ", and an engine of protocol 2 waits for HELLO"};
  }

  /// After an episode's last observation: the first one of the next.
  Status BeginEpisode(Batch& batch, std::span<const std::byte> action) {
    bool done = true;
    float reward = 0.0f;
    // An engine may repeat the end before it has reset; nothing is learned from that.
    for (int ends = 0; done; ++ends) {
      Status status = CheckEnds(ends);
      if (status.ok() && options_.answer_done)
        status = WriteUnlessStopped(*transport_, action, options_.deadline_s, options_.stop);
      if (!status.ok()) return AtStep(status, steps_);
      status = ReadObservation(batch.next_observations, &reward, &done);
      if (!status.ok()) return AtStep(status, steps_);
    }
    return Status::Ok();
  }

  /// Episodes that end before they have begun: passed over, but not for ever.
  Status CheckEnds(int in_a_row) {
    constexpr int kWarnAt = 10, kMost = 1000;
    if (in_a_row == kWarnAt)
      warnings_.Say(transport_->peer() + " has sent 10 ends (done 1) in a row; does it reset after an end?");
    if (in_a_row < kMost) return Status::Ok();
    return {StatusCode::kProtocol, transport_->peer() + " has sent " + std::to_string(kMost) +
                                       " ends (done 1) in a row; its next message after an end must be a first "
                                       "observation (done 0)"};
  }

  Status ReadObservation(std::byte* row, float* reward, bool* done) {
    const Result<std::string_view> message = ReadMessage(options_.deadline_s, ended_ ? kAfterEndHint : nullptr);
    if (!message.ok()) return NamingPeer(message.status(), *transport_);
    const bool act_only = request_.training_length == 0;
    const Layout& layout = spec_.behaviours[0].observation_layout;
    const Status read = text1::ParseObservation(*message, layout, act_only, row, reward, done);
    ended_ = read.ok() && *done;
    return NamingPeer(read, *transport_);
  }

  /// The next message, within `deadline_s`. `hint` is logged once, behind the peer, when nothing came for after_end_s.
  Result<std::string_view> ReadMessage(double deadline_s, const char* hint) {
    const double start = Now();
    while (true) {
      std::string_view message = framer_.Next();
      if (!message.empty()) return message;
      const bool partial = !framer_.pending().empty();
      const double left = deadline_s - (Now() - start);
      if (left <= 0.0) {
        return Status{StatusCode::kDeadlineExceeded,
                      transport_->peer() + " is silent for " + NumberText(deadline_s) + " s" +
                          (partial ? " in the middle of " + Quote(framer_.pending()) : "") +
                          "; if it is paused, raise --deadline"};
      }
      if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed)) {
        return Status{StatusCode::kCancelled, "stopped while waiting for " + transport_->peer()};
      }
      double wait = partial ? std::min(left, options_.quiet_s) : left;
      if (hint != nullptr) wait = std::min(wait, options_.after_end_s);
      if (options_.stop != nullptr) wait = std::min(wait, kStopLook);
      const Result<std::size_t> count = transport_->Read(framer_.Writable(), wait);
      if (!count.ok()) return count.status();
      CONSAC_RETURN_IF_ERROR(framer_.Commit(*count));
      if (*count > 0) continue;
      if (partial && MayEndHere()) {
        message = framer_.Quiet();
        if (!message.empty()) return message;
      }
      if (hint != nullptr && Now() - start >= options_.after_end_s) {
        warnings_.Say(transport_->peer() + hint);
        hint = nullptr;
      }
    }
  }

  // A message that began but stopped: without terminators it is one only where no further byte must follow. An
  // observation with a reward always ends in `done`, so half of one is waited for.
  bool MayEndHere() const {
    const std::string_view pending = framer_.pending();
    const auto hashes = std::count(pending.begin(), pending.end(), '#');
    if (spec_.behaviours.empty()) return hashes >= 6 || hashes == 0;
    return request_.training_length == 0 && hashes == 0;
  }

  std::unique_ptr<Transport> transport_;
  EnvClientOptions options_;
  Framer framer_;
  EnvSpec spec_;
  SessionRequest request_;
  std::vector<char> action_text_;
  Refusals warnings_;  // an engine may give cause for one at every step
  std::int64_t steps_ = 0;
  bool ended_ = false;  // the latest message was an episode's end, and no action has been sent since
};

}  // namespace

Result<std::unique_ptr<EnvClient>> OpenTextClient(std::unique_ptr<Transport> transport, const EnvClientOptions& options,
                                                  std::span<const std::byte> first) {
  auto client = std::make_unique<TextClient>(std::move(transport), options, first);
  CONSAC_RETURN_IF_ERROR(client->ReadSetup());
  return std::unique_ptr<EnvClient>(std::move(client));
}

}  // namespace consac
