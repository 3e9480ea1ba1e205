// The tile that all matrix products are made of: C[m, n] = start + sum over k of A(m, k) B(k, n), n along vectors, A
// broadcast. Every element is summed over k in order whatever the tile's size, so a result never depends on how the
// rows were cut. Included once per instruction set by kernels.cpp.

#if defined(CONSAC_NN_GEMM_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CONSAC_NN_GEMM_INL_H_
#undef CONSAC_NN_GEMM_INL_H_
#else
#define CONSAC_NN_GEMM_INL_H_
#endif

#include <cstring>
#include <utility>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace consac::nn::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using FloatVector = hn::Vec<Floats>;

/// How A lies in memory.
enum class Broadcast {
  kAlongK,  ///< A(m, k) = a[m * stride + k]
  kAlongM,  ///< A(m, k) = a[k * stride + m]
};

#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL || HWY_TARGET == HWY_NEON
inline constexpr std::int64_t kTileRows = 8;  // 32 registers: 16 sums
#else
inline constexpr std::int64_t kTileRows = 6;  // 16 registers: 12 sums
#endif
inline constexpr std::size_t kPanelVectors = 2;

inline std::int64_t LaneCount() {
  return static_cast<std::int64_t>(hn::Lanes(Floats()));
}

/// One tile's work. Columns come in panels of kPanelVectors vectors (or one vector).
struct TileCall {
  const float* a;
  std::int64_t a_stride;
  const float* b;
  std::int64_t b_stride;        // from one k to the next
  std::int64_t b_panel_stride;  // from one panel to the next
  std::int64_t k_count;
  const float* start;         // null: zero
  std::int64_t start_stride;  // 0: the same row (a bias) for every m
  float* c;
  std::int64_t c_stride;
  std::int64_t columns;  // valid ones; the rest of the last vectors is not stored
};

template <std::size_t... N>
HWY_INLINE void MultiplyAddRow(FloatVector a, const FloatVector* b, FloatVector* sums, std::index_sequence<N...>) {
  ((sums[N] = hn::MulAdd(a, b[N], sums[N])), ...);
}

template <Broadcast kBroadcast, std::size_t kVectors, std::size_t... M>
HWY_INLINE void MultiplyAddTile(const float* a, std::int64_t stride, const FloatVector* b,
                                FloatVector (*sums)[kVectors], std::index_sequence<M...>) {
  const Floats d;
  (MultiplyAddRow(hn::Set(d, kBroadcast == Broadcast::kAlongK ? a[static_cast<std::int64_t>(M) * stride] : a[M]), b,
                  sums[M], std::make_index_sequence<kVectors>()),
   ...);
}

template <std::size_t kPerPanel, std::size_t... N>
HWY_INLINE void LoadVectors(const float* from, std::int64_t panel_stride, FloatVector* to, std::index_sequence<N...>) {
  const Floats d;
  ((to[N] = hn::LoadU(d, from + static_cast<std::int64_t>(N / kPerPanel) * panel_stride +
                             static_cast<std::int64_t>(N % kPerPanel) * LaneCount())),
   ...);
}

template <std::size_t... N>
HWY_INLINE void ZeroVectors(FloatVector* to, std::index_sequence<N...>) {
  ((to[N] = hn::Zero(Floats())), ...);
}

template <std::size_t... N>
HWY_INLINE void StoreVectors(const FloatVector* from, float* to, std::index_sequence<N...>) {
  (hn::StoreU(from[N], Floats(), to + static_cast<std::int64_t>(N) * LaneCount()), ...);
}

/// Reads or writes only the valid columns of a row, through a buffer.
template <std::size_t kVectors>
HWY_INLINE void LoadPartRow(const float* from, std::int64_t columns, FloatVector* to) {
  HWY_ALIGN float buffer[kVectors * HWY_MAX_BYTES / sizeof(float)] = {};
  std::memcpy(buffer, from, static_cast<std::size_t>(columns) * sizeof(float));
  LoadVectors<kVectors>(buffer, 0, to, std::make_index_sequence<kVectors>());
}
template <std::size_t kVectors>
HWY_INLINE void StorePartRow(const FloatVector* from, std::int64_t columns, float* to) {
  HWY_ALIGN float buffer[kVectors * HWY_MAX_BYTES / sizeof(float)];
  StoreVectors(from, buffer, std::make_index_sequence<kVectors>());
  std::memcpy(to, buffer, static_cast<std::size_t>(columns) * sizeof(float));
}

template <std::size_t kVectors, std::size_t... M>
HWY_INLINE void StartTile(const TileCall& t, FloatVector (*sums)[kVectors], std::index_sequence<M...>) {
  constexpr auto kAll = std::make_index_sequence<kVectors>();
  if (t.start == nullptr) {
    (ZeroVectors(sums[M], kAll), ...);
  } else if (t.columns == static_cast<std::int64_t>(kVectors) * LaneCount()) {
    (LoadVectors<kVectors>(t.start + static_cast<std::int64_t>(M) * t.start_stride, 0, sums[M], kAll), ...);
  } else {
    (LoadPartRow<kVectors>(t.start + static_cast<std::int64_t>(M) * t.start_stride, t.columns, sums[M]), ...);
  }
}

template <std::size_t kVectors, std::size_t... M>
HWY_INLINE void FinishTile(const TileCall& t, const FloatVector (*sums)[kVectors], std::index_sequence<M...>) {
  if (t.columns == static_cast<std::int64_t>(kVectors) * LaneCount()) {
    (StoreVectors(sums[M], t.c + static_cast<std::int64_t>(M) * t.c_stride, std::make_index_sequence<kVectors>()), ...);
  } else {
    (StorePartRow<kVectors>(sums[M], t.columns, t.c + static_cast<std::int64_t>(M) * t.c_stride), ...);
  }
}

