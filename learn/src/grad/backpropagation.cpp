// Lanes: a minibatch's blocks are dealt to a number of lanes that depends on its size alone; each lane sums its own
// gradient, and the lanes are added in order. So threads change who computes a lane, never what it computes.

#include "consac/learn/grad/backpropagation.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "grad/workspace.h"

namespace consac::learn {
namespace {

constexpr std::int64_t kBlocksPerLane = 4;       // about 150 us of two 64x64 towers: more than waking a thread costs
constexpr std::int64_t kWideParameters = 32768;  // of which one block is as much
constexpr std::int64_t kMostLanes = 16;          // each has a gradient of its own, to be added at the end
constexpr std::int64_t kReduceChunk = 4096;      // parameters that one task adds up

std::int64_t BlockCount(std::int64_t rows, std::int64_t block_rows) {
  return (rows + block_rows - 1) / block_rows;
}
std::int64_t LaneCountFor(std::int64_t rows, std::int64_t block_rows, bool wide) {
  const std::int64_t blocks = BlockCount(rows, block_rows);
  const std::int64_t least = wide && blocks >= kBlocksPerLane ? 2 : 1;
  return std::clamp(blocks / kBlocksPerLane, least, kMostLanes);
}

}  // namespace

struct Backpropagation::State {
  State(const nn::Network& network, const BackpropagationOptions& options)
      : schedule(network, options),
        network_count(network.parameter_count()),
        extra(options.extra),
        max_rows(options.max_rows),
        wide(IsWide(network)) {
    const std::int64_t lanes = Lanes(max_rows);
    for (std::int64_t lane = 0; lane < lanes; ++lane) {
      gradients.emplace_back(network_count + extra);
      workspaces.push_back(std::make_unique<BlockWorkspace>(schedule));
    }
  }

  std::int64_t Lanes(std::int64_t rows) const { return LaneCountFor(rows, schedule.block_rows, wide); }

  /// A workspace that no other thread uses: there are as many as lanes. The first free one, so that a single thread
  /// keeps to one that is warm in its cache.
  BlockWorkspace& Take() {
    for (std::size_t i = 0;; i = i + 1 < workspaces.size() ? i + 1 : 0) {
      if (!workspaces[i]->taken.exchange(true, std::memory_order_acquire)) return *workspaces[i];
    }
  }

  void RunLane(std::int64_t lane, std::int64_t lanes, std::int64_t rows, BlockLoss& loss) {
    BlockWorkspace& workspace = Take();
    float* gradient = gradients[static_cast<std::size_t>(lane)].data();
    std::memset(gradient + network_count, 0, static_cast<std::size_t>(extra) * sizeof(float));
    const std::int64_t block_rows = schedule.block_rows, blocks = BlockCount(rows, block_rows);
    const std::int64_t first = lane * blocks / lanes;
    const std::int64_t last = (lane + 1) * blocks / lanes;
    for (std::int64_t b = first; b < last; ++b) {
      LossBlock block;
      block.index = b;
      block.first_row = b * block_rows;
      block.rows = std::min(block_rows, rows - block.first_row);
      block.extra_gradient = {gradient + network_count, static_cast<std::size_t>(extra)};
      workspace.Run(block, loss, along_tangent, gradient, b == first ? nn::Store::kOverwrite : nn::Store::kAdd);
    }
    workspace.taken.store(false, std::memory_order_release);
  }

  void Reduce(std::int64_t chunk, std::int64_t lanes) {
    const std::int64_t first = chunk * kReduceChunk;
    const auto count = static_cast<std::size_t>(std::min(kReduceChunk, network_count + extra - first));
    for (std::int64_t lane = 1; lane < lanes; ++lane) {
      nn::AddTo({gradients[static_cast<std::size_t>(lane)].data() + first, count},
                {gradients[0].data() + first, count});
    }
  }

