// The kernels against float64 arithmetic, at sizes that fit no vector.
#include "consac/nn/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "consac/nn/aligned.h"
#include "core/test/nn/reference_activation.h"

namespace consac::nn {
namespace {

std::vector<float> Sweep(float low, float high, int count) {
  std::vector<float> values;
  for (int i = 0; i <= count; ++i)
    values.push_back(low + (high - low) * static_cast<float>(i) / static_cast<float>(count));
  return values;
}

/// Runs `body` with each instruction set of this machine, then goes back to the best.
template <class Body>
void OnEveryInstructionSet(Body body) {
  for (const std::string_view name : InstructionSets()) {
    ASSERT_TRUE(UseInstructionSet(name));
    ASSERT_EQ(InstructionSet(), name);
    SCOPED_TRACE(name);
    body();
  }
  ASSERT_TRUE(UseInstructionSet(InstructionSets().front()));
}

double WorstRelative(std::span<const float> x, std::span<const float> y, double (*reference)(double)) {
  double worst = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double want = reference(static_cast<double>(x[i]));
    if (want != 0.0) worst = std::max(worst, std::abs(static_cast<double>(y[i]) / want - 1.0));
  }
  return worst;
}

TEST(Elementary, TanhKeepsRelativeAccuracyOverTheWholeRange) {
  OnEveryInstructionSet([] {
    std::vector<float> x = Sweep(-12.0f, 12.0f, 1200001);
    for (float small_value = 1e-30f; small_value < 1.0f; small_value *= 1.01f) x.push_back(small_value);
    std::vector<float> y(x.size());
    Tanh(x, y);
    EXPECT_LT(WorstRelative(x, y, [](double v) { return std::tanh(v); }), 3.5e-7);
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LE(std::abs(y[i]), 1.0f);
  });
}

TEST(Elementary, ExpIsWithinTwoUnitsOverTheWholeRange) {
  OnEveryInstructionSet([] {
    const std::vector<float> x = Sweep(-87.3f, 88.7f, 1000001);
    std::vector<float> y(x.size());
    Exp(x, y);
    EXPECT_LT(WorstRelative(x, y, [](double v) { return std::exp(v); }), 2.0e-7);
  });
}

TEST(Elementary, SigmoidKeepsRelativeAccuracyFarOut) {
  OnEveryInstructionSet([] {
    const std::vector<float> x = Sweep(-80.0f, 80.0f, 1000001);
    std::vector<float> y(x.size());
    Sigmoid(x, y);
    EXPECT_LT(WorstRelative(x, y, [](double v) { return 1.0 / (1.0 + std::exp(-v)); }), 3.0e-7);
  });
}

TEST(Elementary, EndsOfTheRange) {
  OnEveryInstructionSet([] {
    const float inf = std::numeric_limits<float>::infinity();
    const std::vector<float> x = {inf, -inf, 0.0f, std::numeric_limits<float>::quiet_NaN(), 200.0f, -200.0f};
    std::vector<float> t(6), e(6), s(6);
    Tanh(x, t);
    Exp(x, e);
    Sigmoid(x, s);
    EXPECT_EQ(t[0], 1.0f);
    EXPECT_EQ(t[1], -1.0f);
    EXPECT_EQ(t[2], 0.0f);
    EXPECT_EQ(e[0], inf);
    EXPECT_EQ(e[1], 0.0f);
    EXPECT_EQ(e[2], 1.0f);
    EXPECT_EQ(e[4], inf);
    EXPECT_EQ(e[5], 0.0f);
    EXPECT_EQ(s[0], 1.0f);
    EXPECT_EQ(s[1], 0.0f);
    EXPECT_EQ(s[2], 0.5f);
    for (const auto* y : {&t, &e, &s}) EXPECT_TRUE(std::isnan((*y)[3]));
  });
}

class EachActivation : public testing::TestWithParam<Activation> {};

TEST_P(EachActivation, MatchesItsFormula) {
  OnEveryInstructionSet([] {
    const Activation activation = GetParam();
    const std::vector<float> x = Sweep(-20.0f, 20.0f, 40003);
    std::vector<float> y(x.size());
    const auto count = static_cast<std::int64_t>(x.size());
    Activate(activation, 1, count, {x.data(), count}, {y.data(), count});
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double want = ReferenceActivation(activation, static_cast<double>(x[i]));
      ASSERT_NEAR(y[i], want, 4e-7 * std::abs(want) + 1e-12) << "x = " << x[i];
    }
  });
}

