// The tile that all matrix products are made of: C[m, n] = start + sum over k of A(m, k) B(k, n), n along vectors, A
// broadcast; stored as it is, through relu, or times relu's derivative. Every element is summed over k in order
// whatever the tile's size, so a result never depends on how the rows were cut. Included once per instruction set by
// kernels.cpp.

#if defined(CONSAC_NN_GEMM_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CONSAC_NN_GEMM_INL_H_
#undef CONSAC_NN_GEMM_INL_H_
#else
#define CONSAC_NN_GEMM_INL_H_
#endif

#include <cstring>
#include <utility>

#include "hwy/highway.h"
#include "nn/math-inl.h"

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
  std::int64_t columns;              // valid ones; the rest of the last vectors is not stored
  bool rectify = false;              // max(0, C) is stored
  const float* rectified = nullptr;  // [m, n] C is multiplied by 1 where it is above 0, else by 0; null: nowhere
  std::int64_t rectified_stride = 0;
};

/// `rows` rows further. In place: a processor that reads a copy's fields together waits for those just written singly.
template <Broadcast kBroadcast>
HWY_INLINE void MoveOn(std::int64_t rows, TileCall* t) {
  t->a += rows * (kBroadcast == Broadcast::kAlongK ? t->a_stride : 1);
  t->c += rows * t->c_stride;
  if (t->start != nullptr) t->start += rows * t->start_stride;
  if (t->rectified != nullptr) t->rectified += rows * t->rectified_stride;
}

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

/// relu of them.
template <std::size_t... N>
HWY_INLINE void RectifyVectors(FloatVector* sums, std::index_sequence<N...>) {
  ((sums[N] = AtLeast(Floats(), sums[N], 0.0f)), ...);
}

/// Times relu' of what relu has given: 1 where that is above 0.
template <std::size_t... N>
HWY_INLINE void MultiplyByRectified(const FloatVector* rectified, FloatVector* sums, std::index_sequence<N...>) {
  const Floats d;
  ((sums[N] = hn::Mul(sums[N], hn::IfThenElseZero(hn::Gt(rectified[N], hn::Zero(d)), hn::Set(d, 1.0f)))), ...);
}

template <std::size_t kVectors>
HWY_INLINE void MultiplyRowByRectified(const float* rectified, std::int64_t columns, FloatVector* sums) {
  constexpr auto kAll = std::make_index_sequence<kVectors>();
  FloatVector row[kVectors];
  if (columns == static_cast<std::int64_t>(kVectors) * LaneCount())
    LoadVectors<kVectors>(rectified, 0, row, kAll);
  else
    LoadPartRow<kVectors>(rectified, columns, row);
  MultiplyByRectified(row, sums, kAll);
}

template <std::size_t kVectors, std::size_t... M>
HWY_INLINE void FinishTile(const TileCall& t, FloatVector (*sums)[kVectors], std::index_sequence<M...>) {
  if (t.rectify) (RectifyVectors(sums[M], std::make_index_sequence<kVectors>()), ...);
  if (t.rectified != nullptr) {
    (MultiplyRowByRectified<kVectors>(t.rectified + static_cast<std::int64_t>(M) * t.rectified_stride, t.columns,
                                      sums[M]),
     ...);
  }
  if (t.columns == static_cast<std::int64_t>(kVectors) * LaneCount()) {
    (StoreVectors(sums[M], t.c + static_cast<std::int64_t>(M) * t.c_stride, std::make_index_sequence<kVectors>()), ...);
  } else {
    (StorePartRow<kVectors>(sums[M], t.columns, t.c + static_cast<std::int64_t>(M) * t.c_stride), ...);
  }
}

