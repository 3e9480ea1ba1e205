#include "link.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>

#include "consac/policy/demonstration.h"
#include "worlds/registry.h"

namespace consac::run {
namespace {

constexpr double kRetryPause = 0.2;        // s between attempts to connect
constexpr double kReconnectTimeout = 2.0;  // s
constexpr double kSayEvery = 3.0;          // s between lines about it

class LocalLink final : public WorldLink {
 public:
  explicit LocalLink(std::unique_ptr<VectorEnv> env) : env_(std::move(env)) {}
  const EnvSpec& spec() const override { return env_->spec(); }
  Status Reset(std::uint64_t seed, std::span<Batch> batches) override {
    env_->Reset(seed, batches);
    return Status::Ok();
  }
  Status Step(std::span<Batch> batches, MoreSteps) override {
    env_->Step(batches);
    return Status::Ok();
  }
  std::span<const std::uint8_t> present(std::size_t b) const override { return env_->present(b); }
  std::span<const InfoColumn> infos() const override { return env_->infos(); }
  double world_share() const override { return 1.0; }
  void SetParameters(std::int32_t environment, std::span<const double> values) override {
    env_->SetParameters(environment, values);
  }
  void TakeStatistics(std::vector<Statistic>* noted) override { env_->TakeStatistics(noted); }
  bool prices_goals() const override { return env_->prices_goals(); }
  Status PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) override {
    env_->PriceGoals(b, observations, rows, rewards);
    return Status::Ok();
  }
  void Visit(Archive& archive) override { env_->Visit(archive); }
  std::string description() const override {
    const std::int32_t copies = spec().behaviours[0].slots;
    return fmt::format("{} in this process, {} {}", spec().id, copies, copies == 1 ? "copy" : "copies");
  }

 private:
  std::unique_ptr<VectorEnv> env_;
};

/// Nobody is there, ever.
class RecordedLink final : public WorldLink {
 public:
  RecordedLink(BehaviourSpec behaviour, std::int64_t steps, std::string path)
      : present_(static_cast<std::size_t>(behaviour.slots)), steps_(steps), path_(std::move(path)) {
    spec_.id = "demonstrations";
    spec_.behaviours.push_back(std::move(behaviour));
  }
  const EnvSpec& spec() const override { return spec_; }
  Status Reset(std::uint64_t, std::span<Batch>) override { return Status::Ok(); }
  Status Step(std::span<Batch>, MoreSteps) override { return Status::Ok(); }
  std::span<const std::uint8_t> present(std::size_t) const override { return present_; }
  double world_share() const override { return 0.0; }
  void Visit(Archive&) override {}
  std::string description() const override { return fmt::format("{} recorded steps in '{}'", steps_, path_); }

 private:
  EnvSpec spec_;
  const std::vector<std::uint8_t> present_;
  const std::int64_t steps_;
  const std::string path_;
};

class EngineLink final : public WorldLink {
 public:
  explicit EngineLink(std::unique_ptr<EnvClient> client) : client_(std::move(client)) {}
  ~EngineLink() override { client_->Close(); }
  const EnvSpec& spec() const override { return client_->spec(); }
  Status Reset(std::uint64_t seed, std::span<Batch> batches) override {
    const Status status = client_->Reset(seed, batches);
    if (status.ok()) Keep();
    return status;
  }
  Status Step(std::span<Batch> batches, MoreSteps more) override {
    const double start = Now();
    const std::lock_guard asking(asking_);
    const Status status = client_->Step(batches, more);
    seconds_ = Now() - start;
    if (status.ok()) Keep();
    return status;
  }
  void SetParameters(std::int32_t environment, std::span<const double> values) override {
    client_->SetParameters(environment, values);
  }
  void TakeStatistics(std::vector<Statistic>* noted) override {
    noted->insert(noted->end(), noted_.begin(), noted_.end());
    noted_.clear();
  }
  bool behind_connection() const override { return true; }
  bool prices_goals() const override { return client_->prices_goals(); }
  Status PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) override {
    const std::lock_guard asking(asking_);
    return client_->PriceGoals(b, observations, rows, rewards);
  }
  std::span<const std::uint8_t> present(std::size_t b) const override { return client_->present(b); }
  double world_share() const override {
    return seconds_ > 0.0 ? std::min(1.0, client_->engine_seconds() / seconds_) : 0.0;
  }
  void KeepAlive() override { client_->KeepAlive(); }
  void Visit(Archive&) override {}
  SessionRequest request() const override { return client_->request(); }
  std::string description() const override { return client_->description(); }

 private:
  void Keep() {
    const std::span<const Statistic> noted = client_->statistics();
    if (noted_.size() < kMostNoted) noted_.insert(noted_.end(), noted.begin(), noted.end());
  }