TEST_P(EachActivation, DerivativeMatchesDifferences) {
  OnEveryInstructionSet([] {
    const Activation activation = GetParam();
    const std::vector<float> x = Sweep(-9.03f, 9.01f, 301);
    std::vector<float> y(x.size()), d(x.size(), 2.0f);
    const auto count = static_cast<std::int64_t>(x.size());
    Activate(activation, 1, count, {x.data(), count}, {y.data(), count});
    MultiplyByDerivative(activation, 1, count, {NeedsPreActivation(activation) ? x.data() : y.data(), count},
                         {d.data(), count});
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double at = static_cast<double>(x[i]);
      const double slope =
          (ReferenceActivation(activation, at + 1e-6) - ReferenceActivation(activation, at - 1e-6)) / 2e-6;
      ASSERT_NEAR(d[i], 2.0 * slope, 2e-6) << "x = " << x[i];
    }
  });
}

INSTANTIATE_TEST_SUITE_P(All, EachActivation,
                         testing::Values(Activation::kLinear, Activation::kTanh, Activation::kRelu,
                                         Activation::kSigmoid, Activation::kElu, Activation::kLeakyRelu,
                                         Activation::kSilu, Activation::kSoftplus),
                         [](const auto& activation) { return std::string(NameOf(activation.param)); });

/// Random operands of one dense layer.
struct DenseCase {
  DenseCase(std::int64_t row_count, std::int64_t in_count, std::int64_t out_count)
      : rows(row_count),
        in(in_count),
        out(out_count),
        w(in * out),
        b(out),
        x(rows * in),
        y(rows * out),
        dz(rows * out),
        dx(rows * in),
        dw(in * out),
        db(out) {
    Rng rng(7, StreamId("dense_case"));
    for (AlignedFloats* buffer : {&w, &b, &x, &dz}) {
      for (float& value : buffer->span()) value = rng.Normal();
    }
  }
  DenseShape shape() const { return {rows, in, out}; }
  std::int64_t rows, in, out;
  AlignedFloats w, b, x, y, dz, dx, dw, db;
};

/// Each test goes through every instruction set that this machine has, and many rows and inputs at one number of
/// outputs.
class DenseSizes : public testing::TestWithParam<std::int64_t> {
 protected:
  template <class Body>
  void ForEachCase(Body body) const {
    OnEveryInstructionSet([&] {
      for (const std::int64_t rows : {0, 1, 2, 3, 17, 64}) {
        for (const std::int64_t in : {1, 2, 3, 4, 5, 16, 17, 24, 64, 100, 300}) {
          SCOPED_TRACE(std::to_string(rows) + " rows, " + std::to_string(in) + " inputs");
          DenseCase dense_case(rows, in, GetParam());
          body(dense_case);
        }
      }
    });
  }
};

void ExpectForward(DenseCase& c) {
  AlignedFloats packed(PackedDenseSize(c.in, c.out));
  PackDense(c.w.data(), c.b.data(), c.in, c.out, packed.data());
  DenseForward({c.in, c.out, Activation::kLinear},
               {packed.data(), c.rows, {c.x.data(), c.in}, {c.y.data(), c.out}, {}});
  for (std::int64_t r = 0; r < c.rows; ++r) {
    for (std::int64_t o = 0; o < c.out; ++o) {
      double want = c.b.data()[o];
      for (std::int64_t i = 0; i < c.in; ++i)
        want += static_cast<double>(c.x.data()[r * c.in + i]) * c.w.data()[o * c.in + i];
      ASSERT_NEAR(c.y.data()[r * c.out + o], want, 1e-6 * static_cast<double>(c.in + 4)) << r << " " << o;
    }
  }
  for (std::int64_t i = 0; i < kSlack; ++i) ASSERT_EQ(c.y.data()[c.rows * c.out + i], 0.0f) << "written past the end";
}

TEST_P(DenseSizes, ForwardMatchesFloat64) {
  ForEachCase(ExpectForward);
}

void ExpectRowsAlone(DenseCase& c) {
  AlignedFloats packed(PackedDenseSize(c.in, c.out));
  PackDense(c.w.data(), c.b.data(), c.in, c.out, packed.data());
  DenseForward({c.in, c.out, Activation::kTanh}, {packed.data(), c.rows, {c.x.data(), c.in}, {c.y.data(), c.out}, {}});
  for (std::int64_t first = 0; first < c.rows; ++first) {
    for (std::int64_t rows = 1; rows <= 9 && first + rows <= c.rows; ++rows) {
      AlignedFloats alone(rows * c.out);
      DenseForward({c.in, c.out, Activation::kTanh},
                   {packed.data(), rows, {c.x.data() + first * c.in, c.in}, {alone.data(), c.out}, {}});
      ASSERT_EQ(
          std::memcmp(alone.data(), c.y.data() + first * c.out, static_cast<std::size_t>(rows * c.out) * sizeof(float)),
          0)
          << rows << " rows from " << first;
    }
  }
}

