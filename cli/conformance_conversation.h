#pragma once
// The trainer's end of a conformance case, step by step. It keeps to the protocol itself: what may come between answers
// may, and every RESULT is judged.

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/conformance_frames.h"
#include "cli/conformance_payloads.h"
#include "cli/conformance_results.h"
#include "consac/protocol/result_check.h"
#include "consac/transport/transport.h"

namespace consac::cli {

/// One case under way.
class Conversation {
 public:
  using Case = nlohmann::json;
  using Frame = protocol2::Frame;
  using FrameType = protocol2::FrameType;

  Conversation(const Endpoint& endpoint, const std::string& token, double patience_s)
      : endpoint_(endpoint), token_(token), patience_s_(patience_s), writer_(patience_s) {}
  ~Conversation();

  Status Connect();
  /// A step of server.json.
  Status Do(const Case& step);

  /// Why nothing more is to be asked: what the case is of is not offered, or did not happen. "" while there is more.
  const std::string& over() const { return over_; }

 private:
  Status Send(FrameType type, std::uint64_t request, const std::string& payload, const Case& how = Case::object());
  /// What has ended without BYE is kept for a while; an engine of few sessions would have none for the next case.
  Status TakeUp();
  Status SayHello(const std::vector<std::string>& capabilities = {});
  Status ConnectAgain();
  /// A second trainer, while this one is there: it is served or told that there is no room.
  Status KnockBeside() const;
  /// That HELLO shows: the right one, or what a case has instead. Where none was given, a server asks for none.
  std::string TokenOf(const Case& what) const;
  Status DoSend(const Case& what);
  Status Over(const std::string& why);
  /// Sends; the judge hears of RESET and STEP.
  Status Ask(FrameType type, std::uint64_t request, const std::string& payload, const Case& how = Case::object());
  /// The next frame that is an answer; kUnavailable once the connection has ended. What comes between restarts no
  /// clock: a pause ends the case too, for nobody may be there to end it.
  Result<Frame> Next();
  Status Silent(bool paused) const;
  /// What may come between a request and its answer.
  Result<bool> IsAside(const Frame& frame, bool* paused);
  /// Whatever the server says to bytes of another protocol, it closes within so many seconds.
  Status ExpectGone(Transport& connection, double seconds) const;
  Status DoExpect(const Case& what);
  /// Says nothing for so long: of those who have time, and gave a longer --timeout.
  Status Wait(double seconds);
  /// A payload, and what is looked at of it or of a whole play, with those that were kept; over where what is to repeat
  /// itself does not.
  Status Compare(const Case& what, const std::string& payload, const std::string& looked_at);
  /// The same of each environment by itself: but for those in which an episode has ended.
  Status CompareEnvironments(const Case& what, const std::string& payload);
  Status CheckMessage(const Case& what, const Frame& frame, const std::string& payload);
  /// Over where WELCOME or SPEC lacks what the case needs.
  void CheckNeeds(const Case& what, Case message);
  Status TakeWelcome(const Frame& frame);
  Status TakeSpec(const Case& what, const Frame& frame);
  /// One that comes once more is not judged anew.
  Status TakeResult(std::uint64_t request, const std::string& payload);
  /// As many numbers as rows were asked for; "paid": what the RESULTs paid that the rows are from.
  Status TakeRewards(const Case& what, const std::string& payload) const;
  /// Steps all environments on and on; with `disabled` those whose episode is over are reset. Behind the last step, and
  /// with "somebody" from the first on, it goes on until somebody takes part (R77).
  Status Play(const Case& what);
  std::size_t Ended() const;
  /// Whether some episode is over with the latest RESULT (`same_step`).
  bool AnyIsOver() const;
  /// An engine that resets all of its environments or none is asked to reset all (R47).
  Status PlayOne();
  /// The engine may not have noticed yet that the connection is gone; "beside": it is not, and the engine closes it.
  Status Reconnect(const Case& how);

  static constexpr int kMostReconnects = 100;
  static constexpr std::size_t kMostPaid = 64;  // rows that are kept, and those of one RESULT more
  static constexpr const char* kKeepsNone = "its WELCOME has no `resume`: a lost connection ends a session";

  const Endpoint endpoint_;
  const std::string token_;
  const double patience_s_;
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_{protocol2::kLargestFrame};
  CaseWriter writer_;
  protocol2::SpecMessage spec_;
  Case offered_;  // SPEC's behaviours
  protocol2::Blocks blocks_;
  Payloads payloads_;
  Results results_;
  std::vector<std::string> capabilities_;  // of the session
  protocol2::Agreed agreed_;
  protocol2::ResultCheck check_;
  std::uint32_t session_ = 0, welcomed_ = 0;  // welcomed_: of the latest WELCOME, on whatever connection
  std::uint64_t request_ = 0, judged_ = 0;
  bool all_stepped_ = false;  // by the latest request
  std::string paid_rows_;     // that steps of all environments led to, and their rewards
  std::vector<double> paid_;
  std::int64_t relabelled_ = 0;                   // rows of the latest RELABEL
  std::string resume_, result_;                   // result_: the latest RESULT's payload
  Frame held_frame_;                              // WELCOME of a session that was taken up, while held_
  std::size_t limit_ = protocol2::kLargestFrame;  // WELCOME's
  bool crc_ = false, ended_ = false, held_ = false;
  std::string over_;
  std::int64_t world_at_fault_ = -1;                     // of the latest STEP that must be refused
  std::optional<std::string> pong_;                      // the bytes of the PONG that is waited for
  std::map<std::string, std::string> kept_, looked_at_;  // payloads, and what is looked at of them or of a play
};

}  // namespace consac::cli