/// kM rows by kPanels panels of kPerPanel vectors.
template <Broadcast kBroadcast, std::size_t kM, std::size_t kPanels, std::size_t kPerPanel>
HWY_INLINE void ComputeTile(const TileCall& t) {
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

template <Broadcast kBroadcast, std::size_t kM, std::size_t kPanels, std::size_t kPerPanel>
HWY_NOINLINE void RunTile(const TileCall& t) {
  ComputeTile<kBroadcast, kM, kPanels, kPerPanel>(t);
}

/// One panel, as many whole tiles as `rows` has; returns the rows that are left, at which `t` stands then.
template <Broadcast kBroadcast, std::size_t kPerPanel>
HWY_NOINLINE std::int64_t RunWholeTiles(std::int64_t rows, TileCall* t) {
  for (; rows >= kTileRows; rows -= kTileRows) {
    ComputeTile<kBroadcast, kTileRows, 1, kPerPanel>(*t);
    MoveOn<kBroadcast>(kTileRows, t);
  }
  return rows;
}

/// Runs tile.Run<rows>() for 1 <= rows <= kMost.
template <std::size_t kMost, class Tile>
HWY_INLINE void RunWithRows(std::int64_t rows, const Tile& tile) {
  if (rows == static_cast<std::int64_t>(kMost)) {
    tile.template Run<kMost>();
  } else if constexpr (kMost > 1) {
    RunWithRows<kMost - 1>(rows, tile);
  }
}

/// The rows of a panel that are less than a whole tile.
template <Broadcast kBroadcast, std::size_t kPerPanel>
struct PartTile {
  const TileCall& call;
  template <std::size_t kM>
  HWY_INLINE void Run() const {
    RunTile<kBroadcast, kM, 1, kPerPanel>(call);
  }
};

/// One panel, however many rows. `t` is used up.
template <Broadcast kBroadcast, std::size_t kPerPanel>
HWY_INLINE void RunPanel(std::int64_t rows, TileCall* t) {
  if (rows >= kTileRows) rows = RunWholeTiles<kBroadcast, kPerPanel>(rows, t);
  RunWithRows<kTileRows - 1>(rows, PartTile<kBroadcast, kPerPanel>{*t});
}

// K of a panel that stays in registers: 4 x 2 vectors of B, 2 to start from, 2 sums and A are 13 of 16.
inline constexpr std::int64_t kFewInputs = 4;

/// A panel of few inputs, which stays in registers while one row after the other goes by: as many rows as there are.
template <std::size_t kPerPanel, std::size_t... K>
HWY_NOINLINE void RunFewInputs(std::int64_t rows, const TileCall& t, std::index_sequence<K...>) {
  constexpr auto kAll = std::make_index_sequence<kPerPanel>();
  FloatVector b[sizeof...(K)][kPerPanel], start[kPerPanel];
  (LoadVectors<kPerPanel>(t.b + static_cast<std::int64_t>(K) * t.b_stride, 0, b[K], kAll), ...);
  ZeroVectors(start, kAll);
  if (t.start != nullptr) LoadVectors<kPerPanel>(t.start, 0, start, kAll);
  const float *a = t.a, *rectified = t.rectified;
  float* c = t.c;
  for (; rows > 0; --rows, a += t.a_stride, c += t.c_stride) {
    FloatVector sums[kPerPanel];
    for (std::size_t n = 0; n < kPerPanel; ++n) sums[n] = start[n];
    (MultiplyAddRow(hn::Set(Floats(), a[K]), b[K], sums, kAll), ...);
    if (t.rectify) RectifyVectors(sums, kAll);
    if (rectified != nullptr) {
      MultiplyRowByRectified<kPerPanel>(rectified, t.columns, sums);
      rectified += t.rectified_stride;
    }
    StoreVectors(sums, c, kAll);
  }
}

template <std::size_t kPerPanel>
HWY_INLINE void RunFewInputsPanel(std::int64_t rows, const TileCall& t) {
  switch (t.k_count) {
    case 1:
      return RunFewInputs<kPerPanel>(rows, t, std::make_index_sequence<1>());
    case 2:
      return RunFewInputs<kPerPanel>(rows, t, std::make_index_sequence<2>());
    case 3:
      return RunFewInputs<kPerPanel>(rows, t, std::make_index_sequence<3>());
    default:
      return RunFewInputs<kPerPanel>(rows, t, std::make_index_sequence<kFewInputs>());
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
  bool rectify = false;              // max(0, C) is stored
  const float* rectified = nullptr;  // [m, n] as TileCall's
  std::int64_t rectified_stride = 0;
};

/// Vectors of the panel that begins at column `first` of `columns`.
HWY_INLINE std::int64_t PanelVectors(std::int64_t first, std::int64_t columns) {
  return columns - first > LaneCount() ? 2 : 1;
}

/// Panels that one or two rows take together, so that enough sums run side by side; 1: each alone.
HWY_INLINE std::int64_t WidePanels(std::int64_t rows, std::int64_t full_panels) {
  if (rows == 1 && full_panels >= 4) return 4;
  return full_panels >= 2 ? 2 : 1;
}
template <Broadcast kBroadcast>
HWY_INLINE void WideTile(std::int64_t rows, std::int64_t panels, const TileCall& t) {
  if (panels == 4) return RunTile<kBroadcast, 1, 4, kPanelVectors>(t);
  if (rows == 1) return RunTile<kBroadcast, 1, 2, kPanelVectors>(t);
  RunTile<kBroadcast, 2, 2, kPanelVectors>(t);
}

template <Broadcast kBroadcast>
HWY_INLINE void Product(const ProductCall& p) {
  const std::int64_t lanes = LaneCount();
  const std::int64_t width = static_cast<std::int64_t>(kPanelVectors) * lanes;
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
               p.columns - n < vectors * lanes ? p.columns - n : vectors * lanes,
               p.rectify,
               p.rectified == nullptr ? nullptr : p.rectified + n,
               p.rectified_stride};
    if (p.rows == 1 || p.rows == 2) {
      const std::int64_t full_panels = (p.columns - n) / width, panels = WidePanels(p.rows, full_panels);
      if (panels > 1) {
        t.columns = panels * width;
        WideTile<kBroadcast>(p.rows, panels, t);
        n += panels * width;
        continue;
      }
    }
    if (kBroadcast == Broadcast::kAlongK && p.k_count <= kFewInputs && p.start_stride == 0 &&
        t.columns == vectors * lanes) {
      if (vectors == 2) RunFewInputsPanel<2>(p.rows, t);
      if (vectors == 1) RunFewInputsPanel<1>(p.rows, t);
      n += vectors * lanes;
      continue;
    }
    if (vectors == 2) RunPanel<kBroadcast, 2>(p.rows, &t);
    if (vectors == 1) RunPanel<kBroadcast, 1>(p.rows, &t);
    n += vectors * lanes;
  }
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
