#pragma once
// The arithmetic of networks and optimisers on plain arrays: what Evaluator, learn/grad and learn/optim run on. One
// source file, compiled for every instruction set (SSE4 to AVX-512, NEON) and chosen when the program runs.
// Not for users of models: those want nn/network.h or policy/policy.h.

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "consac/nn/network.h"

namespace consac::nn {

/// Floats that a kernel may read (never write) past the end of an operand marked "with slack".
inline constexpr std::int64_t kSlack = 64;

/// A row-major matrix to write: element (r, c) is data[r * stride + c].
struct Rows {
  float* data = nullptr;    ///< first element
  std::int64_t stride = 0;  ///< floats from one row to the next
};
/// A row-major matrix to read.
struct ConstRows {
  /// An empty one.
  ConstRows() = default;
  /// From a pointer and the floats between rows.
  ConstRows(const float* first, std::int64_t row_stride) : data(first), stride(row_stride) {}
  /// From a writable one.
  ConstRows(const Rows& rows) : data(rows.data), stride(rows.stride) {}  // NOLINT: implicit by intent
  const float* data = nullptr;                                           ///< first element
  std::int64_t stride = 0;                                               ///< floats from one row to the next
};
/// The three sizes of a dense layer at work.
struct DenseShape {
  std::int64_t rows = 0;      ///< samples
  std::int64_t in_size = 0;   ///< features read
  std::int64_t out_size = 0;  ///< features written
};

/// Floats of a dense layer packed for forward.
std::int64_t PackedDenseSize(std::int64_t in_size, std::int64_t out_size);
/// Packs weight [out, in] and bias [out] into `packed` [PackedDenseSize].
void PackDense(const float* weight, const float* bias, std::int64_t in_size, std::int64_t out_size, float* packed);

/// What a dense layer is, for running it forward.
struct DenseLayer {
  std::int64_t in_size = 0;                     ///< features read
  std::int64_t out_size = 0;                    ///< features written
  Activation activation = Activation::kLinear;  ///< applied to y
};
/// One layer's forward work.
struct ForwardCall {
  const float* packed = nullptr;  ///< its packed parameters
  std::int64_t rows = 0;          ///< samples
  ConstRows x;                    ///< [rows, in_size]
  Rows y;                         ///< [rows, out_size] written
  Rows z;                         ///< [rows, out_size] before the activation, or null: not wanted
};
/// y = activation(x W^T + b), from PackDense. Row r depends on row r of x alone, bit for bit, however many rows there
/// are.
void DenseForward(const DenseLayer& layer, const ForwardCall& call);

/// Floats of a dense layer's weight packed for its input gradient.
std::int64_t PackedDenseBackwardSize(std::int64_t in_size, std::int64_t out_size);
/// Packs weight [out, in] into `packed` [PackedDenseBackwardSize].
void PackDenseBackward(const float* weight, std::int64_t in_size, std::int64_t out_size, float* packed);

/// Whether a kernel overwrites its result or adds to it.
enum class Store : std::uint8_t { kOverwrite, kAdd };

/// Gradient with respect to a dense layer's input.
struct DenseInputGradientCall {
  DenseShape shape;               ///< sizes
  const float* packed = nullptr;  ///< from PackDenseBackward
  ConstRows dz;                   ///< [rows, out] gradient before the activation
  Rows dx;                        ///< [rows, in] result
  Store store = Store::kOverwrite;
  ConstRows rectified = {};  ///< [rows, in] what relu has given, or null
};
/// dx = dz W, or dx + dz W; all of it times relu'(rectified) where that is given.
void DenseInputGradient(const DenseInputGradientCall& call);

/// Gradient with respect to a dense layer's parameters.
struct DenseWeightGradientCall {
  DenseShape shape;     ///< sizes
  ConstRows x;          ///< [rows, in] with slack
  ConstRows dz;         ///< [rows, out] with slack, gradient before the activation
  float* dw = nullptr;  ///< [out, in] result
  float* db = nullptr;  ///< [out] result
  Store store = Store::kOverwrite;
};
/// dw = dz^T x, db = column sums of dz; sums run over rows in order.
void DenseWeightGradient(const DenseWeightGradientCall& call);

/// The patches of an image whose channels come last, one for each pixel of a convolution's result.
struct PatchGrid {
  std::int64_t rows = 0, columns = 0;          ///< of the result
  std::int64_t row_step = 0, column_step = 0;  ///< floats of the image from one patch to the next
  std::int64_t lines = 0, run = 0;             ///< a patch is so many runs of so many floats
  std::int64_t line_step = 0;                  ///< floats of the image from one run to the next
};
/// A convolution's forward work.
struct ConvolutionCall {
  PatchGrid grid;                 ///< of each image
  DenseLayer layer;               ///< from a patch to the filters
  const float* packed = nullptr;  ///< from PackDense
  std::int64_t rows = 0;          ///< images
  ConstRows images;               ///< [rows, image]
  Rows y;                         ///< [rows, pixels * filters] written
  Rows z;                         ///< the same before the activation, or null: not wanted
};
/// Whether Convolve takes so many filters; others go through DenseForward over copied patches.
bool ConvolvesInPlace(std::int64_t filters);
/// y = activation(patches W^T + b), the bits of DenseForward over copied patches.
void Convolve(const ConvolutionCall& call);

/// Gradient with respect to a convolution's parameters.
struct ConvolutionGradientCall {
  PatchGrid grid;            ///< of each image
  std::int64_t filters = 0;  ///< of the result
  std::int64_t rows = 0;     ///< images
  ConstRows images;          ///< [rows, image] with slack
  ConstRows dz;              ///< [rows, pixels * filters] gradient before the activation
  float* dw = nullptr;       ///< [filters, patch] result
  float* db = nullptr;       ///< [filters] result
  Store store = Store::kOverwrite;
};
/// Whether ConvolutionWeightGradient takes such patches: a run fills a vector register. Others go through
/// DenseWeightGradient over copied patches.
bool SumsPatchesInPlace(const PatchGrid& grid);
/// dw = dz^T patches, db = sums of dz, the bits of DenseWeightGradient over copied patches, image after image.
void ConvolutionWeightGradient(const ConvolutionGradientCall& call);
/// Adds every number of the patches of pixels `first` to `first + count`, [count, patch], to the pixel of the image
/// that it belongs to.
void AddPatches(const PatchGrid& grid, std::int64_t first, std::int64_t count, ConstRows patches, float* image);

/// to[i] = from[i] / divisor.
void Divide(float divisor, std::span<const float> from, std::span<float> to);

/// True when the derivative needs the value before the activation; the others get by with the one after it.
bool NeedsPreActivation(Activation activation);
/// y = activation(x), element by element, [rows, columns]; x and y may be the same.
void Activate(Activation activation, std::int64_t rows, std::int64_t columns, ConstRows x, Rows y);
/// d *= activation'(...), given its result (or what came before it where NeedsPreActivation), [rows, columns].
void MultiplyByDerivative(Activation activation, std::int64_t rows, std::int64_t columns, ConstRows source, Rows d);

/// to[i] = tanh(from[i]); relative error below 3.5e-7, exactly 1 far out. The spans may be the same.
void Tanh(std::span<const float> from, std::span<float> to);
/// to[i] = exp(from[i]); relative error below 2e-7; overflows to infinity, underflows to 0.
void Exp(std::span<const float> from, std::span<float> to);
/// to[i] = 1 / (1 + exp(-from[i])); relative error below 3e-7.
void Sigmoid(std::span<const float> from, std::span<float> to);

/// to[i] += from[i].
void AddTo(std::span<const float> from, std::span<float> to);
/// to[i] = (1 - tau) to[i] + tau from[i]: a target network follows the one that learns. 1 copies it, bit for bit.
void Polyak(float tau, std::span<const float> from, std::span<float> to);
/// Sum of squares in float64, in an order that depends on the length alone.
double SumOfSquares(std::span<const float> values);

/// Numbers of one Adam step: p -= step * m / (sqrt(v) * root_scale + epsilon).
struct AdamCall {
  float gradient_scale = 1.0f;  ///< the gradient is multiplied by it first
  float beta1 = 0.9f;           ///< decay of m
  float beta2 = 0.999f;         ///< decay of v
  float step = 0.0f;            ///< step size with its bias correction
  float root_scale = 1.0f;      ///< bias correction of the root
  float epsilon = 1e-8f;        ///< added to the root
};
/// One pass over p, m, v and gradient, all of one length.
void AdamStep(const AdamCall& call, std::span<const float> gradient, std::span<float> m, std::span<float> v,
              std::span<float> p);

/// Numbers of one RMSProp step: s = decay s + (1-decay) g^2; b = momentum b + inner g / (sqrt(s + epsilon_inside) +
/// epsilon_outside); p -= outer b.
struct RmsPropCall {
  float gradient_scale = 1.0f;   ///< the gradient is multiplied by it first
  float decay = 0.99f;           ///< of the mean square
  float momentum = 0.0f;         ///< of b
  float inner = 1.0f;            ///< factor of the new direction
  float outer = 1.0f;            ///< factor of b in the step
  float epsilon_inside = 0.0f;   ///< under the root
  float epsilon_outside = 0.0f;  ///< beside the root
};
/// One pass over p, s, b and gradient, all of one length.
void RmsPropStep(const RmsPropCall& call, std::span<const float> gradient, std::span<float> s, std::span<float> b,
                 std::span<float> p);

/// Instruction set in use: "AVX3" (AVX-512), "AVX2", "SSE4", "NEON", ...
std::string_view InstructionSet();
/// All instruction sets that this machine can run, best first; the first is used unless UseInstructionSet says
/// otherwise.
std::vector<std::string_view> InstructionSets();
/// Changes the set in use, so that a run made on another machine continues with the same bits. False when this machine
/// cannot run it. Call before anything is packed: packed parameters fit one set only. Not thread-safe.
bool UseInstructionSet(std::string_view name);
/// Floats in one vector register of the instruction set in use.
std::int64_t VectorLanes();
/// What one core reaches with independent fused multiply-adds in these registers, in FLOP/s: the best of several
/// bursts that take about `seconds` together.
double MeasurePeakFlops(double seconds);

}  // namespace consac::nn
