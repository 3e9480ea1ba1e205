// One-pass optimiser steps, the sum of squares and the measured peak. Included once per instruction set by
// kernels.cpp.

#if defined(CONSAC_NN_OPTIMISER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CONSAC_NN_OPTIMISER_INL_H_
#undef CONSAC_NN_OPTIMISER_INL_H_
#else
#define CONSAC_NN_OPTIMISER_INL_H_
#endif

#include <cstring>

#include "consac/nn/kernels.h"
#include "hwy/highway.h"
#include "nn/gemm-inl.h"

HWY_BEFORE_NAMESPACE();
namespace consac::nn::HWY_NAMESPACE {

struct AdamOp {
  FloatVector scale, beta1, rest1, beta2, rest2, step, root_scale, epsilon;

  explicit HWY_INLINE AdamOp(const AdamCall& c) {
    const Floats d;
    scale = hn::Set(d, c.gradient_scale);
    beta1 = hn::Set(d, c.beta1);
    rest1 = hn::Set(d, 1.0f - c.beta1);
    beta2 = hn::Set(d, c.beta2);
    rest2 = hn::Set(d, 1.0f - c.beta2);
    step = hn::Set(d, c.step);
    root_scale = hn::Set(d, c.root_scale);
    epsilon = hn::Set(d, c.epsilon);
  }
  HWY_INLINE void Apply(const float* gradient, float* m, float* v, float* p) const {
    const Floats d;
    const FloatVector g = hn::Mul(hn::LoadU(d, gradient), scale);
    const FloatVector new_m = hn::MulAdd(beta1, hn::LoadU(d, m), hn::Mul(rest1, g));
    const FloatVector new_v = hn::MulAdd(beta2, hn::LoadU(d, v), hn::Mul(rest2, hn::Mul(g, g)));
    const FloatVector root = hn::MulAdd(hn::Sqrt(new_v), root_scale, epsilon);
    hn::StoreU(new_m, d, m);
    hn::StoreU(new_v, d, v);
    hn::StoreU(hn::Sub(hn::LoadU(d, p), hn::Div(hn::Mul(step, new_m), root)), d, p);
  }
};

struct RmsPropOp {
  FloatVector scale, decay, rest, momentum, inner, outer, inside, outside;

  explicit HWY_INLINE RmsPropOp(const RmsPropCall& c) {
    const Floats d;
    scale = hn::Set(d, c.gradient_scale);
    decay = hn::Set(d, c.decay);
    rest = hn::Set(d, 1.0f - c.decay);
    momentum = hn::Set(d, c.momentum);
    inner = hn::Set(d, c.inner);
    outer = hn::Set(d, c.outer);
    inside = hn::Set(d, c.epsilon_inside);
    outside = hn::Set(d, c.epsilon_outside);
  }
  HWY_INLINE void Apply(const float* gradient, float* s, float* b, float* p) const {
    const Floats d;
    const FloatVector g = hn::Mul(hn::LoadU(d, gradient), scale);
    const FloatVector new_s = hn::MulAdd(decay, hn::LoadU(d, s), hn::Mul(rest, hn::Mul(g, g)));
    const FloatVector root = hn::Add(hn::Sqrt(hn::Add(new_s, inside)), outside);
    const FloatVector new_b = hn::MulAdd(momentum, hn::LoadU(d, b), hn::Div(hn::Mul(inner, g), root));
    hn::StoreU(new_s, d, s);
    hn::StoreU(new_b, d, b);
    hn::StoreU(hn::NegMulAdd(outer, new_b, hn::LoadU(d, p)), d, p);
  }
};

/// op.Apply over four arrays; the tail goes through buffers.
template <class Op>
HWY_INLINE void UpdateRun(const Op& op, const float* gradient, float* s1, float* s2, float* p, std::int64_t count) {
  const std::int64_t lanes = LaneCount();
  std::int64_t i = 0;
  for (; i + lanes <= count; i += lanes) op.Apply(gradient + i, s1 + i, s2 + i, p + i);
  if (i == count) return;
  const std::size_t bytes = static_cast<std::size_t>(count - i) * sizeof(float);
  HWY_ALIGN float tail[4][HWY_MAX_BYTES / sizeof(float)] = {};
  std::memcpy(tail[0], gradient + i, bytes);
  std::memcpy(tail[1], s1 + i, bytes);
  std::memcpy(tail[2], s2 + i, bytes);
  std::memcpy(tail[3], p + i, bytes);
  op.Apply(tail[0], tail[1], tail[2], tail[3]);
  std::memcpy(s1 + i, tail[1], bytes);
  std::memcpy(s2 + i, tail[2], bytes);
  std::memcpy(p + i, tail[3], bytes);
}

void AdamRun(const AdamCall& call, const float* gradient, float* m, float* v, float* p, std::int64_t count) {
  UpdateRun(AdamOp(call), gradient, m, v, p, count);
}

void RmsPropRun(const RmsPropCall& call, const float* gradient, float* s, float* b, float* p, std::int64_t count) {
  UpdateRun(RmsPropOp(call), gradient, s, b, p, count);
}

void AddRun(const float* from, float* to, std::int64_t count) {
  const Floats d;
  const std::int64_t lanes = LaneCount();
  std::int64_t i = 0;
  for (; i + lanes <= count; i += lanes) hn::StoreU(hn::Add(hn::LoadU(d, to + i), hn::LoadU(d, from + i)), d, to + i);
  for (; i < count; ++i) to[i] += from[i];
}

void PolyakRun(float tau, const float* from, float* to, std::int64_t count) {
  const Floats d;
  const std::int64_t lanes = LaneCount();
  const FloatVector share = hn::Set(d, tau), rest = hn::Set(d, 1.0f - tau);
  std::int64_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    hn::StoreU(hn::MulAdd(share, hn::LoadU(d, from + i), hn::Mul(rest, hn::LoadU(d, to + i))), d, to + i);
  }
  if (i == count) return;
  FloatVector a, b;
  LoadPartRow<1>(from + i, count - i, &a);
  LoadPartRow<1>(to + i, count - i, &b);
  const FloatVector mixed = hn::MulAdd(share, a, hn::Mul(rest, b));
  StorePartRow<1>(&mixed, count - i, to + i);
}

