#pragma once
// The world of a run, wherever it is: in this process or behind a connection. The training loop drives either through
// this one face. Private to run.

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "consac/env/vector_env.h"
#include "consac/run/training.h"
#include "consac/server/env_client.h"

namespace consac::run {

/// A world that a loop can drive.
class WorldLink {
 public:
  virtual ~WorldLink() = default;
  /// What it offers.
  virtual const EnvSpec& spec() const = 0;
  /// First observations into next_observations.
  virtual Status Reset(std::uint64_t seed, std::span<Batch> batches) = 0;
  /// One step.
  virtual Status Step(std::span<Batch> batches, MoreSteps more) = 0;
  /// Which slots of behaviour `b` have an agent; empty: all, always. See VectorEnv::present.
  virtual std::span<const std::uint8_t> present(std::size_t b) const = 0;
  /// Which part of the latest Step's time the world itself worked, 0 to 1; 0 where that is not known.
  virtual double world_share() const = 0;
  /// See VectorEnv; not while Step is under way.
  virtual void SetParameters(std::int32_t environment, std::span<const double> values) {
    (void)environment, (void)values;
  }
  /// Adds what the game has noted since the call before.
  virtual void TakeStatistics(std::vector<Statistic>* noted) { (void)noted; }
  /// Whether it is an engine's.
  virtual bool behind_connection() const { return false; }
  /// See VectorEnv. PriceGoals may be called while Step is under way on another thread, and then waits for it.
  virtual bool prices_goals() const { return false; }
  virtual Status PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) {
    (void)b, (void)observations, (void)rows, (void)rewards;
    return {StatusCode::kFailedPrecondition, description() + " cannot say what other goals would have paid"};
  }
  /// While learning goes on for long: an engine hears that its trainer lives.
  virtual void KeepAlive() {}
  /// State of a world in this process; nothing for an engine's.
  virtual void Visit(Archive& archive) = 0;
  /// What an engine asked for; zeros for a world in this process.
  virtual SessionRequest request() const { return {}; }
  /// For people: "road-v0 in this process, 8 copies".
  virtual std::string description() const = 0;
  /// See VectorEnv; none of an engine's.
  virtual std::span<const InfoColumn> infos() const { return {}; }
};

/// `copies` of a built-in world.
Result<std::unique_ptr<WorldLink>> MakeLocalLink(const std::string& world, std::int32_t copies);

/// A world of the caller's own.
std::unique_ptr<WorldLink> MakeLocalLink(std::unique_ptr<VectorEnv> env);
/// The agents that `path` is a recording of, for what is learned from recorded steps alone: nothing can be done there.
Result<std::unique_ptr<WorldLink>> MakeRecordedLink(const std::string& path);
/// A session with an engine that is connected already.
Result<std::unique_ptr<WorldLink>> OpenEngine(std::unique_ptr<Transport> transport, const EnvClientOptions& options);

/// "tcp://a:1,tcp://b:2" taken apart.
std::vector<std::string> SplitUrls(const std::string& world);

/// How an engine is reached.
struct EngineOptions {
  std::string url;                  ///< "tcp://host:port"
  double connect_timeout_s = 60.0;  ///< keep trying for so long
  EnvClientOptions client;          ///< deadlines
};
/// Connects, retrying while nobody listens; `say` hears about it every few seconds.
Result<std::unique_ptr<WorldLink>> ConnectEngine(const EngineOptions& options,
                                                 const std::function<void(const std::string&)>& say);

}  // namespace consac::run
