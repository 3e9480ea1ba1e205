#include "options.h"

#include <cmath>

#include "consac/learn/algo/learner.h"
#include "reader.h"

namespace consac::godot {
namespace {

// Any longer wait is as good as for ever, and a clock still counts it.
constexpr double kLongest_s = 1e7;
// More than anything learns in, and still few enough to be multiplied by a number of agents.

Status CheckSeconds(std::string_view name, double seconds) {
  if (seconds >= 0.0 && seconds <= kLongest_s) return Status::Ok();
  return {StatusCode::kInvalidArgument,
          "serve: '" + std::string(name) + "' is " + std::to_string(seconds) + "; expected seconds from 0 to 1e7"};
}

std::string_view TypeText(learn::ParameterType type) {
  switch (type) {
    case learn::ParameterType::kReal:
      return "real";
    case learn::ParameterType::kInteger:
      return "integer";
    case learn::ParameterType::kBoolean:
      return "boolean";
    case learn::ParameterType::kSchedule:
      return "schedule";
    case learn::ParameterType::kChoice:
      return "choice";
    case learn::ParameterType::kText:
      return "text";
  }
  return "";
}

}  // namespace

Result<host::ServeOptions> ReadServe(const Dictionary& table) {
  host::ServeOptions options;
  EnvServerOptions& server = options.server;
  Reader reader(table, "serve: ");
  reader.Take("host", &options.endpoint.host);
  reader.Take("port", &options.endpoint.port);
  reader.Take("training_length", &server.training_length);
  reader.Take("model_name", &server.model_name);
  reader.Take("seed", &server.seed);
  reader.Take<Protocol>("protocol", &server.protocol,
                        {{"auto", Protocol::kAuto}, {"text1", Protocol::kText1}, {"protocol2", Protocol::kProtocol2}});
  reader.Take<text1::Terminator>("terminator", &server.terminator,
                                 {{"newline", text1::Terminator::kNewline}, {"none", text1::Terminator::kNone}});
  reader.Take("token", &server.token);
  reader.Take("wait_after_end", &server.wait_after_end);
  const std::initializer_list<std::pair<std::string_view, double*>> waits = {
      {"quiet_s", &server.quiet_s},         {"deadline_s", &server.deadline_s}, {"grace_s", &server.grace_s},
      {"handshake_s", &server.handshake_s}, {"write_s", &server.write_s},       {"resume_s", &server.resume_s},
      {"min_step_s", &server.min_step_s}};
  for (const auto& [name, seconds] : waits) reader.Take(name, seconds);
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  for (const auto& [name, seconds] : waits) CONSAC_RETURN_IF_ERROR(CheckSeconds(name, *seconds));
  if (options.endpoint.port < 0 || options.endpoint.port > 65535) {
    return Status{StatusCode::kInvalidArgument, "serve: 'port' is " + std::to_string(options.endpoint.port) +
                                                    "; expected 1 to 65535, or 0 for any free one"};
  }
  if (server.training_length < 0)
    return Status{StatusCode::kInvalidArgument, "serve: 'training_length' is negative; expected 0 or more"};
  return options;
}

Result<host::TrainOptions> ReadTrain(const Dictionary& table, std::vector<std::string>* start_from) {
  host::TrainOptions options;
  Dictionary hyperparameters;
  Reader reader(table, "train: ");
  reader.Take("algorithm", &options.algorithm);
  reader.Take("total_steps", &options.total_steps);
  reader.Take("start_from", start_from);
  reader.Take("seed", &options.seed);
  reader.Take<host::WhileLearning>("while_learning", &options.while_learning,
                                   {{"wait", host::WhileLearning::kWait}, {"go_on", host::WhileLearning::kGoOn}});
  reader.Take("environment_parameters", &options.environment_parameters);
  reader.Take("log_folder", &options.log_folder);
  reader.Take("hyperparameters", &hyperparameters);
  for (const auto& [name, value] : hyperparameters.entries())
    options.hyperparameters.emplace_back(name, SettingText(value));
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  return options;
}

Result<host::ActOptions> ReadAct(const Dictionary& table) {
  host::ActOptions options;
  Reader reader(table, "act: ");
  reader.Take("models", &options.models);
  reader.Take<ActionMode>("mode", &options.mode,
                          {{"deterministic", ActionMode::kDeterministic}, {"sample", ActionMode::kSample}});
  reader.Take("seed", &options.seed);
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  return options;
}

Array DescribeAlgorithms() {
  Array all;
  for (const learn::Algorithm& algorithm : learn::Algorithms()) {
    Dictionary row;
    row.Set("name", Variant::Of(std::string_view(algorithm.name)));
    row.Set("description", Variant::Of(std::string_view(algorithm.description)));
    all.Append(Variant::Of(row));
  }
  return all;
}

Result<Array> DescribeHyperparameters(const std::string& algorithm) {
  const Result<const learn::Algorithm*> found = learn::FindAlgorithm(algorithm);
  if (!found.ok()) return found.status();
  Array all;
  for (const learn::Hyperparameter& parameter : (*found)->hyperparameters) {
    Dictionary row;
    row.Set("name", Variant::Of(std::string_view(parameter.name)));
    row.Set("type", Variant::Of(TypeText(parameter.type)));
    row.Set("default", Variant::Of(std::string_view(parameter.default_value)));
    row.Set("low", Variant::Of(parameter.low));
    row.Set("high", Variant::Of(parameter.high));
    row.Set("choices", Variant::Of(std::string_view(parameter.choices)));
    row.Set("meaning", Variant::Of(std::string_view(parameter.meaning)));
    all.Append(Variant::Of(row));
  }
  return all;
}

}  // namespace consac::godot
