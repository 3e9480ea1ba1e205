#include "config_fields.h"

#include <algorithm>
#include <cmath>

#include "consac/base/text.h"
#include "consac/env/parameter_laws.h"
#include "consac/learn/algo/learner.h"
#include "consac/transport/transport.h"
#include "frozen_player.h"
#include "link.h"
#include "worlds/registry.h"

namespace consac::run {
namespace {

constexpr auto kMost = static_cast<double>(kMostSteps);  // of any whole number
constexpr double kMostMebibytes = 1 << 30;

Status CheckAlgorithm(std::string_view value) {
  return learn::FindAlgorithm(value).status();
}

Status CheckPreset(std::string_view value) {
  return value.empty() ? Status::Ok() : learn::ParseGeneration(value).status();
}

Status CheckWorld(std::string_view value) {
  if (value.starts_with("tcp://")) {
    for (const std::string& url : SplitUrls(std::string(value))) CONSAC_RETURN_IF_ERROR(Endpoint::Parse(url).status());
    return Status::Ok();
  }
  const Status known = worlds::FindWorld(value).status();
  if (known.code() != StatusCode::kNotFound || value.find(':') == std::string_view::npos) return known;
  return {StatusCode::kInvalidArgument, "world = " + Quote(value) + " cannot be used; an engine is tcp://host:port"};
}

Status CheckProtocol(std::string_view value) {
  if (value == "auto" || value == "text1" || value == "2") return Status::Ok();
  return {StatusCode::kInvalidArgument, "protocol = " + Quote(value) + " cannot be used; expected auto, text1 or 2"};
}

Status CheckReward(std::string_view value) {
  double reward = 0.0;
  if (value.empty() || ParseHumanNumber(value, &reward)) return Status::Ok();
  return {StatusCode::kInvalidArgument, "stop_reward = " + Quote(value) + " cannot be used; expected a number"};
}

Status CheckFrozen(std::string_view value) {
  return ParseFrozen(value).status();
}

Status CheckLaws(std::string_view value) {
  const Status fits = ParseParameterLaws(value).status();
  return fits.ok() ? fits : Status{fits.code(), "environment_parameters: " + fits.message()};
}

Status CheckNonFinite(std::string_view value) {
  if (value == "error" || value == "replace") return Status::Ok();
  return {StatusCode::kInvalidArgument, "non_finite = " + Quote(value) + " cannot be used; expected error or replace"};
}

// `token` is a secret and is written nowhere. `name`, `directory`, `quiet`, `resume`, `force` and `forever` belong to
// one start of a run, not to the run: flags only.
constexpr Field kFields[] = {
    {"world", &RunConfig::world, 0, 0, OnResume::kMustStay, CheckWorld,
     "a built-in world, or tcp://host:port of an engine, of several with commas between"},
    {"algorithm", &RunConfig::algorithm, 0, 0, OnResume::kMustStay, CheckAlgorithm, "which algorithm learns"},
    {"preset", &RunConfig::preset, 0, 0, OnResume::kMustStay, CheckPreset,
     "whose defaults the hyperparameters have: sb2 or sb3 of Stable Baselines; empty: the algorithm's own"},
    {"steps", &RunConfig::steps, -1, kMost, OnResume::kMayChange, nullptr,
     "agent steps to train; -1: what the engine says, else 100000"},
    {"seed", &RunConfig::seed, 0, kMost, OnResume::kMustStay, nullptr, "of every random number"},
    {"envs", &RunConfig::envs, 1, 1e6, OnResume::kMustStay, nullptr, "copies of a built-in world"},
    {"threads", &RunConfig::threads, 1, 1024, OnResume::kMayChange, nullptr,
     "cores to learn on; never changes the result"},
    {"max_memory_mib", &RunConfig::max_memory_mib, 1, kMostMebibytes, OnResume::kMayChange, nullptr,
     "MiB for what is learned from and learned, all behaviours together; more is refused before any of it is taken"},
    {"checkpoint_every_s", &RunConfig::checkpoint_every_s, 0, kMost, OnResume::kMayChange, nullptr,
     "seconds between checkpoints; 0: not by time"},
    {"checkpoint_every_updates", &RunConfig::checkpoint_every_updates, 0, kMost, OnResume::kMayChange, nullptr,
     "updates between checkpoints; 0: not by updates"},
    {"keep_checkpoints", &RunConfig::keep_checkpoints, 1, kMost, OnResume::kMayChange, nullptr,
     "older ones are deleted"},
    {"eval_every", &RunConfig::eval_every, 0, kMost, OnResume::kMayChange, nullptr,
     "agent steps between evaluations of the models of now, the best of which are kept in best/; 0: none"},
    {"eval_episodes", &RunConfig::eval_episodes, 1, 1e9, OnResume::kMayChange, nullptr, "episodes of an evaluation"},
    {"eval_world", &RunConfig::eval_world, 0, 0, OnResume::kMayChange, CheckWorld,
     "where they are evaluated: a built-in world or an engine of its own; empty: as the world trained on"},
    {"stop_reward", &RunConfig::stop_reward, 0, 0, OnResume::kMayChange, CheckReward,
     "a mean reward, of an evaluation or else of the last 100 episodes, that ends the training; empty: none does"},
    {"init_model", &RunConfig::init_model, 0, 0, OnResume::kMustStay, nullptr,
     "a model or a run whose weights the training begins with; empty: fresh ones"},
    {"demonstrations", &RunConfig::demonstrations, 0, 0, OnResume::kMustStay, nullptr,
     "a file of recorded steps, for algorithms that learn from them; empty: none"},
    {"frozen", &RunConfig::frozen, 0, 0, OnResume::kMustStay, CheckFrozen,
     "behaviours that act by a model and do not learn, as prey=runs/a/prey.consac; several with commas between"},
    {"log_interval", &RunConfig::log_interval, 1, kMost, OnResume::kMayChange, nullptr,
     "reports of the algorithm between tables; which it makes and when is its own"},
    {"table", &RunConfig::table, 0, 0, OnResume::kMayChange, nullptr, "print the table of each update"},
    {"table_every_s", &RunConfig::table_every_s, 0, 1e9, OnResume::kMayChange, nullptr,
     "on a terminal: seconds between tables at least; 0: one for every update"},
    {"progress", &RunConfig::progress, 0, 0, OnResume::kMayChange, nullptr,
     "show a progress bar, or lines where there is no terminal"},
    {"tensorboard", &RunConfig::tensorboard, 0, 0, OnResume::kMayChange, nullptr, "write TensorBoard events"},
    {"connect_timeout_s", &RunConfig::connect_timeout_s, 0, 1e9, OnResume::kMayChange, nullptr,
     "keep trying to reach an engine for so many seconds"},
    {"deadline_s", &RunConfig::deadline_s, 0, 1e9, OnResume::kMayChange, nullptr,
     "longest silence of an engine, seconds"},
    {"quiet_s", &RunConfig::quiet_s, 0, 1e3, OnResume::kMayChange, nullptr,
     "text protocol 1: a message without terminator ends after this silence, seconds"},
    {"protocol", &RunConfig::protocol, 0, 0, OnResume::kMayChange, CheckProtocol,
     "what to speak with an engine: auto, text1 or 2"},
    {"lockstep", &RunConfig::lockstep, 0, 0, OnResume::kMayChange, nullptr,
     "with engines: no step is under way while the model learns"},
    {"answer_done", &RunConfig::answer_done, 0, 0, OnResume::kMayChange, nullptr,
     "text protocol 1: answer an episode's last observation"},
    {"environment_parameters", &RunConfig::environment_parameters, 0, 0, OnResume::kMustStay, CheckLaws,
     "parameters of the world: name=value, uniform LOW HIGH, log_uniform LOW HIGH or ramp FROM TO STEPS; commas "
     "between"},
    {"non_finite", &RunConfig::non_finite, 0, 0, OnResume::kMayChange, CheckNonFinite,
     "NaN or infinity from a world: error, or replace (by 0 or the nearest bound, counted)"},
    {"max_abs_reward", &RunConfig::max_abs_reward, 0, kMost, OnResume::kMayChange, nullptr,
     "a reward beyond this is treated as NaN is; 0: any finite one is taken"},
    {"one_step_episodes", &RunConfig::one_step_episodes, 0, 0, OnResume::kMayChange, nullptr,
     "episodes of a single step are meant so; false: 10,000 of them in a row are an error"},
};

Status Unusable(const Field& field, std::string_view text, const std::string& expected) {
  return {StatusCode::kInvalidArgument,
          std::string(field.name) + " = " + Quote(text) + " cannot be used; expected " + expected};
}

// Of the largest limits nobody needs to hear who has not gone beyond them.
std::string RangeText(const Field& field, std::string_view text) {
  const auto whole = [](double limit) { return std::to_string(static_cast<std::int64_t>(limit)); };  // limits are whole
  double number = 0.0;
  const bool beyond = ParseHumanNumber(text, &number) && number > field.high;
  return field.high >= kMost && !beyond ? " of at least " + whole(field.low)
                                        : " from " + whole(field.low) + " to " + whole(field.high);
}

template <class Whole>
Status SetWhole(const Field& field, std::string_view text, Whole* value) {
  std::int64_t parsed = 0;
  const bool fits = ParseHumanNumber(text, &parsed) && static_cast<double>(parsed) >= field.low &&
                    static_cast<double>(parsed) <= field.high;
  if (!fits) return Unusable(field, text, "a whole number" + RangeText(field, text));
  *value = static_cast<Whole>(parsed);
  return Status::Ok();
}

/// How each type of member is read, written and called.
struct Setter {
  const Field& field;
  std::string_view text;

