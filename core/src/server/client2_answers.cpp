// What comes from an engine: the answer that is waited for, what may come between, and what ends the session.
#include <algorithm>
#include <atomic>

#include "consac/base/text.h"
#include "server/client2.h"
#include "server/limits.h"

namespace consac {
namespace {

StatusCode CodeOf(std::string_view name) {
  if (name == "CAPACITY" || name == "SHUTTING_DOWN") return StatusCode::kUnavailable;
  if (name == "NON_FINITE") return StatusCode::kNonFinite;
  if (name == "AUTH_FAILED" || name == "SPEC_MISMATCH" || name == "OUT_OF_RANGE" || name == "UNSUPPORTED")
    return StatusCode::kInvalidArgument;
  return StatusCode::kProtocol;
}

}  // namespace

using protocol2::Frame;
using protocol2::FrameType;

Result<Frame> Client2::ReadAnswer(std::uint64_t request, double deadline_s) {
  Patience patience(deadline_s, paused_);
  while (true) {
    Frame frame;
    const Result<bool> whole = reader_.Next(&frame);
    if (!whole.ok()) return whole.status();
    if (*whole) {
      const Result<bool> answer = IsAnswer(frame, request, &patience);
      if (!answer.ok()) return answer.status();
      if (*answer) return frame;
      continue;
    }
    if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed))
      return Status{StatusCode::kCancelled, "stopped while waiting for " + transport_->peer()};
    const double left = patience.left();
    if (left <= 0.0) return Silent(patience);
    const Result<std::size_t> count =
        transport_->Read(reader_.Writable(), options_.stop != nullptr ? std::min(left, kStopLook) : left);
    if (!count.ok()) return count.status();
    reader_.Commit(*count);
  }
}

Result<bool> Client2::IsAnswer(const Frame& frame, std::uint64_t request, Patience* patience) {
  switch (frame.header.type) {
    case FrameType::kWelcome:
      open_ = true;  // the engine has a session now, which hears BYE whatever is wrong with it (R85)
      break;
    case FrameType::kPing:
      if (frame.payload.size() > protocol2::kLargestPing)
        return Status{StatusCode::kProtocol, transport_->peer() + " sent a PING of " +
                                                 std::to_string(frame.payload.size()) + " bytes; at most " +
                                                 std::to_string(protocol2::kLargestPing) + " are taken (R16)"};
      CONSAC_RETURN_IF_ERROR(SendControl(
          FrameType::kPong, std::string(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size())));
      return false;
    case FrameType::kPaused:
      if (!paused_) pauses_.Say(transport_->peer() + " is paused");
      paused_ = options_.waits_while_paused;
      if (paused_) patience->Pause();
      return false;
    case FrameType::kResumed:
      paused_ = false;
      deserted_at_ = -1.0;  // nor did its empty worlds grow older
      patience->Resume();
      return false;
    case FrameType::kPong:
      return false;
    case FrameType::kGoAway:
      return Farewell(frame);
    case FrameType::kError:
      return Refusal(frame);
    default:
      break;
  }
  if ((static_cast<std::uint16_t>(frame.header.type) & protocol2::kOptionalType) != 0) return false;
  if (frame.header.request == request) {
    alive_at_ = Now();
    return true;
  }
  if (!IsKnown(frame.header.type)) {
    return Status{StatusCode::kProtocol,
                  transport_->peer() + " sent a frame of type " + std::to_string(static_cast<int>(frame.header.type)) +
                      ", which protocol 2 does not know; types that may be passed over are from 32768 on"};
  }
  return Status{StatusCode::kProtocol, transport_->peer() + " answered request " +
                                           std::to_string(frame.header.request) + ", expected " +
                                           std::to_string(request)};
}

Status Client2::Farewell(const Frame& frame) {
  const Result<protocol2::GoAway> message = protocol2::ParseGoAway(frame.payload);
  if (!message.ok()) return message.status();
  refused_ = true;
  return {StatusCode::kUnavailable, transport_->peer() + " ends the session" +
                                        (message->reason.empty() ? "" : ": " + message->reason) +
                                        Later(message->retry_after_s)};
}

std::string Client2::Later(double retry_after_s) const {
  if (!(retry_after_s > 0.0)) return {};
  if (options_.not_before != nullptr) options_.not_before->store(Now() + retry_after_s);
  return " (it asks to be tried again in " + NumberText(retry_after_s) + " s)";
}

Status Client2::Refusal(const Frame& frame) {
  const Result<protocol2::ErrorMessage> error = protocol2::ParseError(frame.payload);
  if (!error.ok()) return error.status();
  refused_ = true;
  refusal_ = error->code;
  if (error->ends_connection) open_ = false;
  const std::string where = error->environment < 0 ? "" : ", environment " + std::to_string(error->environment);
  return {CodeOf(error->code), transport_->peer() + " refused (" + error->code + where + "): " + error->message +
                                   Later(error->retry_after_s)};
}

}  // namespace consac