TEST_P(DenseSizes, OneRowGivesTheSameBitsAsMany) {
  ForEachCase(ExpectRowsAlone);
}

// Without z, relu is applied where the sums are stored.
void ExpectRectified(DenseCase& c) {
  AlignedFloats packed(PackedDenseSize(c.in, c.out)), z(c.rows * c.out), at_once(c.rows * c.out);
  const std::size_t bytes = static_cast<std::size_t>(c.rows * c.out) * sizeof(float);
  PackDense(c.w.data(), c.b.data(), c.in, c.out, packed.data());
  const DenseLayer layer{c.in, c.out, Activation::kRelu};
  DenseForward(layer, {packed.data(), c.rows, {c.x.data(), c.in}, {c.y.data(), c.out}, {z.data(), c.out}});
  DenseForward(layer, {packed.data(), c.rows, {c.x.data(), c.in}, {at_once.data(), c.out}, {}});
  ASSERT_EQ(std::memcmp(at_once.data(), c.y.data(), bytes), 0);
  for (std::int64_t i = 0; i < c.rows * c.out; ++i) ASSERT_EQ(c.y.data()[i], std::max(z.data()[i], 0.0f)) << i;
  if (c.rows == 0) return;
  c.x.data()[0] = std::numeric_limits<float>::quiet_NaN();
  DenseForward(layer, {packed.data(), c.rows, {c.x.data(), c.in}, {at_once.data(), c.out}, {}});
  for (std::int64_t o = 0; o < c.out; ++o) ASSERT_TRUE(std::isnan(at_once.data()[o])) << o;
  const std::int64_t others = c.rows - 1;
  ASSERT_EQ(
      std::memcmp(at_once.data() + c.out, c.y.data() + c.out, static_cast<std::size_t>(others * c.out) * sizeof(float)),
      0);
}

TEST_P(DenseSizes, ReluIsTheSameAtOnceAndAfterwards) {
  ForEachCase(ExpectRectified);
}

void ExpectInputGradient(DenseCase& c) {
  AlignedFloats packed(PackedDenseBackwardSize(c.in, c.out));
  PackDenseBackward(c.w.data(), c.in, c.out, packed.data());
  DenseInputGradientCall call{c.shape(), packed.data(), {c.dz.data(), c.out}, {c.dx.data(), c.in}, Store::kOverwrite};
  DenseInputGradient(call);
  call.store = Store::kAdd;
  DenseInputGradient(call);
  for (std::int64_t r = 0; r < c.rows; ++r) {
    for (std::int64_t i = 0; i < c.in; ++i) {
      double want = 0.0;
      for (std::int64_t o = 0; o < c.out; ++o)
        want += static_cast<double>(c.dz.data()[r * c.out + o]) * c.w.data()[o * c.in + i];
      ASSERT_NEAR(c.dx.data()[r * c.in + i], 2.0 * want, 2e-6 * static_cast<double>(c.out + 4));
    }
  }
  AlignedFloats afterwards(c.rows * c.in), at_once(c.rows * c.in);
  call.store = Store::kOverwrite;
  call.dx = {afterwards.data(), c.in};
  DenseInputGradient(call);
  MultiplyByDerivative(Activation::kRelu, c.rows, c.in, {c.x.data(), c.in}, {afterwards.data(), c.in});
  call.dx = {at_once.data(), c.in};
  call.rectified = {c.x.data(), c.in};
  DenseInputGradient(call);
  ASSERT_EQ(std::memcmp(at_once.data(), afterwards.data(), static_cast<std::size_t>(c.rows * c.in) * sizeof(float)), 0);
}

TEST_P(DenseSizes, InputGradientMatchesFloat64AndAdds) {
  ForEachCase(ExpectInputGradient);
}

