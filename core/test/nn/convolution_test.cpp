// Convolutions that read patches in place give the bits of dense layers over copied patches, on every instruction set.
#include "consac/nn/convolution.h"

#include <gtest/gtest.h>

#include <string>

#include "consac/nn/aligned.h"

namespace consac::nn {
namespace {

struct ConvolutionSize {
  std::int64_t height, width, channels, kernel, stride, filters, rows;
};
// The nature CNN's layers, narrow and odd ones; rows that fill tiles and that do not.
constexpr ConvolutionSize kConvolutionSizes[] = {
    {84, 84, 4, 8, 4, 32, 2}, {20, 20, 32, 4, 2, 64, 3}, {9, 9, 64, 3, 1, 64, 9}, {36, 36, 1, 8, 4, 32, 5},
    {7, 11, 3, 2, 1, 17, 6},  {5, 5, 6, 3, 2, 6, 1},     {12, 9, 5, 5, 3, 24, 4},
};

AlignedFloats RandomFloats(std::int64_t count, std::uint64_t stream) {
  AlignedFloats floats(count);
  Rng rng(1, stream);
  for (float& value : floats.span()) value = rng.Normal();
  return floats;
}

/// One size on one instruction set: what the blocks call, and the same over copied patches.
class ConvolutionCheck {
 public:
  explicit ConvolutionCheck(const ConvolutionSize& size) : rows_(size.rows) {
    g_.height = size.height;
    g_.width = size.width;
    g_.channels = size.channels;
    g_.kernel_height = g_.kernel_width = size.kernel;
    g_.stride_height = g_.stride_width = size.stride;
    g_.filters = size.filters;
    g_.out_height = (size.height - size.kernel) / size.stride + 1;
    g_.out_width = (size.width - size.kernel) / size.stride + 1;
    image_stride_ = size.height * size.width * size.channels + 16;
    out_stride_ = g_.pixels() * g_.filters + 32;
    images_ = RandomFloats(rows_ * image_stride_, 1);
    dz_ = RandomFloats(rows_ * out_stride_, 2);
    w_ = RandomFloats(g_.patch() * g_.filters, 3);
    b_ = RandomFloats(g_.filters, 4);
    patches_ = AlignedFloats(g_.pixels() * g_.patch_stride());
  }

  void ForwardIsTheSameBits() {
    if (!ConvolvesInPlace(g_.filters)) return;
    AlignedFloats packed(PackedDenseSize(g_.patch(), g_.filters));
    PackDense(w_.data(), b_.data(), g_.patch(), g_.filters, packed.data());
    const DenseLayer layer{g_.patch(), g_.filters, Activation::kSilu};
    AlignedFloats y(rows_ * out_stride_), z(rows_ * out_stride_), expected_y(out_stride_), expected_z(out_stride_);
    Convolve({g_.grid(),
              layer,
              packed.data(),
              rows_,
              {images_.data(), image_stride_},
              {y.data(), out_stride_},
              {z.data(), out_stride_}});
    for (std::int64_t r = 0; r < rows_; ++r) {
      GatherPatches(g_, images_.data() + r * image_stride_, 0, g_.pixels(), patches_.data());
      DenseForward(layer, {packed.data(),
                           g_.pixels(),
                           {patches_.data(), g_.patch_stride()},
                           {expected_y.data(), g_.filters},
                           {expected_z.data(), g_.filters}});
      for (std::int64_t i = 0; i < g_.pixels() * g_.filters; ++i) {
        ASSERT_EQ(z.data()[r * out_stride_ + i], expected_z.data()[i]) << "row " << r << " number " << i;
        ASSERT_EQ(y.data()[r * out_stride_ + i], expected_y.data()[i]) << "row " << r << " number " << i;
      }
      ASSERT_EQ(y.data()[r * out_stride_ + g_.pixels() * g_.filters], 0.0f) << "written past the end";
    }
  }

