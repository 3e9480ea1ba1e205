// The nature CNN on 84 x 84 x 4 images, forward alone and with its gradient, in milliseconds and percent of the
// multiply-add peak measured in the same run. bench/compare/cnn_speed.py sets PyTorch beside it.

#include <vector>

#include "bench/peak.h"
#include "consac/learn/grad/backpropagation.h"
#include "consac/nn/net_arch.h"

namespace consac::bench {
namespace {

constexpr std::int64_t kActions = 6;

nn::Network NatureNetwork(const Layout& layout) {
  nn::QNetworkOptions options;
  options.layers = {};
  options.action_count = kActions;
  return *nn::Network::Create(*nn::QNetwork(layout, options, {.extractor = nn::Extractor::kNatureCnn}));
}

/// Images in bytes, as a replay holds them; the loss is the sum of all values.
class Images final : public learn::BlockLoss {
 public:
  explicit Images(const Layout& layout, std::int64_t rows)
      : layout_(layout), bytes_(static_cast<std::size_t>(rows) * layout.row_bytes) {
    Rng rng(1, StreamId("bench"));
    for (std::byte& byte : bytes_) byte = static_cast<std::byte>(rng.Below(256));
  }
  void Encode(std::int64_t first, std::int64_t rows, float* features) const {
    EncodeFeatures(layout_, bytes_.data() + static_cast<std::size_t>(first) * layout_.row_bytes, rows, features);
  }
  void Gather(const learn::LossBlock& block) override { Encode(block.first_row, block.rows, block.inputs[0]); }
  void Loss(const learn::LossBlock& block) override {
    std::fill_n(block.output_gradients[0], block.rows * kActions, 1.0f);
  }

 private:
  const Layout& layout_;
  std::vector<std::byte> bytes_;
};

/// Multiply-adds of one image forward, times two; `first` only those of the first convolution.
double ForwardFlops(const nn::Network& network, bool first) {
  double flops = 0.0;
  for (const nn::PlacedBlock& block : network.blocks()) {
    if (block.parameter_count == 0) continue;
    const double pixels =
        block.op == "convolution" ? static_cast<double>(block.out_shape[0] * block.out_shape[1]) : 1.0;
    const double outputs =
        block.op == "convolution" ? static_cast<double>(block.out_shape[2]) : static_cast<double>(block.out_size);
    flops += 2.0 * pixels * (static_cast<double>(block.parameter_count) - outputs);
    if (first) break;
  }
  return flops;
}

void TimeRows(const Layout& layout, std::int64_t rows, double peak) {
  const nn::Network network = NatureNetwork(layout);
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()));
  Rng rng(2, StreamId("bench"));
  network.Initialise(rng, parameters);
  Images images(layout, rows);
  nn::Evaluator evaluator(network, rows);
  evaluator.Load(parameters);
  learn::Backpropagation backpropagation(network, 0, rows);
  std::vector<float> features(static_cast<std::size_t>(rows * layout.feature_count));
  const RepeatOptions repeat{7, 0.2};
  const double forward = BestSeconds(
      [&] {
        images.Encode(0, rows, features.data());
        const float* input = features.data();
        evaluator.Forward({&input, 1}, rows);
      },
      repeat);
  const double both = BestSeconds([&] { backpropagation.Run(parameters, rows, {}, images); }, repeat);
  // Backward multiplies twice as often as forward, but for the gradient of the images, which nobody wants.
  const double flops = static_cast<double>(rows) * ForwardFlops(network, false);
  const double both_flops = 3.0 * flops - static_cast<double>(rows) * ForwardFlops(network, true);
  std::printf("nature CNN, %lld images: forward %.3f ms (%.0f %% of peak), with gradient %.3f ms (%.0f %% of peak)\n",
              static_cast<long long>(rows), forward * 1e3, 100.0 * flops / forward / peak, both * 1e3,
              100.0 * both_flops / both / peak);
  std::fflush(stdout);
}

}  // namespace
}  // namespace consac::bench

int main(int argc, char** argv) {
  using namespace consac;
  const double peak = bench::PrintMachine(argc, argv);
  const Layout layout = Layout::Of(*Space::Box(0, 255, {84, 84, 4}, DType::kU8));
  for (const std::int64_t rows : {32, 256}) bench::TimeRows(layout, rows, peak);
}
