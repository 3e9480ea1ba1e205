#pragma once
// Worlds as protocol 2 steps them: some or all of them, three ways to begin the next episode, agents that come and go,
// results written where they are sent from. Knows nothing of connections. Private to core/server.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "consac/env/buffer.h"
#include "consac/env/vector_env.h"
#include "consac/protocol/protocol2.h"

namespace consac {

/// Bytes that begin at a multiple of 8.
class AlignedBytes {
 public:
  void Resize(std::size_t bytes) { words_.assign((bytes + 7) / 8, 0); }
  std::byte* data() { return reinterpret_cast<std::byte*>(words_.data()); }

 private:
  std::vector<std::uint64_t> words_;
};

/// One VectorEnv and the RESULT of its latest step. A refused STEP steps nothing.
class Stepper {
 public:
  /// `env` must outlive it.
  explicit Stepper(VectorEnv& env);

  /// Where everything lies in the messages.
  const protocol2::Blocks& blocks() const { return blocks_; }
  /// The largest payload of a RESULT.
  std::size_t result_room() const { return blocks_.largest_result + statistics_room_ + info_room_; }
  /// Infos with which a RESULT would have more bytes are left out.
  void LimitInfos(std::size_t bytes) { most_with_infos_ = bytes; }
  /// From now on RESULT's payload is written to `payload` (8-byte aligned); what was there must have been moved.
  void WriteTo(std::byte* payload);

  /// A new session begins: nothing is left of the one before.
  void Forget();
  /// What RESET and STEP may set, and RESULT may say.
  void Agree(const protocol2::Agreed& agreed) { agreed_ = agreed; }
  /// How next episodes begin; UNSUPPORTED when the world cannot do it.
  Status SetAutoreset(protocol2::Autoreset autoreset);
  /// Carries out a RESET. The first of a session must be of every environment, and takes `seed` when it brings none.
  Status Reset(std::span<const std::byte> request, bool first, std::uint64_t seed);
  /// Completes it, once the worlds have settled.
  void FinishReset();
  /// Takes in a STEP and judges it; the worlds stand still until Step.
  Status ReadStep(std::span<const std::byte> request);
  /// Steps what ReadStep took in.
  void Step();
  /// Completes it, once the worlds have settled.
  void FinishStep();

  /// The payload that the latest Reset or Step has completed.
  std::size_t result_bytes() const { return result_bytes_; }
  /// Agents that took part in the latest Step.
  std::int64_t agents_stepped() const { return agents_stepped_; }
  /// The environment that the latest refusal speaks of, -1 for none; asking forgets it.
  std::int64_t TakeBlamed() { return std::exchange(blamed_, -1); }

 private:
  /// What one behaviour needs.
  struct Group {
    explicit Group(const BehaviourSpec& behaviour);
    const BehaviourSpec* spec;
    std::size_t agents, row_bytes, mask_bytes, action_bytes, first_slot = 0;
    BatchBuffer whole_rows, some_rows;     // of all slots, in place; of some, gathered
    std::vector<std::int32_t> some_slots;  // gathered
    std::vector<std::byte> stashed;        // first rows of episodes that are not visible yet
    std::vector<std::uint8_t> active;      // [slots] takes part in the episode that is visible
    std::vector<std::int64_t> choices;     // mask bytes of each; empty where nothing is masked
    std::size_t WorldOf(std::int32_t slot) const { return static_cast<std::size_t>(slot) / agents; }
  };

  bool Present(std::size_t b, std::size_t slot) const;
  bool Ended(std::size_t b, std::size_t slot);
  std::byte* States(std::size_t b) { return payload_ + blocks_.behaviours[b].states; }
  Status CheckChosen(std::span<const std::byte> request, const char* name);
  Status CheckReset(std::span<const std::byte> request);
  std::uint32_t KnownFlags(std::uint32_t flags) const {
    return flags | (agreed_.parameters ? protocol2::kWithParameters : 0);
  }
  /// The values in the last block of `request`, where it has that.
  std::vector<double> ParametersIn(std::span<const std::byte> request) const;
  Status CheckParameters(std::span<const double> values);
  /// NaN leaves a value as it is.
  void SetParameters(std::span<const double> values);
  Status ResetChosen(const std::vector<std::uint64_t>& seeds, bool all);
  Status Begin(const std::vector<std::uint64_t>& seeds, bool first, bool all, std::uint64_t seed);
  void BeginAll(std::uint64_t seed);
  Status ResetOne(std::size_t world, std::optional<std::uint64_t> seed);
  Status CheckActions();
  void StepSome();
  void Scatter(std::size_t b);
  void BeginResult();
  void BeginNext(std::size_t world);
  void MarkFirst(std::size_t world);
  void WriteOutcomes(std::size_t b, const Batch& batch);
  void CheckMask(std::size_t b, std::size_t slot);
  unsigned WriteEnd(std::size_t b, const Batch& batch, std::size_t row);
  void WriteArrivals(std::size_t b);
  void HideNextEpisode(std::size_t world);
  bool EpisodeOver(std::size_t world);
  enum class Infos : std::uint8_t { kWithout, kWith };
  void FinishResult(Infos infos);
  bool WriteGroups();
  bool WriteStatistics();
  bool WriteInfos();
  bool WriteText(const std::string& text);
  nlohmann::json InfoColumns(bool final);

  VectorEnv& env_;
  const EnvSpec& spec_;
  const protocol2::Blocks blocks_;
  std::size_t info_room_ = 0, statistics_room_ = 0;
  protocol2::Agreed agreed_;
  std::size_t most_with_infos_ = protocol2::kLargestFrame;
  bool agents_leave_ = false;  // the world says who is present
  protocol2::Autoreset autoreset_ = protocol2::Autoreset::kSameStep;

  std::byte* payload_ = nullptr;
  AlignedBytes request_;  // STEP's payload
  std::vector<Group> groups_;
  std::vector<Batch> whole_, some_;              // one per behaviour
  std::vector<std::uint8_t> pending_, stepped_;  // per environment: has ended; is stepped (or begins) now
  std::vector<std::uint8_t> begins_;             // per environment: its first rows are still to come
  std::vector<std::uint8_t> played_;             // per environment: an agent took part in this step
  std::vector<std::uint8_t> outdated_;           // per environment: its hidden episode has parameters that are so
  std::vector<double> parameters_;               // [environments, parameters] as they were set
  std::vector<Statistic> noted_;
  std::vector<double> step_parameters_;  // the same, that the STEP taken in sets; NaN: as it was
  std::size_t stepped_count_ = 0, result_bytes_ = 0;
  std::uint64_t own_seed_ = 0;  // of the latest RESET, where the trainer gives none
  std::int64_t agents_stepped_ = 0;
  std::int64_t blamed_ = -1;
  bool begins_next_ = false, has_finals_ = false, said_statistics_are_long_ = false, said_no_choice_ = false;
};

}  // namespace consac
