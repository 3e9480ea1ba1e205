#pragma once
// A loss with a known derivative, and gradients of it against central differences of float64 loops.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "consac/learn/grad/backpropagation.h"
#include "learn/test/grad/reference_network.h"

namespace consac::learn {

/// loss = sum over rows and outputs of (weight y + y^2 / 2), plus the extra parameters' own sum of row counts.
class QuadraticLoss : public BlockLoss {
 public:
  QuadraticLoss(const nn::Network& network, std::int64_t rows, std::uint64_t seed) : network_(network) {
    Rng rng(seed, StreamId("quadratic_loss"));
    for (const nn::Port& input : network.spec().inputs) {
      auto& data = inputs_.emplace_back(static_cast<std::size_t>(rows * input.size));
      for (float& value : data) value = rng.Normal();
    }
  }

  void Gather(const LossBlock& block) override {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const std::int64_t size = network_.spec().inputs[i].size;
      std::memcpy(block.inputs[i], inputs_[i].data() + block.first_row * size,
                  static_cast<std::size_t>(block.rows * size) * sizeof(float));
    }
  }

  void Loss(const LossBlock& block) override {
    for (std::size_t o = 0; o < block.outputs.size(); ++o) {
      for (std::int64_t i = 0; i < block.rows * network_.output_size(o); ++i) {
        block.output_gradients[o][i] = Weight(o) + block.outputs[o][i];
      }
    }
    for (float& value : block.extra_gradient) value += static_cast<float>(block.rows);
  }

  double InFloat64(const std::vector<double>& parameters, std::int64_t rows) const {
    double loss = 0.0;
    for (std::int64_t r = 0; r < rows; ++r) {
      std::vector<std::vector<double>> row;
      for (std::size_t i = 0; i < inputs_.size(); ++i) {
        const std::int64_t size = network_.spec().inputs[i].size;
        row.emplace_back(inputs_[i].begin() + r * size, inputs_[i].begin() + (r + 1) * size);
      }
      const auto outputs = ReferenceForward(network_, parameters, row);
      for (std::size_t o = 0; o < outputs.size(); ++o) {
        for (const double y : outputs[o]) loss += static_cast<double>(Weight(o)) * y + 0.5 * y * y;
      }
    }
    return loss;
  }

 protected:
  static float Weight(std::size_t output) { return 0.7f - 0.4f * static_cast<float>(output); }

  const nn::Network& network_;
  std::vector<std::vector<float>> inputs_;
};

inline nn::Network MustCreate(nn::NetworkSpec spec) {
  Result<nn::Network> network = nn::Network::Create(std::move(spec));
  EXPECT_TRUE(network.ok()) << network.status().message();
  return *std::move(network);
}

inline std::vector<float> RandomParameters(const nn::Network& network, std::int64_t extra) {
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count() + extra));
  Rng rng(21, StreamId("parameters"));
  network.Initialise(rng, std::span(parameters).first(static_cast<std::size_t>(network.parameter_count())));
  for (float& value : parameters) value += 0.05f * rng.Normal();
  return parameters;
}

/// Relative L2 distance between Run's gradient and central differences over at most `samples` parameters.
inline void ExpectGradient(const nn::Network& network, std::int64_t rows, int samples) {
  QuadraticLoss loss(network, rows, 5);
  const std::vector<float> parameters = RandomParameters(network, 2);
  Backpropagation backpropagation(network, 2, rows + 10);
  backpropagation.Run(parameters, rows, Executor(), loss);
  std::vector<double> at(parameters.begin(), parameters.end());
  const std::int64_t stride = std::max<std::int64_t>(1, network.parameter_count() / samples);
  double difference = 0.0, norm = 0.0;
  for (std::int64_t p = 0; p < network.parameter_count(); p += stride) {
    const auto i = static_cast<std::size_t>(p);
    const double centre = at[i];
    at[i] = centre + 1e-5;
    const double above = loss.InFloat64(at, rows);
    at[i] = centre - 1e-5;
    const double below = loss.InFloat64(at, rows);
    at[i] = centre;
    const double slope = (above - below) / 2e-5;
    const double got = backpropagation.gradient()[i];
    difference += (got - slope) * (got - slope);
    norm += slope * slope;
  }
  EXPECT_LT(std::sqrt(difference), 3e-5 * std::sqrt(norm) + 1e-7) << rows << " rows";
  EXPECT_GT(norm, 0.0);
  for (const float extra : backpropagation.gradient().last(2)) EXPECT_EQ(extra, static_cast<float>(rows));
}

/// A dense layer that is named as its output.
inline nn::Block Dense(std::string name, std::string from, std::int64_t in, std::int64_t out,
                       nn::Activation activation) {
  nn::Block block;
  block.output = name;
  block.name = std::move(name);
  block.inputs = {std::move(from)};
  block.in_size = in;
  block.out_size = out;
  block.activation = activation;
  return block;
}

}  // namespace consac::learn
