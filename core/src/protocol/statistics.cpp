// Statistics of the game's own as RESULT has them: JSON, a list of numbers for each name.
#include <cmath>
#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "protocol/protocol2_json.h"

namespace consac::protocol2 {
namespace {

Status WrongStatistics(const std::string& what) {
  return {StatusCode::kProtocol, "a RESULT breaks protocol 2: its statistics " + what + " (R105)"};
}

}  // namespace

Status ReadStatistics(std::span<const std::byte> json, std::vector<Statistic>* statistics) {
  const std::string_view text(reinterpret_cast<const char*>(json.data()), json.size());
  if (json.size() > kLargestJson) return WrongStatistics("are longer than 1 MiB");
  const Result<nlohmann::json> all = ParseObject(json);
  if (!all.ok()) return WrongStatistics("are no JSON object: " + Quote(text));
  for (const auto& [name, values] : all->items()) {
    if (const Status named = CheckName("statistic", name); !named.ok()) return WrongStatistics(named.message());
    if (!values.is_array() || values.empty())
      return WrongStatistics("have " + Quote(JsonText(values)) + " for " + Quote(name) +
                             ", expected a list of numbers");
    for (const nlohmann::json& value : values) {
      if (!value.is_number())
        return WrongStatistics("have " + Quote(JsonText(value)) + " for " + Quote(name) + ", expected numbers");
      statistics->push_back({name, value.get<double>()});
    }
  }
  return Status::Ok();
}

std::string EncodeStatistics(std::span<const Statistic> statistics) {
  nlohmann::json all = nlohmann::json::object();
  for (const Statistic& statistic : statistics) {
    if (std::isfinite(statistic.value)) all[statistic.name].push_back(statistic.value);
  }
  return all.empty() ? "" : JsonText(all);
}

}  // namespace consac::protocol2
