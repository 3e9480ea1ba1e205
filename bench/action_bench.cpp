// One action: the actor of a 64x64 tanh policy, batch 1, no head; then larger batches and a wider actor.

#include "bench/peak.h"
#include "bench/ppo_update_net.h"

namespace consac::bench {
namespace {

void Time(std::int64_t width, std::int64_t rows, double peak) {
  const nn::Network network = PpoUpdate::Towers(width);
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()));
  Rng rng(3);
  network.Initialise(rng, parameters);
  nn::Evaluator evaluator(network, rows);
  evaluator.Load(parameters);
  std::vector<float> observations(static_cast<std::size_t>(rows * 4));
  for (float& value : observations) value = rng.Normal();
  const float* input = observations.data();
  const double actor = BestSeconds([&] { evaluator.ForwardTo(0, {&input, 1}, rows); });
  const double both = BestSeconds([&] { evaluator.Forward({&input, 1}, rows); });
  const double flops = 2.0 * static_cast<double>(rows * (4 * width + width * width + width * 2));
  std::printf("%5lld %6lld %12.3f %14.3f %9.1f %%\n", static_cast<long long>(width), static_cast<long long>(rows),
              actor * 1e6, both * 1e6, 100.0 * flops / actor / peak);
}

}  // namespace
}  // namespace consac::bench

int main(int argc, char** argv) {
  using namespace consac::bench;
  const double peak = PrintMachine(argc, argv);
  std::printf("%5s %6s %12s %14s %11s\n", "width", "rows", "actor us", "actor+critic", "of peak");
  for (const std::int64_t rows : {1, 8, 64, 1000}) Time(64, rows, peak);
  for (const std::int64_t rows : {1, 64}) Time(256, rows, peak);
}
