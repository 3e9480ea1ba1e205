#pragma once
// RELABEL and REWARDS of protocol 2: what steps would have paid had other goals been wanted. Sans-I/O, as
// protocol2.h. Used by server, client, tests and fuzzers. spec/protocol2.md, section 13, is the law.

#include <cstddef>
#include <cstdint>
#include <span>

#include "consac/protocol/protocol2.h"

namespace consac::protocol2 {

inline constexpr std::size_t kMostRelabelled = std::size_t{1} << 20;  ///< bytes of a RELABEL that every server takes

/// What RELABEL asks; the rows lie in its payload.
struct Relabel {
  std::size_t behaviour = 0;  // its place in SPEC
  std::int64_t rows = 0;
  const std::byte* observations = nullptr;  // [rows, observation row_bytes]
};

/// Whether observations have an achieved_goal and a desired_goal of equal spaces, as Gymnasium's worlds with goals
/// have.
bool HasGoals(const Layout& observation);
/// Rows of `behaviour` that one RELABEL may have where payloads are at most `max_frame` bytes; at least 1.
std::int64_t MostRelabelledRows(const BehaviourSpec& behaviour, std::size_t max_frame);
/// Bytes of a RELABEL's payload with so many rows of `behaviour`.
std::size_t RelabelBytes(const BehaviourSpec& behaviour, std::int64_t rows);
/// Writes a RELABEL's payload of RelabelBytes, of zeros before.
void WriteRelabel(const EnvSpec& env, const Relabel& relabel, std::byte* payload);
/// Reads and judges one (R91 to R93); its answer may take `max_frame` bytes.
Result<Relabel> ReadRelabel(const EnvSpec& env, std::span<const std::byte> payload, std::size_t max_frame);
/// Whether REWARDS may say them: a Fault NON_FINITE where one is NaN or infinite (R95).
Status CheckRewards(std::span<const float> rewards);
/// Writes a REWARDS' payload, 8 bytes for each of `rewards`.
void WriteRewards(std::span<const float> rewards, std::byte* payload);
/// Reads and judges the REWARDS of `rows` rows (R94, R95): kProtocol, kNonFinite.
Status ReadRewards(std::span<const std::byte> payload, std::int64_t rows, float* rewards);

}  // namespace consac::protocol2
