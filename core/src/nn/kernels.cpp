// The kernels of consac/nn/kernels.h, compiled for every instruction set and chosen at the first call. This is the one
// source file that includes foreach_target.h: a second would break an engine's unity build.

#include "consac/nn/kernels.h"

#include <cstring>

#include "nn/denormals.h"

// Every processor with SSSE3 that runs a game of today has SSE4 as well. Clang 18 to 21 want vectors of 512 bits
// declared in a way that Highway has known since 1.1 (google/highway#1864): by these compilers kernels go up to AVX2.
// For ThreadSanitizer too, by any compiler: AVX-512 would show it no other threads, and compiles long.
#ifndef HWY_DISABLED_TARGETS
#if defined(CONSAC_SANITIZED_THREADS) || (defined(__clang__) && __clang_major__ >= 18 && __clang_major__ < 22)
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3 | (HWY_AVX3 - 1))
#else
#define HWY_DISABLED_TARGETS HWY_SSSE3
#endif
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nn/kernels.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "nn/activation-inl.h"
#include "nn/convolution-inl.h"
#include "nn/dense-inl.h"
#include "nn/gemm-inl.h"
#include "nn/math-inl.h"
#include "nn/optimiser-inl.h"

HWY_BEFORE_NAMESPACE();
namespace consac::nn::HWY_NAMESPACE {

struct TanhMap {
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return TanhOf(d, x);
  }
};
struct ExpMap {
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return ExpOf(d, x);
  }
};
struct SigmoidMap {
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return SigmoidOf(d, x);
  }
};

void TanhRun(const float* x, float* y, std::int64_t count) {
  MapRun(TanhMap(), x, y, count);
}
void ExpRun(const float* x, float* y, std::int64_t count) {
  MapRun(ExpMap(), x, y, count);
}
void SigmoidRun(const float* x, float* y, std::int64_t count) {
  MapRun(SigmoidMap(), x, y, count);
}

