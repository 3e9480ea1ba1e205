#pragma once
// The trainer's end of protocol 2: one request, one answer; between them pings and pauses. A connection that breaks is
// taken up again where there is a way to connect anew: the same request is sent once more and carried out once.
// Private to core/server.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "consac/base/hooks.h"
#include "consac/base/refusals.h"
#include "consac/protocol/protocol2.h"
#include "consac/protocol/relabel.h"
#include "consac/protocol/result_check.h"
#include "consac/server/env_client.h"
#include "server/shared_channel.h"

namespace consac {

/// How long an answer is waited for yet. Time does not count while the engine is paused; nothing else that it says
/// meanwhile, a PING least of all, gives it more.
class Patience {
 public:
  explicit Patience(double deadline_s, bool paused = false) : deadline_s_(deadline_s), end_(Now() + deadline_s) {
    if (paused) Pause();
  }
  void Pause() {
    if (!paused_) left_ = end_ - Now();
    paused_ = true;
  }
  void Resume() {
    if (paused_) end_ = Now() + left_;
    paused_ = false;
  }
  double deadline_s() const { return deadline_s_; }
  double left() const { return paused_ ? deadline_s_ : end_ - Now(); }

 private:
  double deadline_s_, end_, left_ = 0.0;
  bool paused_ = false;
};

/// A session with an engine of protocol 2, over a connection that it has been given.
class Client2 final : public EnvClient {
 public:
  Client2(std::unique_ptr<Transport> transport, const EnvClientOptions& options)
      : transport_(std::move(transport)), options_(options) {}
  ~Client2() override { Client2::Close(); }  // a session that is ended hears BYE (R85)

  Status Begin();

  const EnvSpec& spec() const override { return spec_; }
  const SessionRequest& request() const override { return request_ask_; }

  Status Reset(std::uint64_t seed, std::span<Batch> batches) override;
  Status Step(std::span<Batch> batches, MoreSteps) override;
  std::span<const std::uint8_t> present(std::size_t b) const override;
  double engine_seconds() const override { return engine_seconds_; }
  void SetParameters(std::int32_t environment, std::span<const double> values) override;
  std::span<const Statistic> statistics() const override { return statistics_; }
  std::span<const float> group_rewards() const override { return group_rewards_; }
  bool prices_goals() const override;
  Status PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) override;

  void KeepAlive() override;
  void Close() override;
  std::string description() const override;

 private:
  using Blocks = protocol2::Blocks;
  using Frame = protocol2::Frame;
  using FrameType = protocol2::FrameType;
  static constexpr double kRetryPause = 0.2;  // s between attempts to connect anew

  // ---- connecting

  Status BeginSession();
  Status AskForSpec(bool share);

  /// The same over TCP alone; memory cannot be shared, and `why` tells.
  Status AskWithoutSharing(const Status& why);

  /// A STEP moves all environments, which a run counts one by one, and each of their agents.
  const char* WhoseStep() const;
  Status SayHello();
  /// That a session which is asked for is taken up, as it was, and none else.
  Status CheckTakenUp(const protocol2::Hello& hello, const protocol2::Welcome& welcome) const;
  Status HelloFailed(const Status& why) const;
  Status Unexpected(const Frame& frame, const char* expected) const;

  // ---- frames out

  /// Room for a request's payload behind its header; zeroed.
  std::byte* BeginMessage(std::size_t payload_bytes);
  /// The same of a RESET or STEP: parameters that have been set go with it.
  std::byte* BeginMove(std::uint32_t flags, std::size_t payload_bytes);
  Status SendControl(FrameType type, const std::string& json);

  /// Sends what BeginMessage prepared and waits for its answer, over a new connection if the first breaks. A session
  /// that is over is not asked: kUnavailable at once.
  Result<Frame> Perform(FrameType type);

  /// The request through shared memory; kUnavailable when the connection beside it ended.
  Result<Frame> PerformShared(std::uint64_t request);
  Status Silent(const Patience& patience) const;

  enum class Said : std::uint8_t { kNotYet, kAlready };

  Status ConnectAnew(const Status& why, double start, Said said);
  Result<Frame> Request(FrameType type, const std::string& json);
  /// RESET of every environment, with seeds from `seed` on or without.
  Status ResetAll(std::optional<std::uint64_t> seed, std::span<Batch> batches);
  Status Exchange(FrameType type, std::span<Batch> batches);
  Status ExchangeGoals(const protocol2::Relabel& relabel, float* rewards);
  /// Rewards that are numbers on the wire and none in a batch: an error, or said to a caller that looks for itself.
  Status CheckRewards(const std::byte* payload, std::span<const Batch> batches);
  void ReadPresence(const std::byte* payload);
  /// Statistics, and what groups were paid.
  Status ReadExtras(std::span<const std::byte> payload);

  /// An engine that steps on and on with nobody in it has forgotten to say who takes part.
  Status CheckAnyone();

  // ---- frames in

  /// The answer to `request`; what comes between is dealt with. Time does not count while the engine is paused.
  Result<Frame> ReadAnswer(std::uint64_t request, double deadline_s);

  static bool IsKnown(FrameType type) { return type >= FrameType::kHello && type <= FrameType::kRewards; }

  Result<bool> IsAnswer(const Frame& frame, std::uint64_t request, Patience* patience);
  Status Farewell(const Frame& frame);

  /// Keeps when the engine wants to be tried again, and says it.
  std::string Later(double retry_after_s) const;
  Status Refusal(const Frame& frame);

  std::unique_ptr<Transport> transport_;
  const EnvClientOptions options_;
  // An engine may pause, close or pay too much at every step.
  Refusals pauses_{[](std::string_view line) { Log(LogLevel::kInfo, line); }};
  Refusals warnings_;
  protocol2::FrameReader reader_;
  protocol2::Welcome welcome_;
  EnvSpec spec_;
  SessionRequest request_ask_;
  Blocks blocks_;
  protocol2::ResultCheck check_;
  std::optional<SharedChannel> shared_;
  std::vector<std::byte> message_;  // the request under way
  std::vector<double> parameters_;  // [environments, parameters] to go with the next RESET or STEP; NaN: as it is
  std::uint64_t request_ = 0;
  std::int64_t steps_ = 0;
  std::vector<std::vector<std::uint8_t>> present_;  // [behaviours][slots]
  std::vector<Statistic> statistics_;
  std::vector<float> group_rewards_;  // [environments, groups]
  double engine_seconds_ = 0.0, deserted_at_ = -1.0;
  double alive_at_ = 0.0;  // when the engine last answered us, or was sent a PING
  bool agents_leave_ = false, sets_parameters_ = false, open_ = false, refused_ = false, takes_seeds_ = true;
  std::string refusal_;  // the code of the latest refusal
  std::string over_;     // by what the session ended, where we have ended it
  bool paused_ = false;  // the engine said so on this connection
};

}  // namespace consac
