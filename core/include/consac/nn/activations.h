#pragma once
// The one forward driver, of acting and of learning: a network's parameters as its blocks read them, which any number
// of threads share, and the values that flow between blocks, which each thread has for itself. Used by Evaluator and
// by learn/grad; not by users of models.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/nn/aligned.h"
#include "consac/nn/plan.h"

namespace consac::nn {

/// Parameters packed for the forward kernels, and the order to run the blocks in. Immutable but for Load.
class PackedNetwork {
 public:
  /// All zero until Load. Copies what it needs of `network`.
  explicit PackedNetwork(const Network& network);
  /// Packs `parameters` ([parameter_count], canonical order); nobody may be running it.
  void Load(std::span<const float> parameters);
  /// The order of work.
  const Plan& plan() const { return plan_; }
  /// The packed parameters of step `step`.
  const float* of_step(std::size_t step) const { return packed_.data() + places_[step]; }

 private:
  Plan plan_;
  std::int64_t parameter_count_;
  std::vector<std::int64_t> places_;  // [steps] into packed_
  AlignedFloats packed_;
};

/// What Activations makes room for.
struct ActivationsOptions {
  std::int64_t rows = 1;        ///< rows of one call: the outputs hold all of them
  std::int64_t group_rows = 1;  ///< rows that go through all blocks together, so that they stay in cache
  bool learning = false;        ///< keeps what backward needs, and the inputs
};

/// One call's input.
struct ForwardRows {
  std::span<const float* const> inputs;  ///< one per network input: [rows, size] row-major
  std::int64_t rows = 0;                 ///< samples
  std::int64_t steps = 1;                ///< rows are [steps, rows / steps]; more than 1 only in one group
  RecurrentRows recurrent = {};          ///< states of the slots, one per sequence; begins are per row
};

/// The values of one thread. Allocates at creation alone.
class Activations {
 public:
  /// Room for `options.rows` rows through `plan`, which must outlive it.
  Activations(const Plan& plan, const ActivationsOptions& options);

  /// Runs `steps` of the plan in this order with the parameters in `packed`, whose plan is this one's.
  void Run(const PackedNetwork& packed, std::span<const std::size_t> steps, const ForwardRows& call);

  /// A value, from row `first_row` on; inner values hold the last group alone.
  Rows Value(std::size_t value, std::int64_t first_row = 0);
  /// What step `step` keeps for its backward; null unless learning and wanted.
  Rows Saved(std::size_t step);
  /// Work space enough for any step.
  float* scratch() { return scratch_.data(); }

 private:
  struct Room {
    AlignedFloats data;
    std::int64_t stride = 0;
    bool of_group = false;  // holds the rows of the group at work, not all of the call's
  };
  /// A step's work, ready for the call's first row.
  struct ReadyStep {
    const PlanStep* step = nullptr;
    BlockCall call;
    bool images = false;  // run for a few rows at a time
  };
  /// Which of the steps' inputs is which of the call's.
  struct Given {
    std::size_t at = 0;     // in inputs_
    std::size_t input = 0;  // of the network
  };
  void MakeReady(std::size_t step, const Needs& needs);
  void LoadState(const RecurrentRows& recurrent, std::int64_t first, std::int64_t count);
  void StoreState(const RecurrentRows& recurrent, std::int64_t first, std::int64_t count) const;
  /// Rows of one group, from `first` on in the call.
  struct Group {
    std::int64_t first, count;
  };
  void RunGroup(const PackedNetwork& packed, std::span<const std::size_t> steps, const ForwardRows& call,
                const Group& group);
  /// `part` is rows of `group`, counted from its first.
  void RunStep(std::size_t s, const PackedNetwork& packed, const ForwardRows& call, const Group& group,
               const Group& part);
  /// The same work for rows further on: those of `part`, which begins at row `first` of the call.
  BlockCall MovedOn(const ReadyStep& ready, const Group& part, std::int64_t first);

  const Plan& plan_;
  ActivationsOptions options_;
  std::vector<Room> values_;       // [plan.values]
  std::vector<Room> saved_;        // [plan.steps]
  std::vector<ReadyStep> ready_;   // [plan.steps]
  std::vector<ConstRows> inputs_;  // of all steps, at the call's first row
  std::vector<Given> given_;
  std::vector<ConstRows> moved_inputs_;  // of the step at work
  AlignedFloats scratch_;
  AlignedFloats state_;  // [group_rows, plan.state_size] of the group at work
};

}  // namespace consac::nn
