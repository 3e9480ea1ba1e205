// The learning proofs: trains every row of the table below on five seeds and writes what came of it as Markdown.
// Run by `make test-slow`; exits 1 when a row misses what it claims. Minutes, not seconds: no part of `make test`.
//   learning_proofs OUT.md SB3_CURVES.json [ROW-NAME-PART]
// With a part of a name only such rows are run; the others keep what OUT.md has of the same runs (proofs_page.h), and
// what was written below its table by hand stays. The rows of SB3_CURVES.json (bench/compare/sb3_curves.py) are trained
// at the settings that stand there and compared with what Stable Baselines3 reached; those in Gymnasium's worlds are
// ecosystem_proofs.py's.

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/policy/policy.h"
#include "consac/run/training.h"
#include "consac/server/env_server.h"
#include "tests/slow/proofs_page.h"
#include "worlds/registry.h"

namespace {

using consac::proofs::kSeeds;
using consac::proofs::Outcome;
using consac::proofs::Page;
using consac::proofs::Proof;

const std::atomic<bool> kNeverStop{false};

/// The hyperparameters that a built-in world suggests for an algorithm.
std::vector<std::pair<std::string, std::string>> Suggested(const char* world, const char* algorithm) {
  return consac::worlds::SuggestedSettings(**consac::worlds::FindWorld(world), algorithm);
}

// The three worlds that were not tuned for are proven beside Stable Baselines3: bench/compare/sb3_learn.py.
const std::vector<Proof>& Proofs() {
  static const std::vector<Proof> proofs = {
      {"road over TCP, share of states with a step nearer", "road-v0", "ppo2", 20000, 1, true, "",
       Suggested("road-v0", "ppo2"), 0.99, 0.97},
      {"cartpole", "cartpole-v1", "ppo2", 100000, 8, false, "", Suggested("cartpole-v1", "ppo2"), 475, 400},
      // Settings of Stable Baselines 2.10.2's Zoo: prioritised, duelling, double, one hidden layer that is normalised.
      {"cartpole by dqn of the first generation",
       "cartpole-v1",
       "dqn",
       100000,
       1,
       false,
       "sb2",
       {{"learning_rate", "1e-3"}, {"prioritized_replay", "true"}, {"layers", "[64]"}, {"layer_norm", "true"}},
       475,
       475,
       kSeeds - 1},
      {"pendulum", "pendulum-v1", "ppo", 300000, 4, false, "", Suggested("pendulum-v1", "ppo"), -250, -400},
      // FetchReach of the Zoo takes 4,000 to 6,000 steps to 95 %, 6,000 to 8,000 to all (rl-trained-agents, SAC + HER).
      {"success of yumi's reach by sac with hindsight, by 8,000 steps", "yumi-reach-v0", "sac", 8000, 1, false, "",
       Suggested("yumi-reach-v0", "sac"), 0.95, 0.95, kSeeds, true},
      {"success of yumi's reach by sac with hindsight, by 20,000 steps", "yumi-reach-v0", "sac", 20000, 1, false, "",
       Suggested("yumi-reach-v0", "sac"), 0.99, 0.99, kSeeds, true},
      {"success of yumi's dense reach by ppo", "yumi-reach-dense-v0", "ppo", 500000, 8, false, "",
       Suggested("yumi-reach-dense-v0", "ppo"), 0.95, 0.95, kSeeds, true},
  };
  return proofs;
}

/// The rows that Stable Baselines3 learned too: the median must reach its median less one standard error (what the row
/// says where that is not measured yet), 4 of 5 seeds what the row says, or as many as its own where these were fewer.
consac::Result<std::vector<Proof>> ProofsBesideSb3(const char* path) {
  const consac::Result<std::vector<std::byte>> bytes = consac::ReadFile(path);
  if (!bytes.ok()) return bytes.status();
  const auto json = consac::ReadJson<nlohmann::json>({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!json.ok()) return json.status();
  std::vector<Proof> proofs;
  for (const nlohmann::json& row : *json) {
    if (row.contains("served")) continue;
    Proof proof{
        row["name"], row["world"], row["algorithm"], row["steps"], row["envs"], false, "", {{"policy", row["policy"]}},
        0,           row["needs"], kSeeds - 1};
    for (const auto& [name, value] : row["settings"].items())
      proof.settings.emplace_back(name, value.is_string() ? value.get<std::string>() : value.dump());
    const bool measured = row.contains("median");
    proof.median_at_least =
        measured ? row["median"].get<double>() - row["standard_error"].get<double>() : proof.seeds_at_least;
    if (measured) {
      const auto reached = std::ranges::count_if(row["results"], [&](double r) { return r >= proof.seeds_at_least; });
      proof.seeds = std::min(proof.seeds, static_cast<int>(reached));
    }
    proofs.push_back(std::move(proof));
  }
  return proofs;
}

/// Share of the 1,640 states of the road (actor and coin differ) in which the model steps nearer to the coin.
double RoadAccuracy(const std::string& model) {
  consac::Result<consac::Policy> policy = consac::Policy::Load(model);
  if (!policy.ok()) return 0.0;
  consac::Rng rng(0, 0);
  int right = 0, states = 0;
  for (int actor = 0; actor <= 40; ++actor) {
    for (int coin = 0; coin <= 40; ++coin) {
      if (actor == coin) continue;
      const float observation[2] = {static_cast<float>(actor), static_cast<float>(coin)};
      std::int32_t action = 0;
      policy->Act(reinterpret_cast<const std::byte*>(observation), nullptr, 1, consac::ActionMode::kDeterministic, rng,
                  reinterpret_cast<std::byte*>(&action));
      const int next = actor + action - 1;
      right += std::abs(next - coin) < std::abs(actor - coin) && next >= 0 && next <= 40;
      ++states;
    }
  }
  return static_cast<double>(right) / states;
}

/// Trains one seed and judges the model; NaN, and a line on stderr, when something failed.
double Run(const Proof& proof, std::uint64_t seed, double* seconds) {
  consac::run::RunConfig config;
  config.world = proof.world;
  config.algorithm = proof.algorithm;
  config.steps = proof.steps;
  config.seed = seed;
  config.envs = proof.envs;
  config.directory = (std::filesystem::temp_directory_path() / "consac_learning_proofs").string();
  config.name = fmt::format("{}_{}", proof.world, seed);
  config.force = true;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  config.preset = proof.preset;
  config.hyperparameters = proof.settings;

  std::thread engine;
  if (proof.over_tcp) {
    auto listener = consac::ListenTcp({"127.0.0.1", 0});
    if (!listener.ok()) return std::nan("");
    config.world = fmt::format("tcp://127.0.0.1:{}", (*listener)->port());
    const consac::worlds::World* world = *consac::worlds::FindWorld(proof.world);
    engine = std::thread([world, seed, length = proof.steps, port = std::move(*listener)]() mutable {
      const std::unique_ptr<consac::VectorEnv> env = world->create(1);
      consac::EnvServerOptions options;
      options.training_length = length;
      options.seed = seed;
      auto server = consac::EnvServer::Create(*env, std::move(port), options);
      if (server.ok()) (void)(*server)->ServeSession(kNeverStop);
    });
  }
  const consac::Result<consac::run::RunSummary> summary = consac::run::Train(config, kNeverStop);
  if (engine.joinable()) engine.join();
  if (!summary.ok()) {
    fmt::print(stderr, "{} seed {}: {}\n", proof.name, seed, summary.status().message());
    return std::nan("");
  }
  *seconds = summary->seconds;
  if (proof.world == "road-v0") return RoadAccuracy(summary->models[0].path);
  consac::run::EvaluateOptions options;
  options.model = summary->models[0].path;
  options.world = proof.world;
  const auto verdict = consac::run::Evaluate(options, kNeverStop);
  if (!verdict.ok()) return std::nan("");
  // To three digits, as Stable Baselines3's are kept: a mean of ten times ten may miss it by a rounding.
  return std::round((proof.success ? verdict->front().success_rate : verdict->front().mean_reward) * 1e3) / 1e3;
}

Outcome Prove(const Proof& proof) {
  Outcome outcome;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    double seconds = 0;
    outcome.results.push_back(Run(proof, seed, &seconds));
    outcome.seconds += seconds / kSeeds;
    fmt::print("{} seed {}: {:.4g} in {:.2f} s\n", proof.name, seed, outcome.results.back(), seconds);
    std::fflush(stdout);
  }
  return outcome;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: learning_proofs OUT.md SB3_CURVES.json [ROW-NAME-PART]\n");
    return 2;
  }
  std::vector<Proof> proofs = Proofs();
  auto beside = ProofsBesideSb3(argv[2]);
  if (!beside.ok()) {
    fmt::print(stderr, "{}\n", beside.status().message());
    return 2;
  }
  proofs.insert(proofs.end(), beside->begin(), beside->end());
  std::vector<Proof> chosen = proofs;
  if (argc > 3) {
    const auto asked = [&](const Proof& proof) { return proof.name.find(argv[3]) != std::string::npos; };
    std::erase_if(chosen, std::not_fn(asked));
    if (chosen.empty()) {
      fmt::print(stderr, "no row has '{}' in its name; the names are those of {}\n", argv[3], argv[1]);
      return 2;
    }
  }
  std::ifstream in(argv[1]);
  Page page = consac::proofs::ReadPage(in);
  in.close();
  const auto write = [&] {
    std::ofstream out(argv[1]);
    consac::proofs::WritePage(out, proofs, page);
  };
  write();  // by what the rows ask for now
  bool all = true;
  for (const Proof& proof : chosen) {
    const Outcome outcome = Prove(proof);
    all = consac::proofs::Holds(proof, outcome) && all;
    page.outcomes[consac::proofs::RunOf(proof)] = outcome;
    write();
  }
  return all ? 0 : 1;
}
