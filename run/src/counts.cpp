#include "counts.h"

#include <cstring>

#include "config_fields.h"

namespace consac::run {
namespace {

// Not counted to, but set: a step that may never come (eval_every).
constexpr std::string_view kPlanned = "next_evaluation", kOfWorld = "world/";

}  // namespace

Status CheckCounts(const StateMap& state) {
  for (const auto& [name, field] : state) {
    if (field.dtype != DType::kI64 || name.starts_with(kOfWorld)) continue;
    const std::int64_t most = name == kPlanned ? kMostSteps : kMostCounted;
    for (std::size_t at = 0; at + sizeof(std::int64_t) <= field.bytes.size(); at += sizeof(std::int64_t)) {
      std::int64_t count = 0;
      std::memcpy(&count, field.bytes.data() + at, sizeof(count));
      if (count >= 0 && count <= most) continue;
      return {StatusCode::kDataLoss, "state field '" + name + "' is " + std::to_string(count) +
                                         ", and what is counted is from 0 to " + std::to_string(most)};
    }
  }
  return Status::Ok();
}

}  // namespace consac::run