double SquaresRun(const float* values, std::int64_t count) {
  const hn::ScalableTag<double> dd;
  const hn::Rebind<float, decltype(dd)> df;
  using Doubles = hn::Vec<decltype(dd)>;
  const std::int64_t lanes = static_cast<std::int64_t>(hn::Lanes(dd));
  Doubles sums[4] = {hn::Zero(dd), hn::Zero(dd), hn::Zero(dd), hn::Zero(dd)};
  std::int64_t i = 0;
  for (; i + 4 * lanes <= count; i += 4 * lanes) {
    const Doubles a = hn::PromoteTo(dd, hn::LoadU(df, values + i));
    const Doubles b = hn::PromoteTo(dd, hn::LoadU(df, values + i + lanes));
    const Doubles c = hn::PromoteTo(dd, hn::LoadU(df, values + i + 2 * lanes));
    const Doubles e = hn::PromoteTo(dd, hn::LoadU(df, values + i + 3 * lanes));
    sums[0] = hn::MulAdd(a, a, sums[0]);
    sums[1] = hn::MulAdd(b, b, sums[1]);
    sums[2] = hn::MulAdd(c, c, sums[2]);
    sums[3] = hn::MulAdd(e, e, sums[3]);
  }
  double total = hn::GetLane(hn::SumOfLanes(dd, hn::Add(hn::Add(sums[0], sums[1]), hn::Add(sums[2], sums[3]))));
  for (; i < count; ++i) total += static_cast<double>(values[i]) * static_cast<double>(values[i]);
  return total;
}

template <std::size_t... N>
HWY_INLINE void PeakStep(FloatVector factor, FloatVector addend, FloatVector* sums, std::index_sequence<N...>) {
  ((sums[N] = hn::MulAdd(sums[N], factor, addend)), ...);
}

template <std::size_t... N>
HWY_INLINE void StartPeak(float seed, FloatVector* sums, std::index_sequence<N...>) {
  ((sums[N] = hn::Set(Floats(), seed + static_cast<float>(N))), ...);
}

/// Runs `rounds` rounds of twelve independent multiply-adds. They start apart (a compiler merges equal ones) and their
/// sum is returned, so that they are kept.
float PeakRun(std::int64_t rounds, float seed) {
  const Floats d;
  constexpr auto kAll = std::make_index_sequence<12>();
  const FloatVector factor = hn::Set(d, 0.999999f);
  const FloatVector addend = hn::Set(d, 1e-6f);
  FloatVector sums[12];
  StartPeak(seed, sums, kAll);
  for (std::int64_t i = 0; i < rounds; ++i) PeakStep(factor, addend, sums, kAll);
  FloatVector total = sums[0];
  for (std::size_t n = 1; n < 12; ++n) total = hn::Add(total, sums[n]);
  return hn::GetLane(hn::SumOfLanes(d, total));
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