void ExpectWeightGradient(DenseCase& c) {
  DenseWeightGradientCall call{c.shape(),   {c.x.data(), c.in}, {c.dz.data(), c.out},
                               c.dw.data(), c.db.data(),        Store::kOverwrite};
  DenseWeightGradient(call);
  call.store = Store::kAdd;
  DenseWeightGradient(call);
  const double tolerance = 2e-6 * static_cast<double>(c.rows + 4);
  for (std::int64_t o = 0; o < c.out; ++o) {
    double bias = 0.0;
    for (std::int64_t r = 0; r < c.rows; ++r) bias += c.dz.data()[r * c.out + o];
    ASSERT_NEAR(c.db.data()[o], 2.0 * bias, tolerance);
    for (std::int64_t i = 0; i < c.in; ++i) {
      double want = 0.0;
      for (std::int64_t r = 0; r < c.rows; ++r)
        want += static_cast<double>(c.dz.data()[r * c.out + o]) * c.x.data()[r * c.in + i];
      ASSERT_NEAR(c.dw.data()[o * c.in + i], 2.0 * want, tolerance);
    }
  }
  for (std::int64_t i = 0; i < kSlack; ++i) ASSERT_EQ(c.dw.data()[c.in * c.out + i], 0.0f) << "written past the end";
}

TEST_P(DenseSizes, WeightGradientMatchesFloat64AndAdds) {
  ForEachCase(ExpectWeightGradient);
}

INSTANTIATE_TEST_SUITE_P(Odd, DenseSizes, testing::Values(1, 2, 3, 4, 5, 17, 24, 37, 48, 64, 100, 256));

TEST(Sums, SquaresAreFloat64) {
  OnEveryInstructionSet([] {
    std::vector<float> values(1003, 1e-4f);
    values[500] = 1e4f;
    double want = 0.0;
    for (const float value : values) want += static_cast<double>(value) * static_cast<double>(value);
    EXPECT_NEAR(SumOfSquares(values), want, 1e-12 * want);
    EXPECT_EQ(SumOfSquares({}), 0.0);
  });
}

TEST(Sums, AddTo) {
  std::vector<float> a(37, 1.0f), b(37, 2.5f);
  AddTo(a, b);
  for (const float value : b) EXPECT_EQ(value, 3.5f);
}

TEST(Machine, NamesItsInstructionSetAndMeasuresIt) {
  EXPECT_FALSE(InstructionSet().empty());
  EXPECT_GE(VectorLanes(), 1);
  EXPECT_GT(MeasurePeakFlops(0.01), 1e8);
  EXPECT_EQ(InstructionSet(), InstructionSets().front());
  EXPECT_FALSE(UseInstructionSet("MMX"));
}

TEST(Polyak, MixesAndCopies) {
  for (const std::size_t count : {1u, 7u, 16u, 100u}) {
    std::vector<float> from(count), to(count);
    for (std::size_t i = 0; i < count; ++i) {
      from[i] = static_cast<float>(i) - 3.5f;
      to[i] = 1.0f / (static_cast<float>(i) + 1.0f);
    }
    const std::vector<float> before = to;
    Polyak(0.005f, from, to);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_NEAR(to[i], 0.995 * static_cast<double>(before[i]) + 0.005 * static_cast<double>(from[i]), 1e-6);
    }
    to[0] = std::numeric_limits<float>::infinity();
    Polyak(1.0f, from, to);
    EXPECT_EQ(to, from);
  }
}

// The divisor of every image, and others; all mantissas, magnitudes from the smallest to the largest, and what is none.
TEST(Divide, IsTheNearestFloatOnEveryInstructionSet) {
  std::vector<float> numbers, shares;
  for (std::uint32_t bits = 0; bits < 1u << 23; bits += 3) numbers.push_back(std::bit_cast<float>(0x3f800000u | bits));
  for (std::uint32_t bits = 1; bits != 0 && bits < 0xffff0000u; bits += 0x3fff5u)
    numbers.push_back(std::bit_cast<float>(bits));
  for (int byte = 0; byte < 256; ++byte) numbers.push_back(static_cast<float>(byte));
  numbers.insert(numbers.end(), {-0.0f, 0.0f, std::numeric_limits<float>::infinity(), std::nanf("")});
  shares.resize(numbers.size());
  OnEveryInstructionSet([&] {
    for (const float divisor : {255.0f, 3.0f, 0.1f, 1.9999999f, 7e-30f, 3e38f}) {
      Divide(divisor, numbers, shares);
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        const float want = numbers[i] / divisor;
        if (std::memcmp(&want, &shares[i], sizeof want) != 0 && !(std::isnan(want) && std::isnan(shares[i]))) ++wrong;
      }
      EXPECT_EQ(wrong, 0u) << "divided by " << divisor;
    }
  });
}

}  // namespace
}  // namespace consac::nn