  Status operator()(std::string* value) const {
    if (field.check != nullptr && !text.empty()) CONSAC_RETURN_IF_ERROR(field.check(text));
    *value = std::string(text);
    return Status::Ok();
  }
  Status operator()(bool* value) const {
    const bool yes = text == "true" || text == "True", no = text == "false" || text == "False";
    if (!yes && !no) return Unusable(field, text, "true or false");
    *value = yes;
    return Status::Ok();
  }
  Status operator()(double* value) const {
    double parsed = 0.0;
    if (!ParseHumanNumber(text, &parsed) || parsed < field.low || parsed > field.high) {
      return Unusable(field, text, "a number" + RangeText(field, text));
    }
    *value = parsed;
    return Status::Ok();
  }
  Status operator()(std::int64_t* value) const { return SetWhole(field, text, value); }
  Status operator()(std::uint64_t* value) const { return SetWhole(field, text, value); }
  Status operator()(std::int32_t* value) const { return SetWhole(field, text, value); }
};

struct Writer {
  std::string operator()(const std::string& value) const { return value; }
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(double value) const { return NumberText(value); }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(std::uint64_t value) const { return std::to_string(value); }
  std::string operator()(std::int32_t value) const { return std::to_string(value); }
};

struct TypeNamer {
  const char* operator()(const std::string&) const { return "text"; }
  const char* operator()(bool) const { return "true or false"; }
  const char* operator()(double) const { return "number"; }
  const char* operator()(std::int64_t) const { return "whole number"; }
  const char* operator()(std::uint64_t) const { return "whole number"; }
  const char* operator()(std::int32_t) const { return "whole number"; }
};

}  // namespace

std::span<const Field> Fields() {
  return kFields;
}

const Field* FindField(std::string_view name) {
  for (const Field& field : kFields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

Status SetField(const Field& field, std::string_view text, RunConfig* config) {
  const std::string algorithm = config->algorithm;
  const Status set = std::visit([&](auto member) { return Setter{field, text}(&(config->*member)); }, field.member);
  if (config->algorithm != algorithm) config->hyperparameters.clear();  // they were of another table
  if (set.ok() && !WasGiven(field, *config)) config->given.emplace_back(field.name);
  return set;
}

bool WasGiven(const Field& field, const RunConfig& config) {
  return std::find(config.given.begin(), config.given.end(), field.name) != config.given.end();
}

std::string FieldText(const Field& field, const RunConfig& config) {
  return std::visit([&](auto member) { return Writer{}(config.*member); }, field.member);
}

const char* FieldType(const Field& field) {
  return std::visit([](auto member) { return TypeNamer{}(RunConfig{}.*member); }, field.member);
}

Result<learn::HyperparameterSet> HyperparametersOf(const RunConfig& config) {
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config.algorithm);
  if (!algorithm.ok()) return algorithm.status();
  learn::HyperparameterSet values((*algorithm)->hyperparameters);
  CONSAC_RETURN_IF_ERROR(values.UsePreset(config.preset));
  // Defaults pass through Set as well, so that a value has one spelling whoever gave it.
  for (const learn::Hyperparameter& row : values.table()) {
    CONSAC_RETURN_IF_ERROR(values.Set(row.name, std::string(values.Text(row.name))));
  }
  for (const auto& [name, text] : config.hyperparameters) CONSAC_RETURN_IF_ERROR(values.Set(name, text));
  return values;
}

}  // namespace consac::run
