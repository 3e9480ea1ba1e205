// Each kernel of a PPO update alone, at the sizes of that update: where the time goes.

#include "bench/peak.h"
#include "bench/ppo_update_net.h"
#include "consac/nn/aligned.h"

namespace consac::bench {
namespace {

void PrintKernel(const char* what, const nn::DenseShape& s, double seconds, double flops, double peak) {
  std::printf("%-16s %5lld x %4lld x %4lld %10.3f us %8.1f GFLOP/s %7.1f %%\n", what, static_cast<long long>(s.rows),
              static_cast<long long>(s.in_size), static_cast<long long>(s.out_size), seconds * 1e6,
              flops / seconds * 1e-9, 100.0 * flops / seconds / peak);
}

void TimeDense(std::int64_t in, std::int64_t out, double peak) {
  const nn::DenseShape shape{64, in, out};
  const std::int64_t x_stride = in < 16 ? in : (in % 256 == 0 ? in + 16 : in);
  const std::int64_t y_stride = out < 16 ? out : (out % 256 == 0 ? out + 16 : out);
  nn::AlignedFloats w(in * out), b(out), x(64 * x_stride), y(64 * y_stride), dx(64 * x_stride), dw(in * out), db(out);
  nn::AlignedFloats forward(nn::PackedDenseSize(in, out)), backward(nn::PackedDenseBackwardSize(in, out));
  Rng rng(4);
  for (nn::AlignedFloats* buffer : {&w, &x, &y}) {
    for (float& value : buffer->span()) value = 0.1f * rng.Normal();
  }
  const double flops = 2.0 * 64.0 * static_cast<double>(in * out);
  PrintKernel("pack forward", shape, BestSeconds([&] { nn::PackDense(w.data(), b.data(), in, out, forward.data()); }),
              0, peak);
  PrintKernel("pack backward", shape, BestSeconds([&] { nn::PackDenseBackward(w.data(), in, out, backward.data()); }),
              0, peak);
  const nn::DenseLayer layer{in, out, nn::Activation::kLinear};
  const nn::ForwardCall call{forward.data(), 64, {x.data(), x_stride}, {y.data(), y_stride}, {}};
  PrintKernel("forward", shape, BestSeconds([&] { nn::DenseForward(layer, call); }), flops, peak);
  const nn::DenseInputGradientCall dx_call{
      shape, backward.data(), {y.data(), y_stride}, {dx.data(), x_stride}, nn::Store::kOverwrite};
  PrintKernel("input gradient", shape, BestSeconds([&] { nn::DenseInputGradient(dx_call); }), flops, peak);
  const nn::DenseWeightGradientCall dw_call{shape,     {x.data(), x_stride}, {y.data(), y_stride}, dw.data(),
                                            db.data(), nn::Store::kOverwrite};
  PrintKernel("weight gradient", shape, BestSeconds([&] { nn::DenseWeightGradient(dw_call); }), flops, peak);
}

void TimeElements() {
  constexpr std::int64_t kCount = 4096;
  nn::AlignedFloats x(kCount), y(kCount);
  Rng rng(4);
  for (float& value : x.span()) value = rng.Normal();
  const auto print = [](const char* what, double seconds) {
    std::printf("%-24s %8.3f us for 64 x 64, %.3f ns each\n", what, seconds * 1e6, seconds * 1e9 / kCount);
  };
  print("tanh", BestSeconds([&] { nn::Tanh(x.span(), y.span()); }));
  print("exp", BestSeconds([&] { nn::Exp(x.span(), y.span()); }));
  print("tanh derivative", BestSeconds([&] {
          nn::MultiplyByDerivative(nn::Activation::kTanh, 64, 64, {x.data(), 64}, {y.data(), 64});
        }));
}

void TimeOptimiser() {
  constexpr std::int64_t kCount = 9155;
  std::vector<float> p(kCount, 1.0f), g(kCount, 0.1f);
  learn::Adam adam(kCount, {});
  std::printf("%-24s %8.3f us for %lld parameters\n", "Adam", 1e6 * BestSeconds([&] { adam.Step(p, g, 1e-4f, 1.0f); }),
              static_cast<long long>(kCount));
  volatile double sink = 0.0;
  std::printf("%-24s %8.3f us for %lld parameters\n", "global norm",
              1e6 * BestSeconds([&] { sink = learn::GlobalNorm(g); }), static_cast<long long>(kCount));
  static_cast<void>(sink);
}

}  // namespace
}  // namespace consac::bench

int main(int argc, char** argv) {
  using namespace consac::bench;
  const double peak = PrintMachine(argc, argv);
  TimeDense(64, 64, peak);
  TimeDense(4, 64, peak);
  TimeDense(64, 2, peak);
  TimeDense(64, 1, peak);
  TimeDense(256, 256, peak);
  TimeElements();
  TimeOptimiser();
  PpoMinibatch minibatch(64);
  std::vector<float> observations(256), pi(128), vf(64), d_pi(128), d_vf(64);
  float* inputs[] = {observations.data()};
  const float* outputs[] = {pi.data(), vf.data()};
  float* gradients[] = {d_pi.data(), d_vf.data()};
  const consac::learn::LossBlock block{0, 0, 64, inputs, outputs, gradients, {}};
  std::printf("%-24s %8.3f us for 64 rows\n", "loss of this bench", 1e6 * BestSeconds([&] { minibatch.Loss(block); }));
}
