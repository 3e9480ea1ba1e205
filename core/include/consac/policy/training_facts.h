#pragma once
// What a model says of its training, for people: PolicyData::training_json as values. Engines' editors show it.

#include <cstdint>
#include <string>
#include <string_view>

namespace consac {

/// Of one model; what its file does not say is empty, or 0.
struct TrainingFacts {
  std::string algorithm;   ///< a row of `consac list algorithms`, "ppo2"
  std::int64_t steps = 0;  ///< of single agents that it learned from
};

/// Reads them; a text that is no JSON object says nothing.
TrainingFacts FactsOf(std::string_view training_json);

/// The same text with the algorithm named; a text that is no JSON object becomes one.
std::string WithAlgorithm(std::string_view training_json, const std::string& algorithm);

}  // namespace consac