  GradientSchedule schedule;
  std::int64_t network_count;
  std::int64_t extra;
  std::int64_t max_rows;
  bool wide;
  bool along_tangent = false;                               // of this run
  std::vector<nn::AlignedFloats> gradients;                 // [lanes] each [network_count + extra]
  std::vector<std::unique_ptr<BlockWorkspace>> workspaces;  // [lanes]
};

Backpropagation::Backpropagation(const nn::Network& network, std::int64_t extra, std::int64_t max_rows)
    : Backpropagation(network, BackpropagationOptions{.extra = extra, .max_rows = max_rows}) {}
Backpropagation::Backpropagation(const nn::Network& network, const BackpropagationOptions& options)
    : state_(std::make_unique<State>(network, options)) {
  CONSAC_ASSERT(!options.tangents || HasTangent(network));
}
Backpropagation::~Backpropagation() = default;
Backpropagation::Backpropagation(Backpropagation&&) noexcept = default;

bool Backpropagation::IsWide(const nn::Network& network) {
  return network.parameter_count() >= kWideParameters;
}

std::int64_t Backpropagation::GradientCopies(const nn::Network& network, std::int64_t max_rows) {
  return LaneCountFor(max_rows, kBlockRows, IsWide(network));
}

std::int64_t Backpropagation::ActivationBytes(const nn::Network& network, std::int64_t max_rows) {
  const nn::Plan plan(network);
  std::int64_t row = 0, forward = 0, backward = 0;  // floats, the last two of work space
  for (const nn::PlanValue& value : plan.values) row += 2 * nn::InnerStride(value.size);
  for (const nn::PlanStep& step : plan.steps) {
    if (step.op->needs != nullptr) {
      const nn::Needs needs = step.op->needs(step.block, kBlockRows);
      row += needs.saved > 0 ? nn::InnerStride(needs.saved) : 0;
      forward = std::max(forward, needs.scratch);
    }
    const GradientOp* op = FindGradientOp(step.block.op);
    if (op != nullptr && op->scratch != nullptr) backward = std::max(backward, op->scratch(step.block, kBlockRows));
  }
  const std::int64_t floats = kBlockRows * row + forward + backward;
  return GradientCopies(network, max_rows) * floats * static_cast<std::int64_t>(sizeof(float));
}

bool Backpropagation::HasTangent(const nn::Network& network) {
  for (const nn::PlacedBlock& block : network.blocks()) {
    const GradientOp* op = FindGradientOp(block.op);
    if (op == nullptr || op->tangent == nullptr) return false;
  }
  return true;
}

std::int64_t Backpropagation::block_rows() const {
  return state_->schedule.block_rows;
}

std::shared_ptr<const nn::PackedNetwork> Backpropagation::packed() const {
  return state_->schedule.forward;
}

void Backpropagation::Load(std::span<const float> parameters) {
  const bool fits = static_cast<std::int64_t>(parameters.size()) == state_->network_count + state_->extra;
  CONSAC_ASSERT(fits);
  if (fits) state_->schedule.Pack(parameters.first(static_cast<std::size_t>(state_->network_count)));
}

void Backpropagation::Run(std::span<const float> parameters, std::int64_t rows, const Executor& executor,
                          BlockLoss& loss) {
  Load(parameters);
  RunLoaded(rows, executor, loss);
}

void Backpropagation::RunLoaded(std::int64_t rows, const Executor& executor, BlockLoss& loss) {
  State& state = *state_;
  const bool fits = rows > 0 && rows <= state.max_rows && rows % state.schedule.options.steps == 0;
  CONSAC_ASSERT(fits);
  if (!fits) return;
  const std::int64_t lanes = state.Lanes(rows);
  executor.ForEach(lanes, [&](std::int64_t lane) { state.RunLane(lane, lanes, rows, loss); });
  const bool learns = state.schedule.options.parameter_count > 0 || state.extra > 0;
  if (lanes == 1 || !learns) return;
  const std::int64_t chunks = (state.network_count + state.extra + kReduceChunk - 1) / kReduceChunk;
  executor.ForEach(chunks, [&](std::int64_t chunk) { state.Reduce(chunk, lanes); });
}

void Backpropagation::RunAlong(std::span<const float> parameters, std::span<const float> direction, std::int64_t rows,
                               const Executor& executor, BlockLoss& loss) {
  State& state = *state_;
  const bool fits = state.schedule.options.tangents && parameters.size() >= direction.size() &&
                    static_cast<std::int64_t>(direction.size()) == state.network_count;
  CONSAC_ASSERT(fits);
  if (!fits) return;
  state.schedule.PackTangent(parameters, direction);
  state.along_tangent = true;
  Run(parameters, rows, executor, loss);
  state.along_tangent = false;
}

std::span<float> Backpropagation::gradient() {
  return state_->gradients[0].span();
}

}  // namespace consac::learn
