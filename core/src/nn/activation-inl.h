// One struct per activation: its value, and its derivative from the stored value (the result, or what came before
// it for silu). Included once per instruction set by kernels.cpp.

#if defined(CONSAC_NN_ACTIVATION_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CONSAC_NN_ACTIVATION_INL_H_
#undef CONSAC_NN_ACTIVATION_INL_H_
#else
#define CONSAC_NN_ACTIVATION_INL_H_
#endif

#include <cstring>

#include "consac/nn/kernels.h"
#include "hwy/highway.h"
#include "nn/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace consac::nn::HWY_NAMESPACE {

struct LinearOp {
  template <class D, class V>
  HWY_INLINE V Value(D, V x) const {
    return x;
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D d, V) const {
    return hn::Set(d, 1.0f);
  }
};

struct TanhOp {
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return TanhOf(d, x);
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D d, V y) const {
    return hn::NegMulAdd(y, y, hn::Set(d, 1.0f));
  }
};

struct ReluOp {
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return AtLeast(d, x, 0.0f);
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D d, V y) const {
    return hn::IfThenElseZero(hn::Gt(y, hn::Zero(d)), hn::Set(d, 1.0f));
  }
};

struct SigmoidOp {
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return SigmoidOf(d, x);
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D, V y) const {
    return hn::NegMulAdd(y, y, y);
  }
};

struct EluOp {  // alpha 1
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return hn::IfThenElse(hn::Gt(x, hn::Zero(d)), x, ExpMinusOneOf(d, x));
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D d, V y) const {
    const V one = hn::Set(d, 1.0f);
    return hn::IfThenElse(hn::Gt(y, hn::Zero(d)), one, hn::Add(y, one));
  }
};

struct LeakyReluOp {  // slope 0.01, PyTorch's
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return hn::IfThenElse(hn::Gt(x, hn::Zero(d)), x, hn::Mul(x, hn::Set(d, 0.01f)));
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D d, V y) const {
    return hn::IfThenElse(hn::Gt(y, hn::Zero(d)), hn::Set(d, 1.0f), hn::Set(d, 0.01f));
  }
};

struct SiluOp {  // its derivative takes the value before the activation
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return hn::Mul(x, SigmoidOf(d, x));
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D d, V z) const {
    const V s = SigmoidOf(d, z);
    const V one = hn::Set(d, 1.0f);
    return hn::Mul(s, hn::MulAdd(z, hn::Sub(one, s), one));
  }
};

struct SoftplusOp {
  template <class D, class V>
  HWY_INLINE V Value(D d, V x) const {
    return hn::Add(AtLeast(d, x, 0.0f), LogOnePlusOf(d, ExpOf(d, hn::Neg(hn::Abs(x)))));
  }
  template <class D, class V>
  HWY_INLINE V Derivative(D d, V y) const {
    return hn::Neg(ExpMinusOneOf(d, hn::Neg(y)));
  }
};

/// y = op(x) over one run of floats.
template <class Function>
HWY_INLINE void MapRun(Function function, const float* x, float* y, std::int64_t count) {
  const hn::ScalableTag<float> d;
  const std::int64_t lanes = static_cast<std::int64_t>(hn::Lanes(d));
  std::int64_t i = 0;
  for (; i + lanes <= count; i += lanes) hn::StoreU(function.Value(d, hn::LoadU(d, x + i)), d, y + i);
  if (i < count) {
    const std::size_t bytes = static_cast<std::size_t>(count - i) * sizeof(float);
    HWY_ALIGN float tail[HWY_MAX_BYTES / sizeof(float)] = {};
    std::memcpy(tail, x + i, bytes);
    hn::Store(function.Value(d, hn::Load(d, tail)), d, tail);
    std::memcpy(y + i, tail, bytes);
  }
}

/// to *= op'(from) over one run of floats.
template <class Function>
HWY_INLINE void DerivativeRun(Function function, const float* from, float* to, std::int64_t count) {
  const hn::ScalableTag<float> d;
  const std::int64_t lanes = static_cast<std::int64_t>(hn::Lanes(d));
  std::int64_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    hn::StoreU(hn::Mul(hn::LoadU(d, to + i), function.Derivative(d, hn::LoadU(d, from + i))), d, to + i);
  }
  if (i < count) {
    const std::size_t bytes = static_cast<std::size_t>(count - i) * sizeof(float);
    HWY_ALIGN float source[HWY_MAX_BYTES / sizeof(float)] = {};
    HWY_ALIGN float result[HWY_MAX_BYTES / sizeof(float)] = {};
    std::memcpy(source, from + i, bytes);
    std::memcpy(result, to + i, bytes);
    hn::Store(hn::Mul(hn::Load(d, result), function.Derivative(d, hn::Load(d, source))), d, result);
    std::memcpy(to + i, result, bytes);
  }
}

struct MapMatrix {
  std::int64_t rows, columns;
  ConstRows from;
  Rows to;
  template <class Function>
  HWY_NOINLINE void operator()(Function function) const {
    if (from.stride == columns && to.stride == columns) return MapRun(function, from.data, to.data, rows * columns);
    for (std::int64_t r = 0; r < rows; ++r) {
      MapRun(function, from.data + r * from.stride, to.data + r * to.stride, columns);
    }
  }
};

struct DerivativeMatrix {
  std::int64_t rows, columns;
  ConstRows from;
  Rows to;
  template <class Function>
  HWY_NOINLINE void operator()(Function function) const {
    if (from.stride == columns && to.stride == columns) {
      return DerivativeRun(function, from.data, to.data, rows * columns);
    }
    for (std::int64_t r = 0; r < rows; ++r) {
      DerivativeRun(function, from.data + r * from.stride, to.data + r * to.stride, columns);
    }
  }
};

/// Calls visitor(op) with the struct of `activation`.
template <class Visitor>
HWY_INLINE void WithActivation(Activation activation, const Visitor& visitor) {
  switch (activation) {
    case Activation::kLinear:
      return visitor(LinearOp());
    case Activation::kTanh:
      return visitor(TanhOp());
    case Activation::kRelu:
      return visitor(ReluOp());
    case Activation::kSigmoid:
      return visitor(SigmoidOp());
    case Activation::kElu:
      return visitor(EluOp());
    case Activation::kLeakyRelu:
      return visitor(LeakyReluOp());
    case Activation::kSilu:
      return visitor(SiluOp());
    case Activation::kSoftplus:
      return visitor(SoftplusOp());
  }
}

void ActivateRows(Activation activation, std::int64_t rows, std::int64_t columns, ConstRows x, Rows y) {
  if (activation == Activation::kLinear && x.data == y.data) return;
  WithActivation(activation, MapMatrix{rows, columns, x, y});
}

void MultiplyRowsByDerivative(Activation activation, std::int64_t rows, std::int64_t columns, ConstRows source,
                              Rows d) {
  if (activation == Activation::kLinear) return;
  WithActivation(activation, DerivativeMatrix{rows, columns, source, d});
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
