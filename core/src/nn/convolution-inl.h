// Convolutions over images whose channels come last, read where they lie: a tile takes the same lines of several
// patches, so nothing is copied. Sums run over a patch (forward) or over the pixels (weight gradient) in order, as in
// the dense kernels over copied patches: the same bits. Included once per instruction set by kernels.cpp.

#if defined(CONSAC_NN_CONVOLUTION_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CONSAC_NN_CONVOLUTION_INL_H_
#undef CONSAC_NN_CONVOLUTION_INL_H_
#else
#define CONSAC_NN_CONVOLUTION_INL_H_
#endif

#include "consac/nn/kernels.h"
#include "hwy/highway.h"
#include "nn/activation-inl.h"
#include "nn/dense-inl.h"
#include "nn/gemm-inl.h"

HWY_BEFORE_NAMESPACE();
namespace consac::nn::HWY_NAMESPACE {

/// Up to kTileRows patches times one panel of W^T.
template <std::size_t kVectors>
struct PatchTile {
  const PatchGrid& grid;
  const float* patches[kTileRows];  // first number of each
  float* to[kTileRows];             // where its results go
  const float* b;                   // the panel
  const float* bias;                // [vectors]
  std::int64_t columns;             // valid ones

  template <std::size_t... M>
  HWY_INLINE void MultiplyAdd(const float* const* from, std::int64_t at, const FloatVector* row,
                              FloatVector (*sums)[kVectors], std::index_sequence<M...>) const {
    (MultiplyAddRow(hn::Set(Floats(), from[M][at]), row, sums[M], std::make_index_sequence<kVectors>()), ...);
  }
  template <std::size_t... M>
  HWY_INLINE void Start(const float** from, FloatVector (*sums)[kVectors], std::index_sequence<M...>) const {
    ((from[M] = patches[M]), ...);
    (LoadVectors<kVectors>(bias, 0, sums[M], std::make_index_sequence<kVectors>()), ...);
  }
  template <std::size_t... M>
  HWY_INLINE void Finish(const FloatVector (*sums)[kVectors], std::index_sequence<M...>) const {
    if (columns == static_cast<std::int64_t>(kVectors) * LaneCount()) {
      (StoreVectors(sums[M], to[M], std::make_index_sequence<kVectors>()), ...);
    } else {
      (StorePartRow<kVectors>(sums[M], columns, to[M]), ...);
    }
  }
  template <std::size_t kM>
  HWY_NOINLINE void Run() const {
    constexpr auto kRows = std::make_index_sequence<kM>();
    constexpr auto kAll = std::make_index_sequence<kVectors>();
    FloatVector sums[kM][kVectors];
    const float* from[kM];
    Start(from, sums, kRows);
    const float* panel = b;
    std::int64_t at = 0;
    for (std::int64_t line = grid.lines; line > 0; --line) {
      for (const std::int64_t end = at + grid.run; at < end; ++at) {
        FloatVector row[kVectors];
        LoadVectors<kVectors>(panel, 0, row, kAll);
        MultiplyAdd(from, at, row, sums, kRows);
        panel += static_cast<std::int64_t>(kVectors) * LaneCount();
      }
      at += grid.line_step - grid.run;
    }
    Finish(sums, kRows);
  }
};

inline constexpr std::int64_t kImagesTogether = 4;  // so that few tiles are narrow, and results still in cache

/// One panel of all pixels of `images` images.
template <std::size_t kVectors>
HWY_INLINE void ConvolvePanel(const ConvolutionCall& call, std::int64_t first, std::int64_t images, Rows to,
                              std::int64_t n) {
  const DenseLayout layout(call.layer.in_size, call.layer.out_size);
  const PatchGrid& grid = call.grid;
  const std::int64_t pixels = grid.rows * grid.columns, width = static_cast<std::int64_t>(kVectors) * LaneCount();
  PatchTile<kVectors> tile{grid,
                           {},
                           {},
                           call.packed + layout.panels_at + n * call.layer.in_size,
                           call.packed + n,
                           width < call.layer.out_size - n ? width : call.layer.out_size - n};
  std::int64_t image = first, row = 0, column = 0;
  for (std::int64_t left = images * pixels; left > 0;) {
    const std::int64_t count = left < kTileRows ? left : kTileRows;
    for (std::int64_t m = 0; m < count; ++m) {
      tile.patches[m] = call.images.data + image * call.images.stride + row * grid.row_step + column * grid.column_step;
      tile.to[m] = to.data + image * to.stride + (row * grid.columns + column) * call.layer.out_size + n;
      if (++column < grid.columns) continue;
      column = 0;
      if (++row < grid.rows) continue;
      row = 0;
      ++image;
    }
    RunWithRows<kTileRows>(count, tile);
    left -= count;
  }
}

void ConvolveRows(const ConvolutionCall& call) {
  const Rows to = call.z.data != nullptr ? call.z : call.y;
  const std::int64_t size = call.grid.rows * call.grid.columns * call.layer.out_size;
  for (std::int64_t first = 0; first < call.rows; first += kImagesTogether) {
    const std::int64_t images = call.rows - first < kImagesTogether ? call.rows - first : kImagesTogether;
    for (std::int64_t n = 0; n < call.layer.out_size;) {
      const std::int64_t vectors = PanelVectors(n, call.layer.out_size);
      if (vectors == 2) ConvolvePanel<2>(call, first, images, to, n);
      if (vectors == 1) ConvolvePanel<1>(call, first, images, to, n);
      n += vectors * LaneCount();
    }
    ActivateRows(call.layer.activation, images, size, {to.data + first * to.stride, to.stride},
                 {call.y.data + first * call.y.stride, call.y.stride});
  }
}

bool ConvolvesFilters(std::int64_t filters) {
  return TailOutputs(filters) == 0;
}

/// dw of up to kTileRows filters for a part of one line of the kernel, over the pixels of one image.
template <std::size_t kVectors>
struct PatchGradientTile {
  const PatchGrid& grid;
  const float* dz;         // of the first pixel and filter
  std::int64_t filters;    // from one pixel to the next
  const float* x;          // of the first pixel
  float* dw;               // of the first filter
  std::int64_t dw_stride;  // from one filter to the next
  std::int64_t columns;    // valid ones
  bool add;

