// Elementary functions on vectors, of our own derivation: minimax fits found by linear programming over the
// reduced range, coefficients rounded to float and re-tuned against float evaluation. Included once per
// instruction set by kernels.cpp. NaN goes in and comes out.

#if defined(CONSAC_NN_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CONSAC_NN_MATH_INL_H_
#undef CONSAC_NN_MATH_INL_H_
#else
#define CONSAC_NN_MATH_INL_H_
#endif

#include "hwy/highway.h"

// x86's minimum and maximum hand on their second operand when one is NaN; those of other targets may drop it.
#undef CONSAC_X86_MINIMUM
#define CONSAC_X86_MINIMUM (HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128)

HWY_BEFORE_NAMESPACE();
namespace consac::nn::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The larger of `low` and x, and NaN for NaN.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V AtLeast(D d, V x, float low) {
  const V bound = hn::Set(d, low);
#if CONSAC_X86_MINIMUM
  return hn::Max(bound, x);
#else
  return hn::IfThenElse(hn::Lt(x, bound), bound, x);
#endif
}

/// The smaller of `high` and x, and NaN for NaN.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V AtMost(D d, V x, float high) {
  const V bound = hn::Set(d, high);
#if CONSAC_X86_MINIMUM
  return hn::Min(bound, x);
#else
  return hn::IfThenElse(hn::Gt(x, bound), bound, x);
#endif
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V Clamp(D d, V x, float low, float high) {
  return AtMost(d, AtLeast(d, x, low), high);
}

/// tanh(x) = x P(x^2) / Q(x^2), degrees 4 and 4; from |x| = 9.02 on, tanh rounds to 1.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V TanhOf(D d, V value) {
  const V x = Clamp(d, value, -9.02f, 9.02f);
  const V u = hn::Mul(x, x);
  V p = hn::MulAdd(hn::Set(d, 0x1.c9a596p-27f), u, hn::Set(d, 0x1.595602p-16f));
  V q = hn::MulAdd(hn::Set(d, 0x1.a0b98ep-21f), u, hn::Set(d, 0x1.584234p-12f));
  p = hn::MulAdd(p, u, hn::Set(d, 0x1.c9f8a2p-9f));
  q = hn::MulAdd(q, u, hn::Set(d, 0x1.a7df58p-6f));
  p = hn::MulAdd(p, u, hn::Set(d, 0x1.120456p-3f));
  q = hn::MulAdd(q, u, hn::Set(d, 0x1.de5776p-2f));
  p = hn::MulAdd(p, u, hn::Set(d, 1.0f));
  q = hn::MulAdd(q, u, hn::Set(d, 1.0f));
  return Clamp(d, hn::Div(hn::Mul(x, p), q), -1.0f, 1.0f);
}

/// exp(x) = 2^n e^r with |r| <= ln(2)/2. The pieces: e^r - 1, and two powers of two whose product is 2^n.
template <class V>
struct ExpParts {
  V minus_one;  // e^r - 1
  V half1;      // 2^floor(n/2)
  V half2;      // 2^(n - floor(n/2))
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE ExpParts<V> SplitExp(D d, V value) {
  const hn::RebindToSigned<D> di;
  const V x = Clamp(d, value, -104.5f, 89.5f);
  const auto n = hn::NearestInt(hn::Mul(x, hn::Set(d, 1.44269504f)));
  const V whole = hn::ConvertTo(d, n);
  V r = hn::NegMulAdd(whole, hn::Set(d, 0.693359375f), x);
  r = hn::NegMulAdd(whole, hn::Set(d, -2.12194440e-4f), r);
  V q = hn::MulAdd(hn::Set(d, 0.0013814549893140793f), r, hn::Set(d, 0.00836874544620514f));
  q = hn::MulAdd(q, r, hn::Set(d, 0.04166838899254799f));
  q = hn::MulAdd(q, r, hn::Set(d, 0.1666652113199234f));
  q = hn::MulAdd(q, r, hn::Set(d, 0.4999999403953552f));
  const auto bias = hn::Set(di, 127);
  const auto n1 = hn::ShiftRight<1>(n);
  const V half1 = hn::BitCast(d, hn::ShiftLeft<23>(hn::Add(n1, bias)));
  const V half2 = hn::BitCast(d, hn::ShiftLeft<23>(hn::Add(hn::Sub(n, n1), bias)));
  return {hn::MulAdd(hn::Mul(r, r), q, r), half1, half2};
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V ExpOf(D d, V x) {
  const ExpParts<V> e = SplitExp(d, x);
  return hn::Mul(hn::Mul(hn::Add(e.minus_one, hn::Set(d, 1.0f)), e.half1), e.half2);
}

/// exp(x) - 1 for x <= 0, without losing the digits near 0.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ExpMinusOneOf(D d, V x) {
  const ExpParts<V> e = SplitExp(d, x);
  const V power = hn::Mul(e.half1, e.half2);
  return hn::MulAdd(e.minus_one, power, hn::Sub(power, hn::Set(d, 1.0f)));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V SigmoidOf(D d, V x) {
  const V one = hn::Set(d, 1.0f);
  return hn::Div(one, hn::Add(one, ExpOf(d, hn::Neg(x))));
}

/// log(1 + u) for 0 <= u <= 1, as 2 artanh(s), s = u / (2 + u).
template <class D, class V = hn::Vec<D>>
HWY_INLINE V LogOnePlusOf(D d, V u) {
  const V s = hn::Div(u, hn::Add(u, hn::Set(d, 2.0f)));
  const V w = hn::Mul(s, s);
  V r = hn::MulAdd(hn::Set(d, 0.14012229442596436f), w, hn::Set(d, 0.13999570906162262f));
  r = hn::MulAdd(r, w, hn::Set(d, 0.20010849833488464f));
  r = hn::MulAdd(r, w, hn::Set(d, 0.3333320617675781f));
  const V twice = hn::Add(s, s);
  return hn::MulAdd(hn::Mul(twice, w), r, twice);
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
