#pragma once
// A trained model that acts: observation in, action out, with no trainer, no network connection and no allocation
// per action. Loaded from a `.consac` file or from memory; the same kernels as the trainer's, so the same actions.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/env/vector_env.h"
#include "consac/model/model_file.h"
#include "consac/nn/network.h"
#include "consac/policy/head.h"
#include "consac/policy/normaliser.h"

namespace consac {

/// Everything that makes up an acting model; what training hands over and what a file holds.
struct PolicyData {
  std::string behaviour = "default";  ///< which behaviour it was learned for
  Space observation_space;            ///< what it sees
  Space action_space;                 ///< what it does
  nn::NetworkSpec network;            ///< one input "obs"; the first output ("pi", "q") feeds the heads
  std::vector<HeadSpec> heads;        ///< of the action's leaves, in their order; empty: the defaults
  std::vector<float> parameters;      ///< [network parameters] canonical order
  std::vector<float> log_std;         ///< [ActionHead::log_std_size]; empty where no head has any
  ObservationNormaliser normaliser;   ///< frozen statistics, or inactive
  std::string training_json = "{}";   ///< algorithm, hyperparameters, steps, seed, world: for people
};

/// Ok where acting with the network takes no more than a model may: 256 MiB for what 64 rows make of all layers, which
/// is 2^20 features together. kResourceExhausted names the layer; no model of such a network is loaded.
Status CheckActivations(const nn::Network& network);

/// What is to be acted on, when rows are agents that stay: a policy with a state keeps one for each slot.
struct ActRows {
  const std::byte* observations = nullptr;  ///< [rows, row_bytes]
  const std::uint8_t* masks = nullptr;      ///< [rows, mask_bytes] or null
  std::int64_t rows = 0;                    ///< at most max_rows
  const std::int32_t* slots = nullptr;      ///< [rows] which agent each row is, from 0 below max_rows; null: row r is r
  const std::uint8_t* begins = nullptr;     ///< [rows] 1: its episode begins, its state is zero; null: none does
};

/// An acting model. Not thread-safe (it holds activations): one per thread, each created or loaded on its own.
class Policy {
 public:
  /// Checks that everything fits and makes room for `max_rows` rows per call.
  static Result<Policy> Create(PolicyData data, std::int64_t max_rows);
  /// Reads a `.consac` file and runs its self-test; a model that does not reproduce its own stored answers within
  /// their tolerance is refused.
  static Result<Policy> Load(const std::string& path, std::int64_t max_rows = 1);
  /// The same from memory.
  static Result<Policy> FromBytes(std::span<const std::byte> bytes, std::int64_t max_rows = 1);
  /// The same from a file that has been read already.
  static Result<Policy> FromFile(const ModelFile& file, std::int64_t max_rows = 1);
  ~Policy();
  Policy(Policy&&) noexcept;
  Policy& operator=(Policy&&) noexcept;

  /// What it was made of.
  const PolicyData& data() const;
  /// Layout of its observations.
  const Layout& observation_layout() const;
  /// Layout of its actions.
  const Layout& action_layout() const;
  /// Ok when the model fits this behaviour; otherwise names the first difference in spaces by its path.
  Status Fits(const BehaviourSpec& behaviour) const;

  /// Chooses actions for `rows` <= max_rows. observations [rows, row_bytes], masks [rows, mask_bytes] or null,
  /// actions [rows, row_bytes] out. `rng` is drawn from only in kSample.
  void Act(const std::byte* observations, const std::uint8_t* masks, std::int64_t rows, ActionMode mode, Rng& rng,
           std::byte* actions);
  /// The same for agents that stay: whoever acts with a recurrent policy, or in kSample with a head that follows the
  /// state, says which row is whose.
  void Act(const ActRows& rows, ActionMode mode, Rng& rng, std::byte* actions);
  /// What its slots remember.
  void Visit(Archive& archive);
  /// Makes room for `max_rows` rows per call and as many slots, where there is less; what slots remember stays.
  Status MakeRoom(std::int64_t max_rows);
  /// Whether it remembers: its slots have a state.
  bool recurrent() const;
  /// The head's numbers of the last Act, [rows, ActionHead::size]; for tests and inspection.
  std::span<const float> head() const;

  /// The `.consac` form, with self-test pairs computed now from `seed`.
  ModelFile ToFile(std::uint64_t seed = 0) const;

 private:
  struct State;
  explicit Policy(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace consac