  template <std::size_t kM>
  HWY_NOINLINE void Run() const {
    constexpr auto kRows = std::make_index_sequence<kM>();
    const TileCall edges{nullptr, 0, nullptr, 0, 0, 0, add ? dw : nullptr, add ? dw_stride : 0, dw, dw_stride, columns};
    FloatVector sums[kM][kVectors];
    StartTile<kVectors>(edges, sums, kRows);
    const float* a = dz;
    const float* line = x;
    for (std::int64_t r = grid.rows; r > 0; --r, line += grid.row_step) {
      const float* b = line;
      for (std::int64_t c = grid.columns; c > 0; --c) {
        FloatVector row[kVectors];
        LoadVectors<kVectors>(b, 0, row, std::make_index_sequence<kVectors>());
        MultiplyAddTile<Broadcast::kAlongM, kVectors>(a, 0, row, sums, kRows);
        a += filters;
        b += grid.column_step;
      }
    }
    FinishTile<kVectors>(edges, sums, kRows);
  }
};

template <std::size_t kVectors>
HWY_INLINE void PatchGradientPanel(const ConvolutionGradientCall& call, const float* image, const float* dz,
                                   std::int64_t line, std::int64_t n, bool add) {
  const PatchGrid& grid = call.grid;
  const std::int64_t width = static_cast<std::int64_t>(kVectors) * LaneCount(), patch = grid.lines * grid.run;
  for (std::int64_t m = 0; m < call.filters; m += kTileRows) {
    const PatchGradientTile<kVectors> tile{grid,
                                           dz + m,
                                           call.filters,
                                           image + line * grid.line_step + n,
                                           call.dw + m * patch + line * grid.run + n,
                                           patch,
                                           width < grid.run - n ? width : grid.run - n,
                                           add};
    RunWithRows<kTileRows>(call.filters - m < kTileRows ? call.filters - m : kTileRows, tile);
  }
}

void ConvolutionGradientRows(const ConvolutionGradientCall& call) {
  const PatchGrid& grid = call.grid;
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* image = call.images.data + r * call.images.stride;
    const float* dz = call.dz.data + r * call.dz.stride;
    const bool add = r > 0 || call.store == Store::kAdd;
    ColumnSums(grid.rows * grid.columns, call.filters, {dz, call.filters}, add, call.db);
    for (std::int64_t line = 0; line < grid.lines; ++line) {
      for (std::int64_t n = 0; n < grid.run;) {
        const std::int64_t vectors = PanelVectors(n, grid.run);
        if (vectors == 2) PatchGradientPanel<2>(call, image, dz, line, n, add);
        if (vectors == 1) PatchGradientPanel<1>(call, image, dz, line, n, add);
        n += vectors * LaneCount();
      }
    }
  }
}

