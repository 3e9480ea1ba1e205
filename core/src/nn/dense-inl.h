// A dense layer forward and backward, from the tiles of gemm-inl.h. Included once per instruction set by kernels.cpp.
// Packed forward: [bias, padded][panels of W^T: in x panel width][tail rows of W, each padded to whole vectors], where
// the tail is the last one to four outputs (a head, mostly): those are dot products, since a panel would be idle.

#if defined(CONSAC_NN_DENSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CONSAC_NN_DENSE_INL_H_
#undef CONSAC_NN_DENSE_INL_H_
#else
#define CONSAC_NN_DENSE_INL_H_
#endif

#include <cstring>

#include "consac/nn/kernels.h"
#include "hwy/highway.h"
#include "nn/activation-inl.h"
#include "nn/gemm-inl.h"

HWY_BEFORE_NAMESPACE();
namespace consac::nn::HWY_NAMESPACE {

HWY_INLINE std::int64_t RoundUpToLanes(std::int64_t count) {
  return (count + LaneCount() - 1) / LaneCount() * LaneCount();
}

/// Outputs that are dot products instead of panel columns.
HWY_INLINE std::int64_t TailOutputs(std::int64_t out_size) {
  const std::int64_t rest = out_size % (2 * LaneCount());
  return rest <= 4 ? rest : 0;
}

struct DenseLayout {
  DenseLayout(std::int64_t in_size, std::int64_t out_size)
      : tail(TailOutputs(out_size)),
        panelled(out_size - tail),
        panels_at(RoundUpToLanes(panelled + 4)),
        tail_at(panels_at + RoundUpToLanes(panelled) * in_size),
        tail_stride(RoundUpToLanes(in_size)),
        size(tail_at + tail * tail_stride) {}
  std::int64_t tail, panelled, panels_at, tail_at, tail_stride, size;
};

#if HWY_TARGET != HWY_SCALAR
/// Four numbers of each of Lanes(d) / 4 rows, which lie four rows apart.
template <class D>
HWY_INLINE hn::Vec<D> LoadEveryFourth(D d, const float* from, std::int64_t stride) {
  if constexpr (hn::MaxLanes(D()) <= 4) {
    return hn::LoadU(d, from);
  } else {
    const hn::Half<D> half;
    const std::int64_t rows = static_cast<std::int64_t>(hn::MaxLanes(half));
    return hn::Combine(d, LoadEveryFourth(half, from + rows * stride, stride), LoadEveryFourth(half, from, stride));
  }
}

/// Four columns turned round: to(k, n) = from(n, k) for k below 4 and n below Lanes(d).
template <class D>
HWY_INLINE void TransposeFour(D d, const float* from, std::int64_t from_stride, float* to, std::int64_t to_stride) {
  const auto r0 = LoadEveryFourth(d, from, from_stride);
  const auto r1 = LoadEveryFourth(d, from + from_stride, from_stride);
  const auto r2 = LoadEveryFourth(d, from + 2 * from_stride, from_stride);
  const auto r3 = LoadEveryFourth(d, from + 3 * from_stride, from_stride);
  const auto even_low = hn::InterleaveLower(d, r0, r2);
  const auto odd_low = hn::InterleaveLower(d, r1, r3);
  const auto even_high = hn::InterleaveUpper(d, r0, r2);
  const auto odd_high = hn::InterleaveUpper(d, r1, r3);
  hn::StoreU(hn::InterleaveLower(d, even_low, odd_low), d, to);
  hn::StoreU(hn::InterleaveUpper(d, even_low, odd_low), d, to + to_stride);
  hn::StoreU(hn::InterleaveLower(d, even_high, odd_high), d, to + 2 * to_stride);
  hn::StoreU(hn::InterleaveUpper(d, even_high, odd_high), d, to + 3 * to_stride);
}

/// As many rows as D has lanes, turned round into columns.
template <class D>
HWY_INLINE void TransposeRows(D d, const float* rows, std::int64_t k_count, std::int64_t width, float* to) {
  std::int64_t k = 0;
  for (; k + 4 <= k_count; k += 4) TransposeFour(d, rows + k, k_count, to + k * width, width);
  for (; k < k_count; ++k) {
    for (std::size_t n = 0; n < hn::MaxLanes(d); ++n)
      to[k * width + static_cast<std::int64_t>(n)] = rows[static_cast<std::int64_t>(n) * k_count + k];
  }
}
#endif

/// One panel of W^T: to(k, i) = weight(first + i, k), zeros where there is no such row.
HWY_INLINE void PackTransposedPanel(const float* weight, std::int64_t k_count, std::int64_t valid, std::int64_t width,
                                    float* to) {
  std::int64_t i = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<float, 4> few;
  for (; i + LaneCount() <= valid; i += LaneCount())
    TransposeRows(Floats(), weight + i * k_count, k_count, width, to + i);
  for (; i + 4 <= valid; i += 4) TransposeRows(few, weight + i * k_count, k_count, width, to + i);
#endif
  for (; i < width; ++i) {
    for (std::int64_t k = 0; k < k_count; ++k) to[k * width + i] = i < valid ? weight[i * k_count + k] : 0.0f;
  }
}

/// One panel of W: to(k, i) = weight(k, first + i), zeros where there is no such column.
HWY_INLINE void PackStraightPanel(const float* weight, std::int64_t k_count, std::int64_t stride, std::int64_t valid,
                                  std::int64_t width, float* to) {
  const Floats d;
  for (std::int64_t k = 0; k < k_count; ++k, weight += stride, to += width) {
    if (valid == width) {
      for (std::int64_t i = 0; i < width; i += LaneCount()) hn::StoreU(hn::LoadU(d, weight + i), d, to + i);
    } else {
      for (std::int64_t i = 0; i < width; ++i) to[i] = i < valid ? weight[i] : 0.0f;
    }
  }
}

std::int64_t DensePackedSize(std::int64_t in_size, std::int64_t out_size) {
  return DenseLayout(in_size, out_size).size;
}

void DensePack(const float* weight, const float* bias, std::int64_t in_size, std::int64_t out_size, float* packed) {
  const DenseLayout layout(in_size, out_size);
  std::memset(packed, 0, static_cast<std::size_t>(layout.panels_at) * sizeof(float));
  std::memcpy(packed, bias, static_cast<std::size_t>(out_size) * sizeof(float));
  float* panel = packed + layout.panels_at;
  for (std::int64_t n = 0; n < layout.panelled;) {
    const std::int64_t width = PanelVectors(n, layout.panelled) * LaneCount();
    PackTransposedPanel(weight + n * in_size, in_size, width < layout.panelled - n ? width : layout.panelled - n, width,
                        panel);
    panel += width * in_size;
    n += width;
  }
  for (std::int64_t o = 0; o < layout.tail; ++o) {
    float* row = packed + layout.tail_at + o * layout.tail_stride;
    std::memset(row, 0, static_cast<std::size_t>(layout.tail_stride) * sizeof(float));
    std::memcpy(row, weight + (layout.panelled + o) * in_size, static_cast<std::size_t>(in_size) * sizeof(float));
  }
}

/// y[o] = bias[o] + W[o] . x for the one to four tail outputs of one row.
template <std::size_t kOut>
HWY_INLINE void DotRow(const float* x, std::int64_t in_size, const float* w, std::int64_t w_stride, const float* bias,
                       float* y) {
  const Floats d;
  const std::int64_t lanes = LaneCount();
  FloatVector sums[kOut];
  ZeroVectors(sums, std::make_index_sequence<kOut>());
  std::int64_t k = 0;
  for (; k + lanes <= in_size; k += lanes) {
    const FloatVector v = hn::LoadU(d, x + k);
    for (std::size_t o = 0; o < kOut; ++o) {
      sums[o] = hn::MulAdd(v, hn::LoadU(d, w + static_cast<std::int64_t>(o) * w_stride + k), sums[o]);
    }
  }
  if (k < in_size) {
    FloatVector v;
    LoadPartRow<1>(x + k, in_size - k, &v);
    for (std::size_t o = 0; o < kOut; ++o) {
      sums[o] = hn::MulAdd(v, hn::LoadU(d, w + static_cast<std::int64_t>(o) * w_stride + k), sums[o]);
    }
  }
  for (std::size_t o = 0; o < kOut; ++o) y[o] = bias[o] + hn::GetLane(hn::SumOfLanes(d, sums[o]));
}

template <std::size_t kOut>
HWY_NOINLINE void DotRows(std::int64_t rows, std::int64_t in_size, ConstRows x, const float* w, std::int64_t w_stride,
                          const float* bias, Rows y) {
  for (std::int64_t r = 0; r < rows; ++r) {
    DotRow<kOut>(x.data + r * x.stride, in_size, w, w_stride, bias, y.data + r * y.stride);
  }
}

void DenseForwardRows(const DenseLayer& layer, const ForwardCall& call) {
  const DenseLayout layout(layer.in_size, layer.out_size);
  const bool keep = call.z.data != nullptr;
  float* z = keep ? call.z.data : call.y.data;
  const std::int64_t z_stride = keep ? call.z.stride : call.y.stride;
  const float* bias = call.packed;
  const bool rectify = !keep && layer.activation == Activation::kRelu;
  if (layout.panelled > 0) {
    Product<Broadcast::kAlongK>({call.rows, layout.panelled, layer.in_size, call.x.data, call.x.stride,
                                 call.packed + layout.panels_at, 0, bias, 0, z, z_stride, rectify});
  }
  const float* w = call.packed + layout.tail_at;
  const Rows tail{z + layout.panelled, z_stride};
  bias += layout.panelled;
  switch (layout.tail) {
    case 1:
      DotRows<1>(call.rows, layer.in_size, call.x, w, layout.tail_stride, bias, tail);
      break;
    case 2:
      DotRows<2>(call.rows, layer.in_size, call.x, w, layout.tail_stride, bias, tail);
      break;
    case 3:
      DotRows<3>(call.rows, layer.in_size, call.x, w, layout.tail_stride, bias, tail);
      break;
    case 4:
      DotRows<4>(call.rows, layer.in_size, call.x, w, layout.tail_stride, bias, tail);
      break;
    default:
      break;
  }
  const std::int64_t done = rectify ? layout.panelled : 0;
  if (done == layer.out_size) return;
  ActivateRows(layer.activation, call.rows, layer.out_size - done, {z + done, z_stride},
               {call.y.data + done, call.y.stride});
}

std::int64_t DensePackedBackwardSize(std::int64_t in_size, std::int64_t out_size) {
  return RoundUpToLanes(in_size) * out_size;
}

void DensePackBackward(const float* weight, std::int64_t in_size, std::int64_t out_size, float* packed) {
  for (std::int64_t n = 0; n < in_size;) {
    const std::int64_t width = PanelVectors(n, in_size) * LaneCount();
    PackStraightPanel(weight + n, out_size, in_size, width < in_size - n ? width : in_size - n, width, packed);
    packed += width * out_size;
    n += width;
  }
}

void DenseInputGradientRows(const DenseInputGradientCall& call) {
  const bool add = call.store == Store::kAdd;
  ProductCall product{call.shape.rows,
                      call.shape.in_size,
                      call.shape.out_size,
                      call.dz.data,
                      call.dz.stride,
                      call.packed,
                      0,
                      add ? call.dx.data : nullptr,
                      add ? call.dx.stride : 0,
                      call.dx.data,
                      call.dx.stride};
  product.rectified = call.rectified.data;
  product.rectified_stride = call.rectified.stride;
  Product<Broadcast::kAlongK>(product);
}

template <std::size_t... N>
HWY_INLINE void AddVectors(const float* from, FloatVector* sums, std::index_sequence<N...>) {
  ((sums[N] = hn::Add(sums[N], hn::LoadU(Floats(), from + static_cast<std::int64_t>(N) * LaneCount()))), ...);
}

/// db[n] (+)= sum over rows of dz[r, n], for kVectors vectors of columns, `valid` of them stored.
template <std::size_t kVectors>
HWY_INLINE void ColumnStrip(std::int64_t rows, std::int64_t valid, const float* dz, std::int64_t stride, bool add,
                            float* db) {
  constexpr auto kAll = std::make_index_sequence<kVectors>();
  FloatVector sums[kVectors];
  ZeroVectors(sums, kAll);
  if (add) LoadPartRow<kVectors>(db, valid, sums);
  for (std::int64_t r = 0; r < rows; ++r) AddVectors(dz + r * stride, sums, kAll);
  StorePartRow<kVectors>(sums, valid, db);
}

void ColumnSums(std::int64_t rows, std::int64_t columns, ConstRows dz, bool add, float* db) {
  const std::int64_t lanes = LaneCount();
  std::int64_t n = 0;
  for (; n + 4 * lanes <= columns; n += 4 * lanes) {
    ColumnStrip<4>(rows, 4 * lanes, dz.data + n, dz.stride, add, db + n);
  }
  for (; n < columns; n += lanes) {
    ColumnStrip<1>(rows, lanes < columns - n ? lanes : columns - n, dz.data + n, dz.stride, add, db + n);
  }
}

/// dw for few inputs: computes dw^T with vectors along the outputs, a strip at a time, and turns it round.
void NarrowWeightGradient(const DenseWeightGradientCall& call) {
  const std::int64_t in_size = call.shape.in_size;
  const std::int64_t width = static_cast<std::int64_t>(kPanelVectors) * LaneCount();
  HWY_ALIGN float strip[kPanelVectors * HWY_MAX_BYTES / sizeof(float) * (HWY_MAX_BYTES / sizeof(float))];
  for (std::int64_t o = 0; o < call.shape.out_size; o += width) {
    const std::int64_t outputs = call.shape.out_size - o < width ? call.shape.out_size - o : width;
    Product<Broadcast::kAlongM>({in_size, outputs, call.shape.rows, call.x.data, call.x.stride, call.dz.data + o,
                                 call.dz.stride, nullptr, 0, strip, width});
    for (std::int64_t i = 0; i < outputs; ++i) {
      float* row = call.dw + (o + i) * in_size;
      for (std::int64_t k = 0; k < in_size; ++k) {
        row[k] = (call.store == Store::kAdd ? row[k] : 0.0f) + strip[k * width + i];
      }
    }
  }
}

void DenseWeightGradientRows(const DenseWeightGradientCall& call) {
  const bool add = call.store == Store::kAdd;
  const std::int64_t in_size = call.shape.in_size;
  ColumnSums(call.shape.rows, call.shape.out_size, call.dz, add, call.db);
  if (in_size < LaneCount() && call.shape.out_size > in_size) return NarrowWeightGradient(call);
  Product<Broadcast::kAlongM>({call.shape.out_size, in_size, call.shape.rows, call.dz.data, call.dz.stride, call.x.data,
                               call.x.stride, add ? call.dw : nullptr, add ? in_size : 0, call.dw, in_size});
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
