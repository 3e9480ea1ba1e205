// The learning proofs: trains every row of the table below on five seeds and writes what came of it as Markdown.
// Run by `make test-slow`; exits 1 when a row misses what it claims. Minutes, not seconds: no part of `make test`.
//   learning_proofs OUT.md SB3_CURVES.json [ROW-NAME-PART]
// With a part of a name only such rows are run; the others keep their lines of OUT.md, and what was written below its
// table by hand stays. The rows of SB3_CURVES.json (bench/compare/sb3_curves.py) are trained at the settings that stand
// there and compared with what Stable Baselines3 reached; those in Gymnasium's worlds are ecosystem_proofs.py's.

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
#include "worlds/registry.h"

namespace {

constexpr int kSeeds = 5;
const std::atomic<bool> kNeverStop{false};

/// One claim: this world, learned so, reaches that.
struct Proof {
  std::string name;                   ///< for the table
  std::string world;                  ///< a built-in world
  std::string algorithm;              ///< a row of learn::Algorithms()
  std::int64_t steps;                 ///< agent steps
  std::int32_t envs;                  ///< copies of the world
  bool over_tcp;                      ///< served by an EnvServer, text protocol 1
  bool suggested;                     ///< take the world's suggested hyperparameters
  std::vector<std::string> settings;  ///< further "key=value"
  double median_at_least;             ///< what the median seed must reach
  double seeds_at_least;              ///< what the seeds must reach
  int seeds = kSeeds;                 ///< so many of them
};

// The three worlds that were not tuned for are proven beside Stable Baselines3: bench/compare/sb3_learn.py.
const std::vector<Proof>& Proofs() {
  static const std::vector<Proof> proofs = {
      {"road over TCP, share of states with a step nearer", "road-v0", "ppo2", 20000, 1, true, true, {}, 0.99, 0.97},
      {"cartpole", "cartpole-v1", "ppo2", 100000, 8, false, true, {}, 475, 400},
      // Settings of Stable Baselines 2.10.2's Zoo: prioritised, duelling, double, one hidden layer that is normalised.
      {"cartpole by dqn of the first generation",
       "cartpole-v1",
       "dqn",
       100000,
       1,
       false,
       false,
       {"preset=sb2", "learning_rate=1e-3", "prioritized_replay=true", "layers=[64]", "layer_norm=true"},
       475,
       475,
       kSeeds - 1},
      {"pendulum", "pendulum-v1", "ppo", 300000, 4, false, true, {}, -250, -400},
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
    Proof proof{row["name"],
                row["world"],
                row["algorithm"],
                row["steps"],
                row["envs"],
                false,
                false,
                {fmt::format("policy={}", row["policy"].get<std::string>())},
                0,
                row["needs"],
                kSeeds - 1};
    for (const auto& [name, value] : row["settings"].items())
      proof.settings.push_back(name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
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
  const consac::worlds::World* world = *consac::worlds::FindWorld(proof.world);
  if (proof.suggested) {
    for (const auto& [name, value] : consac::worlds::SuggestedSettings(*world, proof.algorithm)) {
      config.hyperparameters.emplace_back(name, value);
    }
  }
  for (const std::string& setting : proof.settings) {
    const std::size_t equals = setting.find('=');
    if (setting.starts_with("preset=")) {
      config.preset = setting.substr(equals + 1);
      continue;
    }
    config.hyperparameters.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
  }

  std::thread engine;
  if (proof.over_tcp) {
    auto listener = consac::ListenTcp({"127.0.0.1", 0});
    if (!listener.ok()) return std::nan("");
    config.world = fmt::format("tcp://127.0.0.1:{}", (*listener)->port());
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
  // To three digits, as Stable Baselines3's are kept: a mean of ten times ten may miss it by a rounding.
  return verdict.ok() ? std::round(verdict->front().mean_reward * 1e3) / 1e3 : std::nan("");
}

/// One row of the table, and whether its claim holds.
struct Line {
  std::string text;
  bool holds;
};

Line Prove(const Proof& proof) {
  std::vector<double> results;
  double total_seconds = 0;
  std::string seeds;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    double seconds = 0;
    results.push_back(Run(proof, seed, &seconds));
    total_seconds += seconds;
    seeds += fmt::format("{}{:.4g}", seed > 1 ? ", " : "", results.back());
    fmt::print("{} seed {}: {:.4g} in {:.2f} s\n", proof.name, seed, results.back(), seconds);
    std::fflush(stdout);
  }
  std::vector<double> sorted = results;
  std::sort(sorted.begin(), sorted.end());
  const bool holds = std::none_of(results.begin(), results.end(), [](double r) { return std::isnan(r); }) &&
                     sorted[kSeeds / 2] >= proof.median_at_least &&
                     sorted[static_cast<std::size_t>(kSeeds - proof.seeds)] >= proof.seeds_at_least;
  return {fmt::format("| {} | {} | {} | {} x {} | {} | {:.4g} | {:.4g} / {:.4g} in {} of {} | {:.2f} | {} |\n",
                      proof.name, proof.world, proof.algorithm, proof.steps, proof.envs, seeds, sorted[kSeeds / 2],
                      proof.median_at_least, proof.seeds_at_least, proof.seeds, kSeeds, total_seconds / kSeeds,
                      holds ? "yes" : "**no**"),
          holds};
}

/// The page: lines by a row's name, and what stands below the table.
struct Page {
  std::map<std::string, std::string> lines;
  std::string notes;
};

constexpr std::string_view kNotMeasured = "Not measured yet: ";

/// The page as it lies there; nothing in it where there is none.
Page ReadPage(const char* path) {
  Page page;
  std::ifstream in(path);
  bool below = false;
  for (std::string line; std::getline(in, line);) {
    const bool row = line.starts_with("| ");
    below = below || row;
    if (row) {
      page.lines[line.substr(2, line.find(" |") - 2)] = line + "\n";
    } else if (below && !line.starts_with("|--") && !line.starts_with(kNotMeasured)) {
      page.notes += line + "\n";
    }
  }
  while (page.notes == "\n" || page.notes.ends_with("\n\n")) page.notes.pop_back();
  return page;
}

void WritePage(const char* path, const std::vector<Proof>& proofs, const Page& page) {
  std::ofstream out(path);
  out << "# Learning proofs\n\nWritten by `make test-slow`. Five seeds (1 to 5) a row. Result: mean return over 100 "
         "deterministic\n"
         "evaluation episodes; for the road the share of its 1,640 states in which the model steps nearer to the "
         "coin.\n"
         "Settings: `tests/slow/learning_proofs.cpp` and the worlds' suggested ones; rows that Stable Baselines3 "
         "learned "
         "too\n"
         "have those of [sb3_curves.md](sb3_curves.md) and need its median less one standard error. In Gymnasium's "
         "worlds:\n"
         "[ecosystem.md](ecosystem.md).\n\n"
         "| claim | world | algorithm | steps x worlds | seeds | median | needs median / seeds | s per run | "
         "holds |\n"
         "|---|---|---|---|---|---|---|---|---|\n";
  std::string missing;
  for (const Proof& proof : proofs) {
    const auto line = page.lines.find(proof.name);
    if (line != page.lines.end()) {
      out << line->second;
    } else {
      missing += fmt::format("{}`{}`", missing.empty() ? "" : ", ", proof.name);
    }
  }
  out << page.notes;
  if (!missing.empty()) out << "\n" << kNotMeasured << missing << ".\n";
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
  Page page = ReadPage(argv[1]);
  bool all = true;
  for (const Proof& proof : chosen) {
    const Line line = Prove(proof);
    all = line.holds && all;
    page.lines[proof.name] = line.text;
    WritePage(argv[1], proofs, page);
  }
  return all ? 0 : 1;
}