void AddPatchesRows(const PatchGrid& grid, std::int64_t first, std::int64_t count, ConstRows patches, float* image) {
  const Floats d;
  const std::int64_t lanes = LaneCount();
  for (std::int64_t p = 0; p < count; ++p) {
    const float* from = patches.data + p * patches.stride;
    float* to = image + (first + p) / grid.columns * grid.row_step + (first + p) % grid.columns * grid.column_step;
    for (std::int64_t line = 0; line < grid.lines; ++line, to += grid.line_step, from += grid.run) {
      std::int64_t i = 0;
      for (; i + lanes <= grid.run; i += lanes)
        hn::StoreU(hn::Add(hn::LoadU(d, to + i), hn::LoadU(d, from + i)), d, to + i);
      for (; i < grid.run; ++i) to[i] += from[i];
    }
  }
}

/// x / by, the nearest float: a product with the reciprocal and one correction, where
/// no step of it can leave the normal numbers. Source: Markstein 1990, IBM J. Res. Dev. 34(1), theorem 8.
HWY_INLINE FloatVector Quotient(FloatVector x, FloatVector by, [[maybe_unused]] FloatVector reciprocal) {
#if HWY_NATIVE_FMA
  const Floats d;
  const FloatVector size = hn::Abs(x);
  const auto usual = hn::And(hn::Ge(size, hn::Set(d, 0x1p-60f)), hn::Le(size, hn::Set(d, 0x1p60f)));
  const hn::RebindToUnsigned<Floats> bits;
  const auto zero = hn::RebindMask(d, hn::Eq(hn::BitCast(bits, x), hn::Zero(bits)));  // not -0
  if (hn::AllTrue(d, hn::Or(usual, zero))) {
    const FloatVector quotient = hn::Mul(x, reciprocal);
    return hn::MulAdd(hn::NegMulAdd(quotient, by, x), reciprocal, quotient);
  }
#endif
  return hn::Div(x, by);
}

void DivideRun(float divisor, const float* from, float* to, std::int64_t count) {
  const Floats d;
  const std::int64_t lanes = LaneCount();
  const bool ordinary = divisor > 0x1p-60f && divisor < 0x1p60f;
  const FloatVector by = hn::Set(d, divisor), reciprocal = hn::Set(d, 1.0f / divisor);
  std::int64_t i = 0;
  for (; ordinary && i + lanes <= count; i += lanes)
    hn::StoreU(Quotient(hn::LoadU(d, from + i), by, reciprocal), d, to + i);
  for (; i < count; ++i) to[i] = from[i] / divisor;
}

}  // namespace consac::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