/// kM rows by kPanels panels of kPerPanel vectors.
template <Broadcast kBroadcast, std::size_t kM, std::size_t kPanels, std::size_t kPerPanel>
HWY_NOINLINE void RunTile(const TileCall& t) {
  constexpr std::size_t kVectors = kPanels * kPerPanel;
  constexpr auto kRows = std::make_index_sequence<kM>();
  FloatVector sums[kM][kVectors];
  StartTile<kVectors>(t, sums, kRows);
  const float* a = t.a;
  const float* b = t.b;
  const std::int64_t a_step = kBroadcast == Broadcast::kAlongK ? 1 : t.a_stride;
  for (std::int64_t k = t.k_count; k > 0; --k) {
    FloatVector row[kVectors];
    LoadVectors<kPerPanel>(b, t.b_panel_stride, row, std::make_index_sequence<kVectors>());
    MultiplyAddTile<kBroadcast, kVectors>(a, t.a_stride, row, sums, kRows);
    a += a_step;
    b += t.b_stride;
  }
  FinishTile<kVectors>(t, sums, kRows);
}

/// One panel, `rows` <= kTileRows rows.
template <Broadcast kBroadcast, std::size_t kPerPanel>
HWY_INLINE void RunPanelTile(std::int64_t rows, const TileCall& t) {
  switch (rows) {
    case 1:
      return RunTile<kBroadcast, 1, 1, kPerPanel>(t);
    case 2:
      return RunTile<kBroadcast, 2, 1, kPerPanel>(t);
    case 3:
      return RunTile<kBroadcast, 3, 1, kPerPanel>(t);
    case 4:
      return RunTile<kBroadcast, 4, 1, kPerPanel>(t);
    case 5:
      return RunTile<kBroadcast, 5, 1, kPerPanel>(t);
    case 6:
      return RunTile<kBroadcast, 6, 1, kPerPanel>(t);
    case 7:
      return RunTile<kBroadcast, 7, 1, kPerPanel>(t);
    default:
      return RunTile<kBroadcast, kTileRows, 1, kPerPanel>(t);
  }
}

/// A whole product over panels laid out one behind the other.
struct ProductCall {
  std::int64_t rows;     // m
  std::int64_t columns;  // n
  std::int64_t k_count;
  const float* a;
  std::int64_t a_stride;
  const float* b;
  std::int64_t b_stride;      // 0: packed, a panel's width
  const float* start;         // null: zero
  std::int64_t start_stride;  // 0: a bias
  float* c;
  std::int64_t c_stride;
};

/// Vectors of the panel that begins at column `first` of `columns`.
HWY_INLINE std::int64_t PanelVectors(std::int64_t first, std::int64_t columns) {
  return columns - first > LaneCount() ? 2 : 1;
}

/// Panels that one or two rows take together, so that enough sums run side by side.
template <Broadcast kBroadcast>
HWY_INLINE std::int64_t WideTile(std::int64_t rows, std::int64_t full_panels, const TileCall& t) {
  if (rows == 1 && full_panels >= 4) {
    RunTile<kBroadcast, 1, 4, kPanelVectors>(t);
    return 4;
  }
  if (rows <= 2 && full_panels >= 2) {
    if (rows == 1) RunTile<kBroadcast, 1, 2, kPanelVectors>(t);
    if (rows == 2) RunTile<kBroadcast, 2, 2, kPanelVectors>(t);
    return 2;
  }
  return 0;
}

template <Broadcast kBroadcast>
HWY_INLINE void Product(const ProductCall& p) {
  const std::int64_t lanes = LaneCount();
  const std::int64_t width = static_cast<std::int64_t>(kPanelVectors) * lanes;
  const std::int64_t a_row = kBroadcast == Broadcast::kAlongK ? p.a_stride : 1;
  for (std::int64_t n = 0; n < p.columns;) {
    const std::int64_t vectors = PanelVectors(n, p.columns);
    TileCall t{p.a,
               p.a_stride,
               p.b_stride == 0 ? p.b + n * p.k_count : p.b + n,
               p.b_stride == 0 ? vectors * lanes : p.b_stride,
               p.b_stride == 0 ? width * p.k_count : width,
               p.k_count,
               p.start == nullptr ? nullptr : p.start + n,
               p.start_stride,
               p.c + n,
               p.c_stride,
               p.columns - n < vectors * lanes ? p.columns - n : vectors * lanes};
    if (p.rows <= 2) {
      TileCall wide = t;
      const std::int64_t full_panels = (p.columns - n) / width;
      wide.columns = (full_panels >= 4 && p.rows == 1 ? 4 : 2) * width;
      if (const std::int64_t panels = WideTile<kBroadcast>(p.rows, full_panels, wide); panels > 0) {
        n += panels * width;
        continue;
      }
    }
    for (std::int64_t m = 0; m < p.rows; m += kTileRows) {
      const std::int64_t rows = p.rows - m < kTileRows ? p.rows - m : kTileRows;
      TileCall tile = t;
      tile.a += m * a_row;
      tile.c += m * p.c_stride;
      if (tile.start != nullptr) tile.start += m * p.start_stride;
      if (vectors == 2) RunPanelTile<kBroadcast, 2>(rows, tile);
      if (vectors == 1) RunPanelTile<kBroadcast, 1>(rows, tile);
    }
    n += vectors * lanes;
  }
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