  void WeightGradientIsTheSameBits(Store store) {
    if (!SumsPatchesInPlace(g_.grid())) return;
    AlignedFloats dw = RandomFloats(w_.count(), 5), db = RandomFloats(b_.count(), 6);
    AlignedFloats expected_w = RandomFloats(w_.count(), 5), expected_b = RandomFloats(b_.count(), 6);
    ConvolutionWeightGradient({g_.grid(),
                               g_.filters,
                               rows_,
                               {images_.data(), image_stride_},
                               {dz_.data(), out_stride_},
                               dw.data(),
                               db.data(),
                               store});
    for (std::int64_t r = 0; r < rows_; ++r) {
      GatherPatches(g_, images_.data() + r * image_stride_, 0, g_.pixels(), patches_.data());
      DenseWeightGradient({{g_.pixels(), g_.patch(), g_.filters},
                           {patches_.data(), g_.patch_stride()},
                           {dz_.data() + r * out_stride_, g_.filters},
                           expected_w.data(),
                           expected_b.data(),
                           r == 0 ? store : Store::kAdd});
    }
    for (std::int64_t i = 0; i < w_.count(); ++i) ASSERT_EQ(dw.data()[i], expected_w.data()[i]) << i;
    for (std::int64_t i = 0; i < b_.count(); ++i) ASSERT_EQ(db.data()[i], expected_b.data()[i]) << i;
  }

  // Every pixel is the sum of what its patches have there, in their order.
  void PatchesAreAddedBack() {
    patches_ = RandomFloats(g_.pixels() * g_.patch_stride(), 7);
    AlignedFloats image(g_.height * g_.width * g_.channels), expected(image.count());
    ScatterPatches(g_, patches_.data(), 0, g_.pixels(), image.data());
    for (std::int64_t p = 0; p < g_.pixels(); ++p) {
      for (std::int64_t k = 0; k < g_.patch(); ++k) {
        const std::int64_t row = p / g_.out_width * g_.stride_height + k / (g_.kernel_width * g_.channels);
        const std::int64_t at = p % g_.out_width * g_.stride_width * g_.channels + k % (g_.kernel_width * g_.channels);
        expected.data()[row * g_.width * g_.channels + at] += patches_.data()[p * g_.patch_stride() + k];
      }
    }
    for (std::int64_t i = 0; i < image.count(); ++i) ASSERT_EQ(image.data()[i], expected.data()[i]) << i;
  }

 private:
  ConvolutionGeometry g_;
  std::int64_t rows_, image_stride_, out_stride_;
  AlignedFloats images_, dz_, w_, b_, patches_;
};

TEST(ConvolutionInPlace, IsTheDenseLayerOverItsPatchesBitForBit) {
  const std::string best(InstructionSet());
  for (const std::string_view set : InstructionSets()) {
    ASSERT_TRUE(UseInstructionSet(set));
    for (const ConvolutionSize& size : kConvolutionSizes) {
      SCOPED_TRACE(std::string(set) + ", " + std::to_string(size.width) + " wide");
      ConvolutionCheck check(size);
      check.ForwardIsTheSameBits();
      check.WeightGradientIsTheSameBits(Store::kOverwrite);
      check.WeightGradientIsTheSameBits(Store::kAdd);
      check.PatchesAreAddedBack();
    }
  }
  ASSERT_TRUE(UseInstructionSet(best));
}

TEST(ConvolutionInPlace, TakesTheFiltersOfTheNatureCnn) {
  EXPECT_TRUE(ConvolvesInPlace(32));
  EXPECT_TRUE(ConvolvesInPlace(64));
  EXPECT_TRUE(SumsPatchesInPlace({.run = 8 * 4}));
}

TEST(Divide, IsDivisionItself) {
  std::vector<float> bytes(256), shares(256);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<float>(i);
  Divide(255.0f, std::span(bytes).first(251), std::span(shares).first(251));
  for (std::size_t i = 0; i < 251; ++i) ASSERT_EQ(shares[i], bytes[i] / 255.0f);
  EXPECT_EQ(shares[251], 0.0f);
}

}  // namespace
}  // namespace consac::nn
