// consac eval: mean reward of a model over episodes.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/verbs.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

struct EvalFlags {
  run::EvaluateOptions options;
  bool stochastic = false, json = false;
};

int Eval(EvalFlags& flags) {
  flags.options.deterministic = !flags.stochastic;
  const Result<run::EvaluateSummary> summary = run::Evaluate(flags.options, StopSignal());
  if (!summary.ok()) return Fail("eval", summary.status());
  if (flags.json) {
    fmt::print("{}\n", nlohmann::json({{"episodes", summary->episodes},
                                       {"mean_reward", summary->mean_reward},
                                       {"std_reward", summary->std_reward},
                                       {"min_reward", summary->min_reward},
                                       {"max_reward", summary->max_reward},
                                       {"mean_length", summary->mean_length}})
                           .dump());
  } else {
    fmt::print("{} episodes: mean reward {:.4g} +- {:.3g} (from {:.4g} to {:.4g}), mean length {:.1f}\n",
               summary->episodes, summary->mean_reward, summary->std_reward, summary->min_reward, summary->max_reward,
               summary->mean_length);
  }
  return StopSignal().load() ? 130 : 0;
}

}  // namespace

Action AddEval(CLI::App& app) {
  const auto flags = std::make_shared<EvalFlags>();
  app.add_option("model", flags->options.model, "a .consac file or a run's name")->required();
  app.add_option("world", flags->options.world,
                 "a built-in world or tcp://host:port; the world it was trained on unless given");
  app.add_option("--dir", flags->options.directory, "folder of the runs");
  app.add_option("--episodes", flags->options.episodes, "episodes to average over")->check(CLI::PositiveNumber);
  app.add_option("--max-episode-steps", flags->options.max_episode_steps,
                 "steps after which an episode of an endless world counts")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", flags->options.seed, "seed of the worlds");
  app.add_option("--connect-timeout", flags->options.connect_timeout_s, "seconds to keep trying to reach an engine");
  app.add_option("--deadline", flags->options.deadline_s, "seconds of an engine's silence that end the session");
  app.add_flag("--stochastic", flags->stochastic, "draw actions instead of taking the most likely");
  app.add_flag("--json", flags->json, "one line of JSON");
  return [flags] { return Eval(*flags); };
}

}  // namespace consac::cli
