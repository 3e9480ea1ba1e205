// consac eval: mean reward of a model over episodes.
#include <nlohmann/json.hpp>

#include "cli/flags.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

struct EvalFlags {
  run::EvaluateOptions options;
  std::int64_t seed = 1000;
  bool stochastic = false, json = false;
};

int Eval(EvalFlags& flags) {
  flags.options.deterministic = !flags.stochastic;
  flags.options.seed = static_cast<std::uint64_t>(flags.seed);
  const Result<run::EvaluateSummary> summary = run::Evaluate(flags.options, StopSignal());
  if (!summary.ok()) return Fail("eval", summary.status());
  if (StopSignal().load())
    PrintError("consac eval: interrupted after {} of {} episodes\n", summary->episodes, flags.options.episodes);
  if (summary->episodes == 0) return StopSignal().load() ? 130 : 0;
  if (flags.json) {
    Print("{}\n", nlohmann::json({{"episodes", summary->episodes},
                                  {"mean_reward", summary->mean_reward},
                                  {"std_reward", summary->std_reward},
                                  {"min_reward", summary->min_reward},
                                  {"max_reward", summary->max_reward},
                                  {"mean_length", summary->mean_length}})
                      .dump());
  } else {
    Print("{} episodes: mean reward {:.4g} +- {:.3g} (from {:.4g} to {:.4g}), mean length {:.1f}\n", summary->episodes,
          summary->mean_reward, summary->std_reward, summary->min_reward, summary->max_reward, summary->mean_length);
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
  AddWhole(app, "--episodes", &flags->options.episodes, 1, kMostWhole, "episodes to average over");
  AddWhole(app, "--max-episode-steps", &flags->options.max_episode_steps, 1, kMostWhole,
           "steps after which an episode of an endless world counts");
  AddWhole(app, "--seed", &flags->seed, 0, kMostWhole, "seed of the worlds");
  AddNumber(app, "--connect-timeout", &flags->options.connect_timeout_s, 0, kMostSeconds,
            "seconds to keep trying to reach an engine");
  AddNumber(app, "--deadline", &flags->options.deadline_s, 0, kMostSeconds,
            "seconds of an engine's silence that end the session");
  app.add_flag("--stochastic", flags->stochastic, "draw actions instead of taking the most likely");
  app.add_flag("--json", flags->json, "one line of JSON");
  return [flags] { return Eval(*flags); };
}

}  // namespace consac::cli
