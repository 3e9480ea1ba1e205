// The dense block: y = activation(x W^T + b), whatever the shape of x.

#include <Eigen/Dense>
#include <cmath>
#include <new>

#include "nn/blocks.h"

namespace consac::nn {
namespace {

constexpr std::int64_t kWidestLayer = 1 << 20;
constexpr std::size_t kMatricesOfQr = 4;  // what is decomposed, its decomposition, Q, and room for its blocks

Result<Shape> InferDense(const Block& block, std::span<const Shape> inputs) {
  CONSAC_RETURN_IF_ERROR(CheckInputCount(block, inputs, 1));
  for (const std::int64_t size : {SizeOf(inputs[0]), block.out_size}) {
    if (size >= 1 && size <= kWidestLayer) continue;
    return BlockFault(block, "a dense layer of " + std::to_string(SizeOf(inputs[0])) + " to " +
                                 std::to_string(block.out_size) + " features; widths go from 1 to " +
                                 std::to_string(kWidestLayer));
  }
  return Shape{block.out_size};
}

std::vector<Parameter> DenseParameters(const PlacedBlock& block) {
  const std::int64_t weights = block.in_size * block.out_size;
  return {{block.name + "/w", {block.out_size, block.in_size}, 0, weights},
          {block.name + "/b", {block.out_size}, weights, block.out_size}};
}

/// Orthonormal rows or columns, whichever are fewer, times the gain: the Q of a Gaussian matrix, with the signs of R's
/// diagonal taken out so that every orthogonal matrix is equally likely (Stable Baselines takes U or V of its SVD: the
/// same distribution). Source: Saxe et al. 2014, arXiv:1312.6120.
void InitialiseOrthogonal(float gain, std::int64_t in_size, std::int64_t out_size, Rng& rng, float* weight) {
  const Eigen::Index rows = static_cast<Eigen::Index>(out_size);
  const Eigen::Index columns = static_cast<Eigen::Index>(in_size);
  const Eigen::Index longer = rows > columns ? rows : columns;
  const Eigen::Index shorter = rows > columns ? columns : rows;
  // Eigen, compiled without exceptions, goes on where an allocation fails: what it will take is asked for before.
  void* volatile room = ::operator new(static_cast<std::size_t>(longer * shorter) * sizeof(double) * kMatricesOfQr);
  ::operator delete(room);
  Eigen::MatrixXd gauss(longer, shorter);
  for (Eigen::Index r = 0; r < longer; ++r) {
    for (Eigen::Index c = 0; c < shorter; ++c) gauss(r, c) = static_cast<double>(rng.Normal());
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(gauss);
  Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(longer, shorter);
  for (Eigen::Index c = 0; c < shorter; ++c) {
    if (qr.matrixQR()(c, c) < 0.0) q.col(c) = -q.col(c);
  }
  for (Eigen::Index r = 0; r < rows; ++r) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      const double value = rows > columns ? q(r, c) : q(c, r);
      weight[r * columns + c] = static_cast<float>(static_cast<double>(gain) * value);
    }
  }
}

void FillUniform(Rng& rng, double bound, std::int64_t count, float* values) {
  for (std::int64_t i = 0; i < count; ++i) values[i] = static_cast<float>(rng.Between(-bound, bound));
}

void InitialiseDense(const PlacedBlock& block, Rng& rng, float* parameters) {
  InitialiseLinear(block, block.in_size, block.out_size, rng, parameters);
}

std::int64_t DenseOpPackedSize(const PlacedBlock& block) {
  return PackedDenseSize(block.in_size, block.out_size);
}

void DenseOpPack(const PlacedBlock& block, const float* parameters, float* packed) {
  PackDense(parameters, parameters + block.in_size * block.out_size, block.in_size, block.out_size, packed);
}

Needs DenseNeeds(const PlacedBlock& block, std::int64_t) {
  Needs needs;
  if (NeedsPreActivation(block.activation)) needs.saved = block.out_size;
  return needs;
}

void DenseOpForward(const PlacedBlock& block, const BlockCall& call) {
  DenseForward({block.in_size, block.out_size, block.activation},
               {call.packed, call.rows, call.inputs[0], call.output, call.saved});
}

}  // namespace

void InitialiseLinear(const Block& block, std::int64_t in_size, std::int64_t out_size, Rng& rng, float* parameters) {
  const std::int64_t weights = in_size * out_size;
  float* bias = parameters + weights;
  for (std::int64_t i = 0; i < out_size; ++i) bias[i] = 0.0f;
  switch (block.init) {
    case Init::kOrthogonal:
      return InitialiseOrthogonal(block.gain, in_size, out_size, rng, parameters);
    case Init::kXavierUniform:  // Glorot and Bengio 2010
      return FillUniform(rng, block.gain * std::sqrt(6.0 / static_cast<double>(in_size + out_size)), weights,
                         parameters);
    case Init::kUniformFanIn: {  // PyTorch's Linear: weights and biases alike
      const double bound = 1.0 / std::sqrt(static_cast<double>(in_size));
      FillUniform(rng, block.gain * bound, weights, parameters);
      return FillUniform(rng, bound, out_size, bias);
    }
    case Init::kZeros:
      for (std::int64_t i = 0; i < weights; ++i) parameters[i] = 0.0f;
  }
}

Op DenseOp() {
  Op op;
  op.name = "dense";
  op.activates = true;
  op.infer = InferDense;
  op.parameters = DenseParameters;
  op.initialise = InitialiseDense;
  op.packed_size = DenseOpPackedSize;
  op.pack = DenseOpPack;
  op.needs = DenseNeeds;
  op.forward = DenseOpForward;
  return op;
}

}  // namespace consac::nn