std::int64_t LanesInUse() {
  return LaneCount();
}
const char* TargetInUse() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace consac::nn {

HWY_EXPORT(DensePackedSize);
HWY_EXPORT(DensePack);
HWY_EXPORT(DenseForwardRows);
HWY_EXPORT(DensePackedBackwardSize);
HWY_EXPORT(DensePackBackward);
HWY_EXPORT(DenseInputGradientRows);
HWY_EXPORT(DenseWeightGradientRows);
HWY_EXPORT(ConvolveRows);
HWY_EXPORT(ConvolvesFilters);
HWY_EXPORT(ConvolutionGradientRows);
HWY_EXPORT(AddPatchesRows);
HWY_EXPORT(DivideRun);
HWY_EXPORT(ActivateRows);
HWY_EXPORT(MultiplyRowsByDerivative);
HWY_EXPORT(TanhRun);
HWY_EXPORT(ExpRun);
HWY_EXPORT(SigmoidRun);
HWY_EXPORT(AddRun);
HWY_EXPORT(PolyakRun);
HWY_EXPORT(SquaresRun);
HWY_EXPORT(AdamRun);
HWY_EXPORT(RmsPropRun);
HWY_EXPORT(PeakRun);
HWY_EXPORT(LanesInUse);
HWY_EXPORT(TargetInUse);

namespace {

/// One bit per instruction set that was compiled and that this machine has; the lowest bit is the best.
std::int64_t RunnableSets() {
  return hwy::SupportedTargets() & HWY_TARGETS;
}

}  // namespace

std::int64_t PackedDenseSize(std::int64_t in_size, std::int64_t out_size) {
  return HWY_DYNAMIC_DISPATCH(DensePackedSize)(in_size, out_size);
}
void PackDense(const float* weight, const float* bias, std::int64_t in_size, std::int64_t out_size, float* packed) {
  HWY_DYNAMIC_DISPATCH(DensePack)(weight, bias, in_size, out_size, packed);
}
void DenseForward(const DenseLayer& layer, const ForwardCall& call) {
  HWY_DYNAMIC_DISPATCH(DenseForwardRows)(layer, call);
}

std::int64_t PackedDenseBackwardSize(std::int64_t in_size, std::int64_t out_size) {
  return HWY_DYNAMIC_DISPATCH(DensePackedBackwardSize)(in_size, out_size);
}
void PackDenseBackward(const float* weight, std::int64_t in_size, std::int64_t out_size, float* packed) {
  HWY_DYNAMIC_DISPATCH(DensePackBackward)(weight, in_size, out_size, packed);
}
void DenseInputGradient(const DenseInputGradientCall& call) {
  HWY_DYNAMIC_DISPATCH(DenseInputGradientRows)(call);
}
void DenseWeightGradient(const DenseWeightGradientCall& call) {
  HWY_DYNAMIC_DISPATCH(DenseWeightGradientRows)(call);
}

bool ConvolvesInPlace(std::int64_t filters) {
  return HWY_DYNAMIC_DISPATCH(ConvolvesFilters)(filters);
}
void Convolve(const ConvolutionCall& call) {
  HWY_DYNAMIC_DISPATCH(ConvolveRows)(call);
}
bool SumsPatchesInPlace(const PatchGrid& grid) {
  return grid.run >= VectorLanes();
}
void ConvolutionWeightGradient(const ConvolutionGradientCall& call) {
  HWY_DYNAMIC_DISPATCH(ConvolutionGradientRows)(call);
}
void AddPatches(const PatchGrid& grid, std::int64_t first, std::int64_t count, ConstRows patches, float* image) {
  HWY_DYNAMIC_DISPATCH(AddPatchesRows)(grid, first, count, patches, image);
}
void Divide(float divisor, std::span<const float> from, std::span<float> to) {
  CONSAC_ASSERT(from.size() == to.size());
  HWY_DYNAMIC_DISPATCH(DivideRun)(divisor, from.data(), to.data(), static_cast<std::int64_t>(to.size()));
}

bool NeedsPreActivation(Activation activation) {
  return activation == Activation::kSilu;
}
void Activate(Activation activation, std::int64_t rows, std::int64_t columns, ConstRows x, Rows y) {
  HWY_DYNAMIC_DISPATCH(ActivateRows)(activation, rows, columns, x, y);
}
void MultiplyByDerivative(Activation activation, std::int64_t rows, std::int64_t columns, ConstRows source, Rows d) {
  HWY_DYNAMIC_DISPATCH(MultiplyRowsByDerivative)(activation, rows, columns, source, d);
}

void Tanh(std::span<const float> from, std::span<float> to) {
  CONSAC_ASSERT(from.size() == to.size());
  HWY_DYNAMIC_DISPATCH(TanhRun)(from.data(), to.data(), static_cast<std::int64_t>(to.size()));
}
void Exp(std::span<const float> from, std::span<float> to) {
  CONSAC_ASSERT(from.size() == to.size());
  HWY_DYNAMIC_DISPATCH(ExpRun)(from.data(), to.data(), static_cast<std::int64_t>(to.size()));
}
void Sigmoid(std::span<const float> from, std::span<float> to) {
  CONSAC_ASSERT(from.size() == to.size());
  HWY_DYNAMIC_DISPATCH(SigmoidRun)(from.data(), to.data(), static_cast<std::int64_t>(to.size()));
}

void AddTo(std::span<const float> from, std::span<float> to) {
  CONSAC_ASSERT(from.size() == to.size());
  HWY_DYNAMIC_DISPATCH(AddRun)(from.data(), to.data(), static_cast<std::int64_t>(to.size()));
}
void Polyak(float tau, std::span<const float> from, std::span<float> to) {
  CONSAC_ASSERT(from.size() == to.size());
  if (tau == 1.0f) {
    std::memcpy(to.data(), from.data(), to.size_bytes());
    return;
  }
  HWY_DYNAMIC_DISPATCH(PolyakRun)(tau, from.data(), to.data(), static_cast<std::int64_t>(to.size()));
}
double SumOfSquares(std::span<const float> values) {
  return HWY_DYNAMIC_DISPATCH(SquaresRun)(values.data(), static_cast<std::int64_t>(values.size()));
}

void AdamStep(const AdamCall& call, std::span<const float> gradient, std::span<float> m, std::span<float> v,
              std::span<float> p) {
  CONSAC_ASSERT(gradient.size() == p.size() && m.size() == p.size() && v.size() == p.size());
  const DenormalsAreZero quick;
  HWY_DYNAMIC_DISPATCH(AdamRun)
  (call, gradient.data(), m.data(), v.data(), p.data(), static_cast<std::int64_t>(p.size()));
}
void RmsPropStep(const RmsPropCall& call, std::span<const float> gradient, std::span<float> s, std::span<float> b,
                 std::span<float> p) {
  CONSAC_ASSERT(gradient.size() == p.size() && s.size() == p.size() && b.size() == p.size());
  const DenormalsAreZero quick;
  HWY_DYNAMIC_DISPATCH(RmsPropRun)
  (call, gradient.data(), s.data(), b.data(), p.data(), static_cast<std::int64_t>(p.size()));
}

std::vector<std::string_view> InstructionSets() {
  std::vector<std::string_view> names;
  for (std::int64_t sets = RunnableSets(); sets != 0; sets &= sets - 1) names.push_back(hwy::TargetName(sets & -sets));
  return names;
}

bool UseInstructionSet(std::string_view name) {
  for (std::int64_t sets = RunnableSets(); sets != 0; sets &= sets - 1) {
    const std::int64_t set = sets & -sets;
    if (name != hwy::TargetName(set)) continue;
    hwy::GetChosenTarget().Update(set);
    return true;
  }
  return false;
}

std::string_view InstructionSet() {
  return HWY_DYNAMIC_DISPATCH(TargetInUse)();
}
std::int64_t VectorLanes() {
  return HWY_DYNAMIC_DISPATCH(LanesInUse)();
}

double MeasurePeakFlops(double seconds) {
  constexpr std::int64_t kRounds = 20000;
  const double flops = static_cast<double>(kRounds) * 12.0 * 2.0 * static_cast<double>(VectorLanes());
  volatile float sink = 0.0f;
  double best = 0.0;
  const double start = Now();
  for (double begin = start; begin - start < seconds;) {
    sink = HWY_DYNAMIC_DISPATCH(PeakRun)(kRounds, sink);
    const double end = Now();
    if (end > begin && flops / (end - begin) > best) best = flops / (end - begin);
    begin = end;
  }
  static_cast<void>(sink);
  return best;
}

}  // namespace consac::nn
#endif  // HWY_ONCE
