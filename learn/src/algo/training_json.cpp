#include "algo/training_json.h"

#include <nlohmann/json.hpp>

#include "consac/base/json.h"

namespace consac::learn {

std::string HyperparametersJson(const HyperparameterSet& values) {
  nlohmann::json json = nlohmann::json::object();
  for (const Hyperparameter& row : values.table()) json[row.name] = values.Text(row.name);
  return JsonText(json);
}

std::string TrainingJson(const std::string& hyperparameters, std::int64_t steps, std::int64_t updates) {
  return "{\"hyperparameters\": " + hyperparameters + ", \"steps\": " + std::to_string(steps) +
         ", \"updates\": " + std::to_string(updates) + "}";
}

}  // namespace consac::learn
