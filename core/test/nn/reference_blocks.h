#pragma once
// Every kind of block in plain float64 loops, from spec/model_file.md alone: what the blocks and their gradients are
// checked against.

#include <cmath>
#include <vector>

#include "consac/nn/network.h"
#include "core/test/nn/reference_activation.h"

namespace consac::nn {

/// act(w x + b).
inline std::vector<double> ReferenceDense(const PlacedBlock& block, const double* w, const std::vector<double>& x) {
  const auto in = static_cast<std::size_t>(block.in_size), out = static_cast<std::size_t>(block.out_size);
  std::vector<double> y(out);
  for (std::size_t o = 0; o < out; ++o) {
    double sum = w[in * out + o];
    for (std::size_t i = 0; i < in; ++i) sum += w[o * in + i] * x[i];
    y[o] = ReferenceActivation(block.activation, sum);
  }
  return y;
}

/// Sums over kernel and channels at every pixel.
inline std::vector<double> ReferenceConvolution(const PlacedBlock& block, const double* w,
                                                const std::vector<double>& x) {
  const Shape& in = block.in_shapes[0];
  const bool first = block.attributes.Text("layout") == "CHW";
  const std::int64_t channels = in[first ? 0 : 2], height = in[first ? 1 : 0], width = in[first ? 2 : 1];
  const std::int64_t kh = (*block.attributes.Integers("kernel"))[0], kw = (*block.attributes.Integers("kernel"))[1];
  const std::int64_t sh = (*block.attributes.Integers("stride"))[0], sw = (*block.attributes.Integers("stride"))[1];
  const std::int64_t filters = *block.attributes.Integer("filters");
  std::vector<double> y;
  for (std::int64_t r = 0; r + kh <= height; r += sh) {
    for (std::int64_t c = 0; c + kw <= width; c += sw) {
      for (std::int64_t f = 0; f < filters; ++f) {
        double sum = w[filters * kh * kw * channels + f];
        for (std::int64_t i = 0; i < kh; ++i) {
          for (std::int64_t j = 0; j < kw; ++j) {
            for (std::int64_t k = 0; k < channels; ++k) {
              const std::int64_t at =
                  first ? (k * height + r + i) * width + c + j : ((r + i) * width + c + j) * channels + k;
              sum += w[((f * kh + i) * kw + j) * channels + k] * x[static_cast<std::size_t>(at)];
            }
          }
        }
        y.push_back(ReferenceActivation(block.activation, sum));
      }
    }
  }
  return y;
}

/// The row at mean 0 and deviation 1, scaled and shifted.
inline std::vector<double> ReferenceLayerNorm(const PlacedBlock& block, const double* w, const std::vector<double>& x) {
  const auto n = static_cast<double>(x.size());
  double mean = 0.0, variance = 0.0;
  for (const double value : x) mean += value / n;
  for (const double value : x) variance += (value - mean) * (value - mean) / n;
  std::vector<double> y;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double h = (x[i] - mean) / std::sqrt(variance + block.attributes.Number("epsilon").value_or(1e-5));
    y.push_back(ReferenceActivation(block.activation, h * w[i] + w[x.size() + i]));
  }
  return y;
}

/// One row through one block; `w` are its parameters.
inline std::vector<double> ReferenceBlock(const PlacedBlock& block, const double* w,
                                          const std::vector<std::vector<double>>& inputs) {
  if (block.op == "dense") return ReferenceDense(block, w, inputs[0]);
  if (block.op == "convolution") return ReferenceConvolution(block, w, inputs[0]);
  if (block.op == "layer_norm") return ReferenceLayerNorm(block, w, inputs[0]);
  std::vector<double> y;
  if (block.op == "duelling") {
    double mean = 0.0;
    for (const double a : inputs[1]) mean += a / static_cast<double>(inputs[1].size());
    for (const double a : inputs[1]) y.push_back(inputs[0][0] + a - mean);
  } else if (block.op == "slice") {
    const auto offset = static_cast<std::size_t>(block.attributes.Integer("offset").value_or(0));
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.out_size); ++i)
      y.push_back(inputs[0][offset + i] / block.attributes.Number("divide_by").value_or(1.0));
  } else {
    for (const std::vector<double>& input : inputs) y.insert(y.end(), input.begin(), input.end());
  }
  return y;
}

}  // namespace consac::nn
