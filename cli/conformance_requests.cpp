#include "cli/conformance_requests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "cli/conformance_frames.h"
#include "consac/base/json.h"
#include "consac/protocol/relabel.h"
#include "consac/space/layout.h"

namespace consac::cli {
namespace {

/// Actions of those who take part in environments that are stepped.
Status CheckActions(const EnvSpec& env, const protocol2::Blocks& blocks, const protocol2::Frame& frame,
                    const std::string& result) {
  for (std::size_t b = 0; b < env.behaviours.size(); ++b) {
    const BehaviourSpec& behaviour = env.behaviours[b];
    const Layout& layout = behaviour.action_layout;
    for (std::int32_t slot = 0; slot < behaviour.slots; ++slot) {
      const std::size_t state = blocks.behaviours[b].states + static_cast<std::size_t>(slot);
      const std::size_t world = static_cast<std::size_t>(slot) / behaviour.agents.size();
      if (frame.payload[protocol2::kActiveOffset + world] == std::byte{0}) continue;
      if (result.size() < blocks.result_bytes || (result[state] & protocol2::kActive) == 0) continue;
      const std::byte* row =
          frame.payload.data() + blocks.behaviours[b].actions + static_cast<std::size_t>(slot) * layout.row_bytes;
      const Status legal = CheckRow(layout, row);
      if (!legal.ok()) return Failed(fmt::format("the action of slot {}: {} (R48)", slot, legal.message()));
      const auto* mask =
          reinterpret_cast<const std::uint8_t*>(result.data()) + blocks.behaviours[b].masks + slot * layout.mask_bytes;
      if (behaviour.masks_actions && !IsLegal(layout, mask, row))
        return Failed(fmt::format("the action of slot {} is not legal by its mask (R48)", slot));
    }
  }
  return Status::Ok();
}

/// Values from low to high, or NaN.
Status CheckSet(const EnvSpec& env, std::span<const std::byte> block) {
  for (std::size_t i = 0; i < block.size() / sizeof(double); ++i) {
    double value = 0.0;
    std::memcpy(&value, block.data() + i * sizeof(value), sizeof(value));
    if (std::isnan(value)) continue;
    const Status legal = CheckValue(env.parameters[i % env.parameters.size()], value);
    if (!legal.ok()) return Failed(legal.message() + " (R102)");
  }
  return Status::Ok();
}

/// Seeds that are 0 or more of what is reset, and options that are an object, in as many bytes as RESET has before the
/// parameters.
Status CheckReset(const protocol2::Blocks& blocks, std::span<const std::byte> reset, std::uint32_t flags) {
  const bool seeded = (flags & protocol2::kWithSeeds) != 0, with_options = (flags & protocol2::kWithOptions) != 0;
  std::size_t end = seeded ? blocks.options : blocks.seeds;
  std::uint32_t length = 0;
  if (with_options && reset.size() >= end + sizeof(length)) std::memcpy(&length, &reset[end], sizeof(length));
  const std::size_t text = end + sizeof(length);
  if (with_options) end = protocol2::AlignBlock(text + length);
  if (reset.size() != end) return Failed(fmt::format("RESET has {} bytes before what it sets (R41)", reset.size()));
  for (std::size_t i = 0; seeded && i < blocks.environments; ++i) {
    std::int64_t seed = 0;
    std::memcpy(&seed, &reset[blocks.seeds + i * sizeof(seed)], sizeof(seed));
    if (seed < 0 && reset[protocol2::kActiveOffset + i] != std::byte{0})
      return Failed(fmt::format("RESET has seed {} for environment {}; seeds are 0 or more (R43)", seed, i));
  }
  if (!with_options) return Status::Ok();
  const std::string_view options(reinterpret_cast<const char*>(reset.data()) + text, length);
  const Result<nlohmann::json> read = ReadJson<nlohmann::json>(options, {std::size_t{1} << 20, std::size_t{1} << 18});
  return read.ok() && read->is_object() ? Status::Ok() : Failed("RESET's options are no object by R7 (R42)");
}

}  // namespace

Status CheckRequest(const std::string& offered, const protocol2::Agreed& agreed, const protocol2::Frame& frame,
                    const std::string& result) {
  const Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(std::as_bytes(std::span(offered)), agreed);
  if (!spec.ok()) return spec.status();
  const protocol2::Blocks blocks(spec->env);
  const bool step = frame.header.type == protocol2::FrameType::kStep;
  if (step && result.empty()) return Failed("STEP comes before the first RESULT, which a RESET has to bring (R40)");
  std::uint32_t head[2] = {};
  if (!frame.payload.empty()) std::memcpy(head, frame.payload.data(), std::min(sizeof(head), frame.payload.size()));
  const std::uint32_t known = (step ? 0u : protocol2::kWithSeeds | protocol2::kWithOptions) |
                              (agreed.parameters ? protocol2::kWithParameters : 0u);
  if ((head[0] & ~known) != 0 || head[1] != 0) return Failed("what must be 0 in RESET and STEP is not (R42)");
  const std::size_t set = (head[0] & protocol2::kWithParameters) != 0 ? blocks.parameter_bytes() : 0;
  if (frame.payload.size() < blocks.seeds + set || (step && frame.payload.size() != blocks.step_bytes + set))
    return Failed(fmt::format("{} has {} bytes (R41)", step ? "STEP" : "RESET", frame.payload.size()));
  if (!step) {
    const std::span<const std::byte> before = frame.payload.first(frame.payload.size() - set);
    CONSAC_RETURN_IF_ERROR(CheckReset(blocks, before, head[0]));
  }
  if (set > 0) CONSAC_RETURN_IF_ERROR(CheckSet(spec->env, frame.payload.last(set)));
  for (std::size_t i = 0; i < blocks.environments; ++i) {
    const int chosen = std::to_integer<int>(frame.payload[protocol2::kActiveOffset + i]);
    if (chosen > 1 || (!step && result.empty() && chosen != 1))
      return Failed(fmt::format("{} says {} for environment {} (R40, R43)", step ? "STEP" : "RESET", chosen, i));
  }
  return step ? CheckActions(spec->env, blocks, frame, result) : Status::Ok();
}

Result<std::int64_t> RelabelledRows(const std::string& offered, const std::string& payload, std::size_t max_frame) {
  const Result<protocol2::SpecMessage> spec = protocol2::ParseSpec(std::as_bytes(std::span(offered)));
  if (!spec.ok()) return spec.status();
  const auto relabel = protocol2::ReadRelabel(spec->env, std::as_bytes(std::span(payload)), max_frame);
  return relabel.ok() ? Result<std::int64_t>(relabel->rows) : relabel.status();
}

std::string RewardsOf(std::int64_t rows, const std::string& how) {
  std::vector<double> rewards(static_cast<std::size_t>(rows + (how == "one more") - (how == "one short")), 0.0);
  if (how == "NaN") rewards.back() = std::numeric_limits<double>::quiet_NaN();
  if (how == "infinity") rewards.back() = std::numeric_limits<double>::infinity();
  return {reinterpret_cast<const char*>(rewards.data()), rewards.size() * sizeof(double)};
}

std::string MoveText(const nlohmann::json& type, const nlohmann::json& environments) {
  std::string text = type.get<std::string>() + " of";
  for (const nlohmann::json& chosen : environments) text += fmt::format(" {}", chosen.get<int>());
  return text;
}

}  // namespace consac::cli