  static constexpr std::size_t kMostNoted = 65536;  // of whom nobody takes; those of one RESULT more
  std::unique_ptr<EnvClient> client_;
  std::vector<Statistic> noted_;  // since they were taken
  std::mutex asking_;             // a step may be under way while what was learned from before asks for prices
  double seconds_ = 0.0;          // of the latest step
};

}  // namespace

bool IsUrl(const std::string& world) {
  return world.find("://") != std::string::npos;
}

std::vector<std::string> SplitUrls(const std::string& world) {
  std::vector<std::string> urls;
  for (std::size_t begin = 0; begin <= world.size();) {
    const std::size_t end = std::min(world.find(',', begin), world.size());
    urls.push_back(world.substr(begin, end - begin));
    begin = end + 1;
  }
  return urls;
}

Result<std::unique_ptr<WorldLink>> MakeLocalLink(const std::string& world, std::int32_t copies) {
  Result<std::unique_ptr<VectorEnv>> env = worlds::MakeWorld(world, copies);
  if (!env.ok()) return env.status();
  return MakeLocalLink(std::move(*env));
}

Result<std::unique_ptr<WorldLink>> MakeRecordedLink(const std::string& path) {
  Result<Demonstration> recorded = Demonstration::Load(path);
  if (!recorded.ok()) return recorded.status();
  return std::unique_ptr<WorldLink>(
      std::make_unique<RecordedLink>(std::move(recorded->behaviour), recorded->steps(), path));
}

std::unique_ptr<WorldLink> MakeLocalLink(std::unique_ptr<VectorEnv> env) {
  return std::make_unique<LocalLink>(std::move(env));
}

Result<std::unique_ptr<WorldLink>> OpenEngine(std::unique_ptr<Transport> transport, const EnvClientOptions& options) {
  Result<std::unique_ptr<EnvClient>> client = EnvClient::Open(std::move(transport), options);
  if (!client.ok()) return client.status();
  return std::unique_ptr<WorldLink>(std::make_unique<EngineLink>(std::move(*client)));
}

namespace {

// An old engine that was slow to send its text setup has heard a HELLO by then: it is asked again, without one.
Result<std::unique_ptr<WorldLink>> OpenEitherProtocol(const Endpoint& endpoint, std::unique_ptr<Transport> transport,
                                                      EnvClientOptions options) {
  options.reconnect = [endpoint] { return ConnectTcp(endpoint, kReconnectTimeout); };
  Result<std::unique_ptr<WorldLink>> link = OpenEngine(std::move(transport), options);
  if (link.ok() || link.status().code() != StatusCode::kFailedPrecondition) return link;
  options.protocol = Protocol::kText1;
  Result<std::unique_ptr<Transport>> again = ConnectTcp(endpoint, kReconnectTimeout);
  if (!again.ok()) return again.status();
  return OpenEngine(std::move(*again), options);
}

}  // namespace

Result<std::unique_ptr<WorldLink>> ConnectEngine(const EngineOptions& options,
                                                 const std::function<void(const std::string&)>& say) {
  const Result<Endpoint> endpoint = Endpoint::Parse(options.url);
  if (!endpoint.ok()) return endpoint.status();
  const double start = Now();
  double next_line = start;
  while (true) {
    const std::atomic<bool>* stop = options.client.stop;
    if (stop != nullptr && stop->load())
      return Status{StatusCode::kCancelled, "stopped while waiting for an engine at " + options.url};
    const double not_before = options.client.not_before != nullptr ? options.client.not_before->load() : 0.0;
    Result<std::unique_ptr<Transport>> transport =
        Now() >= not_before
            ? ConnectTcp(*endpoint, kReconnectTimeout)
            : Status{StatusCode::kUnavailable, fmt::format("{} has asked to be left alone for {:.0f} s more",
                                                           options.url, std::ceil(not_before - Now()))};
    if (transport.ok()) return OpenEitherProtocol(*endpoint, std::move(*transport), options.client);
    if (transport.status().code() != StatusCode::kUnavailable) return transport.status();
    const double waited = Now() - start;
    if (waited >= options.connect_timeout_s) {
      return Status{StatusCode::kUnavailable, fmt::format("{} (tried for {:.0f} s; --connect-timeout changes that)",
                                                          transport.status().message(), waited)};
    }
    if (Now() >= next_line) {
      say(fmt::format("waiting for an engine at {} ({:.0f} of {:.0f} s)", options.url, waited,
                      options.connect_timeout_s));
      next_line = Now() + kSayEvery;
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kRetryPause));
  }
}

}  // namespace consac::run
