#pragma once
// The engine's end of a conformance case, step by step. Every RESET and STEP that arrives is judged; RESULTs are those
// of the case. kCancelled says that the case is not offered: the trainer does something else, which is its right.

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/conformance_frames.h"
#include "consac/protocol/protocol2.h"
#include "consac/transport/transport.h"

namespace consac::cli {

/// One case under way: an engine that is driven step by step.
class EngineScript {
 public:
  using Case = nlohmann::json;
  using Frame = protocol2::Frame;
  using FrameType = protocol2::FrameType;

  EngineScript(Listener& listener, double patience_s, const Case& spec, const Case& results,
               const std::string& autoreset = "same_step");
  ~EngineScript();

  /// The case's trainer connects; kUnavailable when none does within `patience_s`.
  Status Accept();
  /// A step of trainer.json.
  Status Do(const Case& step);

  /// HELLO and CONFIGURE are answered; with "RESULT" RESET too.
  Status Begin(const Case& how);
  /// A RESULT to the request that has come last.
  Status Answer(const std::string& payload);
  /// A frame of `type` comes, or with `closed` the end of the connection, or with `moves` a RESET or STEP: of those
  /// environments and as `moves` says where `environments` are named.
  Status DoExpect(const Case& what);
  /// A RESET or STEP comes, which is not judged, or the trainer leaves with BYE.
  Status GoesOnOrLeaves();
  /// Other ways to begin an episode that the trainer has asked for.
  const std::set<std::string>& asked() const { return asked_; }

 private:
  Status Send(FrameType type, std::uint64_t request, const std::string& payload);
  Status Write(const std::string& bytes, const Case& how = Case::object());
  Status DoSend(const Case& what);
  /// One of the file's RESULTs. "on" is right for a STEP, "first" instead for a RESET; of environments that the trainer
  /// has not chosen it says what was. Where `relabel` was agreed nothing is paid.
  std::string Fitted(const std::string& name) const;

  /// A case of capabilities is none for a trainer whose HELLO does not name them.
  Status CheckNamed(const std::vector<std::string>& capabilities) const;

  /// The next frame of any kind; kUnavailable once the trainer is gone.
  Result<Frame> Next(double patience_s = kConformancePatience);

  /// True when it was the frame that is waited for; false when it may come between.
  Result<bool> Take(const Case& what, const Frame& frame);
  /// One that would resume a session of another case begins anew.
  Result<bool> TakeHello(const Frame& frame);
  /// Other ways than the case's are refused; a trainer may then ask anew.
  Result<bool> TakeConfigure(const std::string& payload);
  /// A trainer that ends there has no case.
  Status EndsAtRefusal() const;
  Status CheckNumbers(const protocol2::FrameHeader& header) const;
  /// kCancelled where the latest request, which is right, is not what the case waits for.
  Status CheckOrder(const Case& what) const;
  /// A case of seeds is none for a trainer that sends none.
  Status CheckSeeds(bool wanted) const;
  /// That session's trainer connects once more within the case.
  Status AcceptAgain();

  /// The trainer leaves without another request; BYE and PING are none. `bye`: it says so. `after`: one RESET or STEP
  /// may have been on its way.
  Status ExpectClosed(const Case& what);
  /// The trainer, which has ended the session itself, begins a new one.
  Status AwaitAnew();
  /// RESULT after RESULT nobody takes part; the trainer goes on for a while, then leaves with BYE (R77). How long an
  /// answer may take is the trainer's own affair: one that waits for longer than we do is not judged, up to 60 s.
  Status Desert();
  /// RESETs and STEPs are answered until a RELABEL of one row or more comes, which must be right; kCancelled where none
  /// does. `or_moves`: a RESET or STEP will do.
  Status AwaitRelabel(bool or_moves);
  /// Its next STEP is answered by that ERROR; what needs a RESET since then is not stepped before it has one. The
  /// trainer may leave.
  Status AwaitMending(const std::string& code);
  /// PING is answered all the while, or nothing is.
  Status Silent(double seconds, bool answers);
  /// The connection breaks; the trainer comes back and repeats its request. `how`: true, or members that are wrong in
  /// the WELCOME that it gets.
  Status AwaitResume(const Case& how);

  Listener& listener_;
  const double patience_;
  Case spec_;
  const Case results_;
  const std::string autoreset_;
  std::set<std::string> asked_;
  std::vector<std::string> capabilities_;          // HELLO's
  std::vector<std::string> session_capabilities_;  // WELCOME's
  std::string offered_;                            // SPEC's payload
  std::int64_t relabelled_ = 0;                    // rows of the latest RELABEL
  CaseWriter writer_;
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_;
  std::optional<Frame> peeked_;                       // has been looked at and not been taken
  std::size_t max_frame_ = protocol2::kLargestFrame;  // HELLO's
  std::uint64_t request_ = 0;
  FrameType last_type_ = FrameType::kConfigure;  // of the latest request
  std::string last_, result_;                    // payloads of the latest request and the latest RESULT
  bool may_resume_ = false, resuming_ = false;
  bool relabels_ = false;     // WELCOME agreed to it
  protocol2::Agreed agreed_;  // likewise
  bool refused_ = false;      // the way that the latest CONFIGURE asked for
};

}  // namespace consac::cli
