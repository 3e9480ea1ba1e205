// Many steps in a row within a conformance case.
#include <fmt/format.h>

#include <chrono>

#include "cli/conformance_conversation.h"
#include "consac/base/hash.h"

namespace consac::cli {

Status Conversation::Play(const Case& what) {
  const std::string until = what.value("until", "");
  const int steps = what.value("steps", 0);
  std::string looked_at;  // of the whole play, a hash of each RESULT
  double deserted_at = Now();
  for (int step = 0; step < steps || !check_.anyone(); ++step) {
    if (until == "over" && Ended() > 0) return Status::Ok();
    if (until == "ended" && step > 0 && AnyIsOver()) return Status::Ok();
    if (check_.anyone()) deserted_at = Now();
    if (Now() - deserted_at > patience_s_)
      return Failed(fmt::format("nobody takes part: state 16 has been set for no slot for {} s (R77)", patience_s_));
    const Status status = PlayOne();
    if (!status.ok()) return {status.code(), fmt::format("at its step {}: {}", step + 1, status.message())};
    const std::string seen = results_.LookedAt(result_);
    const std::span<const std::byte> bytes = std::as_bytes(std::span(seen));
    looked_at += Sha256Hex({&bytes, 1});
  }
  return until == "over" || until == "ended" ? Over(fmt::format("no episode ended within {} steps", steps))
                                             : Compare(what, result_, looked_at);
}

std::size_t Conversation::Ended() const {
  std::size_t ended = 0;
  for (std::size_t i = 0; i < blocks_.environments; ++i) ended += check_.over(i) ? 1 : 0;
  return ended;
}

bool Conversation::AnyIsOver() const {
  bool any = false;
  for (std::size_t i = 0; i < blocks_.environments; ++i) any = any || results_.IsOver(result_, i);
  return any;
}

Status Conversation::PlayOne() {
  const bool resets = spec_.autoreset == protocol2::Autoreset::kDisabled && Ended() > 0;
  if (!resets) {
    CONSAC_RETURN_IF_ERROR(Ask(FrameType::kStep, request_ + 1, payloads_.Of("legal", result_)));
    return DoExpect({{"type", "RESULT"}, {"request", request_}});
  }
  CONSAC_RETURN_IF_ERROR(
      Ask(FrameType::kReset, request_ + 1, payloads_.ResetWhere([&](std::size_t i) { return check_.over(i); })));
  CONSAC_RETURN_IF_ERROR(DoExpect({{"type", "RESULT"}, {"request", request_}, {"or", "UNSUPPORTED"}}));
  if (judged_ == request_) return Status::Ok();
  CONSAC_RETURN_IF_ERROR(Ask(FrameType::kReset, request_ + 1, payloads_.Of("all", result_)));
  return DoExpect({{"type", "RESULT"}, {"request", request_}});
}

}  // namespace consac::cli
