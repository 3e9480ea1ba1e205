#include "consac/host/socket.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "consac/base/text.h"

namespace consac::host {
namespace {

constexpr double kQuiet = 0.002;            // s after which a message without terminator is complete
constexpr double kUntaken = 10.0;           // s after which a trainer that takes nothing is given up
constexpr std::size_t kMostHeld = 1 << 20;  // bytes that may wait for it

Status NotConnected(const char* what) {
  return {StatusCode::kFailedPrecondition,
          std::string("nobody is connected, so there is nobody to ") + what + "; accept a connection first"};
}

}  // namespace

Status Socket::Open(const Endpoint& endpoint) {
  if (open()) {
    return {StatusCode::kFailedPrecondition,
            "the socket is open already, on port " + std::to_string(port()) + "; close it before opening it again"};
  }
  Result<std::unique_ptr<Listener>> listener = ListenTcp(endpoint);
  if (!listener.ok()) return listener.status();
  listener_ = std::move(*listener);
  return Status::Ok();
}

void Socket::Close() {
  CloseConnection();
  if (waiting_ != nullptr) waiting_->Close();
  waiting_.reset();
  if (listener_ != nullptr) listener_->Close();
  listener_.reset();
}

Result<bool> Socket::CheckConnection() {
  if (connected()) return true;
  if (!open()) return Status{StatusCode::kFailedPrecondition, "the socket is closed; open it first"};
  if (waiting_ == nullptr) {
    Result<std::unique_ptr<Transport>> accepted = listener_->Accept(0.0);
    if (!accepted.ok()) return accepted.status();
    waiting_ = std::move(*accepted);
  }
  return waiting_ != nullptr;
}

Status Socket::AcceptConnection() {
  if (connected()) {
    return {StatusCode::kFailedPrecondition,
            peer() + " is connected already; close that connection before accepting another"};
  }
  const Result<bool> there = CheckConnection();
  if (!there.ok()) return there.status();
  if (!*there) return {StatusCode::kFailedPrecondition, "nobody waits to be accepted; check the connection first"};
  transport_ = std::move(waiting_);
  framer_ = text1::Framer();
  framer_.SetExpect(text1::Framer::Expect::kAction, false);
  message_.clear();
  outbox_.Clear();
  return Status::Ok();
}

Result<bool> Socket::CheckPendingData() {
  if (!message_.empty()) return true;
  if (!connected()) return NotConnected("hear from");
  if (!outbox_.empty()) {
    const Status sent = outbox_.Flush(*transport_, 0.0, kUntaken);
    if (!sent.ok()) {
      CloseConnection();
      return sent;
    }
  }
  std::string_view message = framer_.Next();
  if (message.empty()) {
    const Result<std::size_t> count = transport_->Read(framer_.Writable(), 0.0);
    Status status = count.ok() ? framer_.Commit(*count) : count.status();
    if (!status.ok()) {
      CloseConnection();
      return status;
    }
    if (*count > 0) last_byte_ = Now();
    message = framer_.Next();
    if (message.empty() && !framer_.pending().empty() && Now() - last_byte_ >= kQuiet) message = framer_.Quiet();
  }
  message_ = message;
  return !message_.empty();
}

Result<std::string> Socket::AcceptPendingData() {
  const Result<bool> there = CheckPendingData();
  if (!there.ok()) return there.status();
  if (!*there) return Status{StatusCode::kFailedPrecondition, "no message is there; check for pending data first"};
  return std::exchange(message_, {});
}

Status Socket::SendData(std::string_view message) {
  if (!connected()) return NotConnected("send to");
  std::string line(message);
  line += '\n';
  if (!outbox_.empty() && outbox_.held() + line.size() > kMostHeld) {
    return {StatusCode::kResourceExhausted,
            peer() + " has not taken " + std::to_string(outbox_.held()) +
                " bytes of earlier messages; check for pending data before sending more"};
  }
  const Status status = outbox_.Send(*transport_, std::as_bytes(std::span(line)));
  if (!status.ok()) CloseConnection();
  return status;
}

void Socket::CloseConnection() {
  if (transport_ != nullptr) transport_->Close();
  transport_.reset();
  message_.clear();
  outbox_.Clear();
}

// ---- messages

Result<std::string> CompileTrainingData(const text1::Setup& setup) {
  std::string message;
  CONSAC_RETURN_IF_ERROR(text1::EncodeSetup(setup, &message));
  return message;
}

Result<std::string> CompileEnvironmentMessage(const Space& observation_space, std::span<const double> observation,
                                              double reward, bool done) {
  CONSAC_RETURN_IF_ERROR(text1::CheckSpace(observation_space, "observation"));
  const Layout layout = Layout::Of(observation_space);
  const Leaf& leaf = layout.leaves[0];
  if (leaf.count != static_cast<std::int64_t>(observation.size())) {
    return Status{StatusCode::kInvalidArgument, "the observation has " + std::to_string(observation.size()) +
                                                    " numbers; " + observation_space.ToString() + " has " +
                                                    std::to_string(leaf.count)};
  }
  std::vector<std::byte> row(layout.row_bytes);
  for (std::size_t i = 0; i < observation.size(); ++i) {
    if (!std::isfinite(observation[i]))
      return Status{StatusCode::kNonFinite, "number " + std::to_string(i) + " of the observation is NaN or infinite"};
    WriteElement(leaf, row.data(), static_cast<std::int64_t>(i), observation[i]);
  }
  if (leaf.space.kind() == SpaceKind::kDiscrete) CONSAC_RETURN_IF_ERROR(CheckRow(layout, row.data()));
  const auto sum = static_cast<float>(reward);
  CONSAC_RETURN_IF_ERROR(text1::CheckSendable("observation", layout, row.data(), sum));
  std::string message(text1::MaxText(layout), '\0');
  message.resize(text1::EncodeObservation(layout, row.data(), sum, done, text1::Terminator::kNone, message));
  return message;
}

Result<std::vector<double>> DecodeAction(const Space& action_space, std::string_view message) {
  CONSAC_RETURN_IF_ERROR(text1::CheckSpace(action_space, "action"));
  const Layout layout = Layout::Of(action_space);
  std::vector<std::byte> row(layout.row_bytes);
  CONSAC_RETURN_IF_ERROR(text1::ParseAction(message, layout, row.data()));
  std::vector<double> action;
  for (std::int64_t i = 0; i < layout.leaves[0].count; ++i)
    action.push_back(ReadElement(layout.leaves[0], row.data(), i));
  return action;
}

}  // namespace consac::host
