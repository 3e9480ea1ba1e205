#include "consac/policy/training_facts.h"

#include <nlohmann/json.hpp>

#include "consac/base/json.h"

namespace consac {

namespace {
nlohmann::json TrainingObject(std::string_view training_json) {
  const Result<nlohmann::json> read = ReadJson<nlohmann::json>(training_json);
  return read.ok() && read->is_object() ? *read : nlohmann::json::object();
}
}  // namespace

TrainingFacts FactsOf(std::string_view training_json) {
  const nlohmann::json training = TrainingObject(training_json);
  TrainingFacts facts;
  if (const auto at = training.find("algorithm"); at != training.end() && at->is_string())
    facts.algorithm = at->get<std::string>();
  if (const auto at = training.find("steps"); at != training.end() && at->is_number_integer())
    facts.steps = at->get<std::int64_t>();
  return facts;
}

std::string WithAlgorithm(std::string_view training_json, const std::string& algorithm) {
  nlohmann::json training = TrainingObject(training_json);
  training["algorithm"] = algorithm;
  return JsonText(training);
}

}  // namespace consac
