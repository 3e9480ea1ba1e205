// consac eval: mean reward of a model over episodes.
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/flags.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/json.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

struct EvalFlags {
  run::EvaluateOptions options;
  std::int64_t seed = 1000;
  bool stochastic = false, json = false;
};

nlohmann::json VerdictJson(const run::EvaluateSummary& verdict) {
  nlohmann::json json = {{"episodes", verdict.episodes},     {"mean_reward", verdict.mean_reward},
                         {"std_reward", verdict.std_reward}, {"min_reward", verdict.min_reward},
                         {"max_reward", verdict.max_reward}, {"mean_length", verdict.mean_length}};
  if (!std::isnan(verdict.success_rate)) json["success_rate"] = verdict.success_rate;
  return json;
}

void PrintJson(const std::vector<run::EvaluateSummary>& verdicts) {
  nlohmann::json json;
  for (const run::EvaluateSummary& verdict : verdicts) json["behaviours"][verdict.behaviour] = VerdictJson(verdict);
  Print("{}\n", AsciiJsonText(verdicts.size() == 1 ? VerdictJson(verdicts[0]) : json));
}

void PrintText(const std::vector<run::EvaluateSummary>& verdicts) {
  for (const run::EvaluateSummary& verdict : verdicts) {
    const std::string whose = verdicts.size() == 1 ? "" : verdict.behaviour + ": ";
    if (verdict.episodes == 0) {
      Print("{}no episode ended\n", whose);
      continue;
    }
    Print("{}{} episodes: mean reward {:.4g} +- {:.3g} (from {:.4g} to {:.4g}), mean length {:.1f}", whose,
          verdict.episodes, verdict.mean_reward, verdict.std_reward, verdict.min_reward, verdict.max_reward,
          verdict.mean_length);
    if (!std::isnan(verdict.success_rate)) Print(", {:.4g} % succeed", 100.0 * verdict.success_rate);
    Print("\n");
  }
}

int Eval(EvalFlags& flags) {
  flags.options.deterministic = !flags.stochastic;
  flags.options.seed = static_cast<std::uint64_t>(flags.seed);
  flags.options.say = [](const std::string& line) { PrintError("consac eval: {}\n", line); };
  const Result<std::vector<run::EvaluateSummary>> verdicts = run::Evaluate(flags.options, StopSignal());
  if (!verdicts.ok()) return Fail("eval", verdicts.status());
  const int code = StopSignal().load() ? 130 : 0;
  std::int64_t episodes = 0;
  for (const run::EvaluateSummary& verdict : *verdicts) episodes += verdict.episodes;
  if (code != 0) {
    PrintError("consac eval: interrupted after {} of {} episodes\n", episodes,
               flags.options.episodes * static_cast<std::int64_t>(verdicts->size()));
  }
  if (episodes == 0) return code;
  if (flags.json)
    PrintJson(*verdicts);
  else
    PrintText(*verdicts);
  return code;
}

}  // namespace

Action AddEval(CLI::App& app) {
  const auto flags = std::make_shared<EvalFlags>();
  app.add_option("model", flags->options.model, "a .consac file, or the name of a run, all of whose models are judged")
      ->required();
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
  AddToken(app, &flags->options.token, "access token that the engine asks for");
  app.add_flag("--stochastic", flags->stochastic, "draw actions instead of taking the most likely");
  app.add_flag("--json", flags->json, "one line of JSON");
  return [flags] { return Eval(*flags); };
}

}  // namespace consac::cli
