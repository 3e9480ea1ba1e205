// The setup message of text protocol 1: spaces, training length, model name.
#include <algorithm>
#include <cmath>
#include <limits>

#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/protocol/text1.h"

namespace consac::text1 {
namespace {

// Infinity is never sent: an unbounded side travels as the largest float32.
constexpr double kUnboundedOnWire = std::numeric_limits<float>::max();

Status SetupError(std::string_view message, const std::string& what) {
  return {StatusCode::kProtocol, "setup " + Quote(message, 120) + ": " + what};
}

std::string BoundText(double bound) {
  char digits[32];
  const auto sent = static_cast<float>(std::isinf(bound) ? std::copysign(kUnboundedOnWire, bound) : bound);
  return std::string(digits, FormatNumber(sent, std::span<char, 32>(digits)));
}

void AppendSpace(const Space& space, std::string* out) {
  if (space.kind() == SpaceKind::kDiscrete) {
    *out += "D#" + std::to_string(space.n()) + "#0";
    return;
  }
  *out += "B#" + std::to_string(space.low().size()) + "#";
  std::string bounds;
  for (const std::vector<double>* side : {&space.low(), &space.high()}) {
    for (const double bound : *side) bounds += (bounds.empty() ? "" : ",") + BoundText(bound);
  }
  *out += bounds;
}

/// Cuts `text` at every `separator`.
std::vector<std::string_view> SplitFields(std::string_view text, char separator) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t at = text.find(separator);
    fields.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return fields;
    text.remove_prefix(at + 1);
  }
}

/// Reads "B#3#0,0,0,5,6,7" given as its three fields.
Result<Space> ParseSpace(std::string_view message, std::string_view role, std::span<const std::string_view> fields) {
  const std::string name(role);
  std::int64_t size = 0;
  if (fields[0] != "D" && fields[0] != "B")
    return SetupError(message, name + " type " + Quote(fields[0]) + " is neither D (discrete) nor B (box)");
  if (!ParseNumber(fields[1], &size) || size < 1 || size > kMaxSize) {
    return SetupError(message,
                      name + " size " + Quote(fields[1]) + " is no whole number from 1 to " + std::to_string(kMaxSize));
  }
  if (fields[0] == "D") {
    if (fields[2] != "0" && !fields[2].empty())
      return SetupError(message, name + " bounds " + Quote(fields[2]) + " of a discrete space must be 0");
    return Space::Discrete(size);
  }
  const std::vector<std::string_view> texts = SplitFields(fields[2], ',');
  if (static_cast<std::int64_t>(texts.size()) != 2 * size) {
    return SetupError(message, name + " bounds need " + std::to_string(2 * size) +
                                   " numbers (lows, then highs), there are " + std::to_string(texts.size()));
  }
  std::vector<double> bounds;
  for (const std::string_view text : texts) {
    double bound = 0.0;
    if (!ParseNumber(text, &bound)) return SetupError(message, name + " bound " + Quote(text) + " is no number");
    // As float32, which it is sent as: 3.4028234e38 is the largest one too, written by who rounds otherwise.
    const bool unbounded = static_cast<float>(std::min(std::fabs(bound), kUnboundedOnWire)) == kUnboundedOnWire;
    bounds.push_back(unbounded ? std::copysign(std::numeric_limits<double>::infinity(), bound) : bound);
  }
  const auto middle = bounds.begin() + static_cast<std::ptrdiff_t>(size);
  for (std::int64_t i = 0; i < size; ++i) {
    const double low = bounds[static_cast<std::size_t>(i)], high = bounds[static_cast<std::size_t>(size + i)];
    if (low > high)
      return SetupError(message, name + " has low " + NumberText(low) + " above high " + NumberText(high) +
                                     " at element " + std::to_string(i));
  }
  return Space::Box(std::vector<double>(bounds.begin(), middle), std::vector<double>(middle, bounds.end()), {size});
}

}  // namespace

Status CheckSpace(const Space& space, std::string_view role) {
  const bool discrete = space.kind() == SpaceKind::kDiscrete && space.start() == 0 && space.n() <= kMaxSize;
  const bool box = space.kind() == SpaceKind::kBox && space.dtype() == DType::kF32 && space.shape().size() == 1 &&
                   space.flat_size() <= kMaxSize;
  if (discrete || box) return Status::Ok();
  return {StatusCode::kInvalidArgument,
          "text protocol 1 carries Discrete (from 0) and one-dimensional float32 Box only, up to " +
              std::to_string(kMaxSize) + "; the " + std::string(role) + " space is " + space.ToString()};
}

Status EncodeSetup(const Setup& setup, std::string* out) {
  CONSAC_RETURN_IF_ERROR(CheckSpace(setup.action_space, "action"));
  CONSAC_RETURN_IF_ERROR(CheckSpace(setup.observation_space, "observation"));
  if (setup.training_length < 0)
    return {StatusCode::kInvalidArgument, "training length " + std::to_string(setup.training_length) + " is negative"};
  CONSAC_RETURN_IF_ERROR(CheckOptionalName("model", setup.model_name));
  if (setup.model_name.find('#') != std::string::npos)
    return {StatusCode::kInvalidArgument, "model name " + Quote(setup.model_name) + " must not hold '#'"};
  AppendSpace(setup.action_space, out);
  *out += "#";
  AppendSpace(setup.observation_space, out);
  *out += "#" + std::to_string(setup.training_length);
  if (!setup.model_name.empty()) *out += "#" + setup.model_name;
  return Status::Ok();
}

Result<Setup> ParseSetup(std::string_view message) {
  const std::vector<std::string_view> fields = SplitFields(message, '#');
  if (fields.size() != 7 && fields.size() != 8) {
    return SetupError(
        message,
        "it has " + std::to_string(fields.size()) +
            " fields, expected ActType#ActSize#ActLowHigh#ObsType#ObsSize#ObsLowHigh#TrainingLength[#ModelName]" +
            (fields.size() > 8 ? "; if the first observation is joined to it, let the engine end its setup with a "
                                 "newline, or wait 0.05 s after it"
                               : ""));
  }
  Setup setup;
  Result<Space> action = ParseSpace(message, "action", std::span(fields).subspan(0, 3));
  if (!action.ok()) return action.status();
  Result<Space> observation = ParseSpace(message, "observation", std::span(fields).subspan(3, 3));
  if (!observation.ok()) return observation.status();
  if (!ParseNumber(fields[6], &setup.training_length) || setup.training_length < 0) {
    return SetupError(message, "training length " + Quote(fields[6]) + " is no whole number from 0");
  }
  setup.action_space = std::move(*action);
  setup.observation_space = std::move(*observation);
  if (fields.size() == 8) setup.model_name = fields[7];
  if (const Status named = CheckOptionalName("model", setup.model_name); !named.ok())
    return SetupError(message, named.message());
  if (setup.training_length == 0 && setup.model_name.empty()) {
    return SetupError(message,
                      "training length 0 asks for a model to act, but no model name follows; send the steps to "
                      "train for, or the model's name behind the 0");
  }
  return setup;
}

}  // namespace consac::text1
