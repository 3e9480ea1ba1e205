#include "consac/nn/network.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "consac/base/text.h"
#include "nn/ops.h"

namespace consac::nn {
namespace {

constexpr std::string_view kActivationNames[] = {"linear",     "tanh", "relu", "sigmoid",
                                                 "elu",        "leaky_relu", "silu", "softplus"};

Status BlockError(const Block& block, const std::string& what) {
  return {StatusCode::kInvalidArgument, "network block " + Quote(block.name) + ": " + what};
}

/// Widths of the values that exist so far, by name.
using ValueWidths = std::unordered_map<std::string, std::int64_t>;

Status CheckBlock(const Block& block, const ValueWidths& widths) {
  if (FindOp(block.op) == nullptr) {
    return BlockError(block, "unknown operation " + Quote(block.op) + Suggestion(block.op, OpNames()));
  }
  const auto input = widths.find(block.input);
  if (input == widths.end()) return BlockError(block, "its input " + Quote(block.input) + " is not there yet");
  if (input->second != block.in_size) {
    return BlockError(block, "its input " + Quote(block.input) + " has " + std::to_string(input->second) +
                                 " features, it expects " + std::to_string(block.in_size));
  }
  if (block.out_size < 1) return BlockError(block, "its output has no features");
  if (block.output.empty() || widths.count(block.output) != 0) {
    return BlockError(block, "its output " + Quote(block.output) + " is empty or exists already");
  }
  return Status::Ok();
}

// A random matrix with orthonormal rows or columns, whichever are fewer, times the gain. The signs of R's diagonal
// make the draw uniform. Source: Saxe et al. 2014, arXiv:1312.6120.
void FillOrthogonal(Rng& rng, std::int64_t rows, std::int64_t columns, float gain, float* weight) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  const std::int64_t tall = std::max(rows, columns), thin = std::min(rows, columns);
  Matrix normal(tall, thin);
  for (std::int64_t i = 0; i < tall; ++i) {
    for (std::int64_t j = 0; j < thin; ++j) normal(i, j) = rng.Normal();
  }
  const Eigen::HouseholderQR<Matrix> qr(normal);
  Matrix q = qr.householderQ() * Matrix::Identity(tall, thin);
  for (std::int64_t j = 0; j < thin; ++j) {
    if (qr.matrixQR()(j, j) < 0) q.col(j) *= -1.0;
  }
  for (std::int64_t i = 0; i < rows; ++i) {
    for (std::int64_t j = 0; j < columns; ++j) {
      weight[i * columns + j] = static_cast<float>(gain * (rows >= columns ? q(i, j) : q(j, i)));
    }
  }
}

void FillUniform(Rng& rng, double limit, std::int64_t count, float* values) {
  for (std::int64_t i = 0; i < count; ++i) values[i] = static_cast<float>(rng.Between(-limit, limit));
}

}  // namespace

std::string_view NameOf(Activation activation) { return kActivationNames[static_cast<std::size_t>(activation)]; }

Result<Activation> ParseActivation(std::string_view name) {
  for (std::size_t i = 0; i < std::size(kActivationNames); ++i) {
    if (kActivationNames[i] == name) return static_cast<Activation>(i);
  }
  return Status{StatusCode::kInvalidArgument,
                "unknown activation " + Quote(name) + Suggestion(name, kActivationNames)};
}

Result<Network> Network::Create(NetworkSpec spec) {
  Network network;
  ValueWidths widths;
  for (const Port& input : spec.inputs) {
    if (input.size < 1 || !widths.emplace(input.name, input.size).second) {
      return Status{StatusCode::kInvalidArgument,
                    "network input " + Quote(input.name) + " has no features or is named twice"};
    }
  }
  for (const Block& block : spec.blocks) {
    CONSAC_RETURN_IF_ERROR(CheckBlock(block, widths));
    widths.emplace(block.output, block.out_size);
    for (const Parameter& shape : FindOp(block.op)->parameters(block)) {
      Parameter parameter = shape;
      parameter.offset = network.parameter_count_;
      network.parameter_count_ += parameter.count;
      network.parameters_.push_back(std::move(parameter));
    }
  }
  for (const std::string& output : spec.outputs) {
    const bool made = std::any_of(spec.blocks.begin(), spec.blocks.end(),
                                  [&](const Block& block) { return block.output == output; });
    if (!made) {
      return Status{StatusCode::kInvalidArgument, "network output " + Quote(output) + " is made by no block"};
    }
  }
  network.spec_ = std::move(spec);
  return network;
}

std::int64_t Network::output_size(std::size_t index) const {
  for (const Block& block : spec_.blocks) {
    if (block.output == spec_.outputs[index]) return block.out_size;
  }
  return 0;
}

void Network::Initialise(Rng& rng, std::span<float> parameters) const {
  CONSAC_ASSERT(static_cast<std::int64_t>(parameters.size()) >= parameter_count_);
  std::int64_t offset = 0;
  for (const Block& block : spec_.blocks) {
    for (const Parameter& parameter : FindOp(block.op)->parameters(block)) {
      InitialiseParameter(block, parameter, rng, parameters.data() + offset);
      offset += parameter.count;
    }
  }
}

void InitialiseParameter(const Block& block, const Parameter& parameter, Rng& rng, float* values) {
  const double fan_in = static_cast<double>(block.in_size), fan_out = static_cast<double>(block.out_size);
  const bool is_weight = parameter.shape.size() == 2;
  switch (block.init) {
    case Init::kOrthogonal:
      if (is_weight) return FillOrthogonal(rng, parameter.shape[0], parameter.shape[1], block.gain, values);
      break;
    case Init::kXavierUniform:
      if (is_weight) return FillUniform(rng, block.gain * std::sqrt(6.0 / (fan_in + fan_out)), parameter.count, values);
      break;
    case Init::kUniformFanIn:
      return FillUniform(rng, block.gain / std::sqrt(fan_in), parameter.count, values);
    case Init::kZeros: break;
  }
  std::fill(values, values + parameter.count, 0.0f);
}

}  // namespace consac::nn
