#pragma once
// The engine's end of protocol 2. One request at a time: each is carried out once, its answer kept until the next, so
// that a trainer whose connection broke may ask again. Private to core/server.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "consac/base/hooks.h"
#include "consac/transport/outbox.h"
#include "server/session.h"
#include "server/shared_channel.h"
#include "server/stepper.h"

namespace consac {

/// One trainer's session after another over protocol 2.
class Session2Server final : public Session2 {
 public:
  explicit Session2Server(const SessionHost& host)
      : env_(host.env), options_(host.options), steps_(host.steps), farewells_(host.farewells), stepper_(host.env) {
    result_.Resize(protocol2::kHeaderBytes + stepper_.result_room());
    PlaceResult(result_.data());
  }
  ~Session2Server() override { DropUnderWay(); }

  Status Connect(Arrival arrival) override;
  bool Owns(const protocol2::Hello& hello) const override;
  Status MayComeBack(const protocol2::Hello& hello) const override;
  Result<bool> Pump(double timeout_s) override;
  Status End(const Status& why) override;

  std::string peer() const override { return transport_ == nullptr ? "" : transport_->peer(); }
  bool finished() const override { return finished_; }
  void Forget() override;
  bool resumable() const override { return resumable_ && Now() - broke_at_ < options_.resume_s; }

  void LookForTrainer() override { shared_idle_ = kSharedLooks - 1; }

  void SetPaused(bool paused) override;

 private:
  static constexpr unsigned kSharedLooks = 16;  // polls in vain between looks at the connection beside shared memory
  using Frame = protocol2::Frame;
  using FrameType = protocol2::FrameType;
  enum class Phase : std::uint8_t { kConfigure, kBegin, kRun };  // kBegin: before the first RESET
  /// What the latest request waits for: the frame rate, or worlds that have not settled.
  enum class UnderWay : std::uint8_t { kNothing, kWaitsForTime, kReset, kStep };

  std::size_t result_room() const { return protocol2::kHeaderBytes + stepper_.result_room(); }

  /// No request of this session is longer: what a trainer may make the engine hold.
  std::size_t LargestRequest() const;
  void PlaceResult(std::byte* at);

  // ---- shared memory

  Status EnterSharedMemory();

  /// What was answered last stays, should it be asked for again.
  void LeaveSharedMemory();
  Status HandleShared();

  /// The capabilities of a session that begins.
  void Agree(const protocol2::Hello& hello);

  // ---- a request that takes its time

  /// Waits at most `timeout_s`. False while there is nothing to do.
  Result<bool> GoOn(double timeout_s);

  /// The worlds have begun a RESET or a STEP: answers it if they are through with it.
  Status Await(UnderWay what);
  Status FinishUnderWay();

  /// Nothing is left to answer.
  void DropUnderWay();

  /// Sends an answer the way its request came.
  Status Deliver(std::span<const std::byte> frame);

  /// The rows that an answer without a RESULT has covered in shared memory are there again: the next RESULT goes on
  /// from them.
  void Uncover();

  // ---- frames out

  Status SendFrame(FrameType type, std::uint64_t request, std::span<const std::byte> payload);
  Status SendJson(FrameType type, std::uint64_t request, const std::string& json);

  /// A connection and a session begin unpaused: an engine that stands still says so anew.
  Status SayPaused();

  /// Room for the payload of an answer, behind its header; Deliver(answer_) sends it.
  std::byte* BeginAnswer(FrameType type, std::size_t payload_bytes);
  /// The answer to a request: kept, should it be asked for again.
  Status Answer(FrameType type, std::span<const std::byte> payload);
  Status Answer(FrameType type, const std::string& json) { return Answer(type, std::as_bytes(std::span(json))); }
  Status Repeat();

  /// Tells the trainer and lets the session go on, unless what came cannot be read.
  Status Refuse(const Status& why, const std::string& path = {});

  /// Tells the trainer; its number is not used up.
  Status RefuseUncounted(std::uint64_t request, const std::string& why);

  /// Tells the trainer and ends the connection. `request`: the number in the header that is refused, 0 for none.
  Status Fatal(const Status& why, std::uint64_t request = 0);

  // ---- frames in

  Result<bool> CheckTime();
  Status Handle(const Frame& frame);
  Status OnConfigure(const Frame& frame);
  Status OnReset(std::span<const std::byte> payload);
  Status OnStep(std::span<const std::byte> payload);
  Status StepWorlds();
  Status SendResult();
  Status OnRender(std::span<const std::byte> payload);
  Status OnRelabel(std::span<const std::byte> payload);

  VectorEnv& env_;
  const EnvServerOptions& options_;
  StepCount& steps_;
  Farewells& farewells_;
  Stepper stepper_;

  // The connection.
  std::unique_ptr<Transport> transport_;
  protocol2::FrameReader reader_;
  Outbox outbox_;
  Phase phase_ = Phase::kConfigure;
  double connected_at_ = 0.0, last_heard_ = 0.0, broke_at_ = 0.0;
  std::size_t max_frame_ = protocol2::kLargestFrame;
  bool connected_ = false, finished_ = false, resumable_ = false, refused_ = false;
  bool damaged_ = false;  // what it ended by was changed on its way: a loss, and nobody's fault
  bool paused_ = false;   // the engine stands still

  // The session.
  std::uint32_t number_ = 0;
  std::uint64_t request_ = 0;  // number of the latest
  std::string resume_;
  std::vector<std::string> capabilities_;  // were agreed, for its whole life; what follows says so too
  bool renders_ = false, relabels_ = false, shares_ = false;
  protocol2::Agreed agreed_;
  std::vector<std::byte> answer_, control_;  // latest answer that is no RESULT; frames between
  AlignedBytes relabel_;                     // RELABEL's payload
  std::vector<float> prices_;                // what its rows would have paid
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

}  // namespace consac
