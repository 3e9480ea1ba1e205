#pragma once
// A network run over many rows at once by as many threads as the executor has. Private to learn.

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "consac/base/executor.h"
#include "consac/learn/grad/backpropagation.h"
#include "consac/nn/network.h"

namespace consac::learn {

/// An nn::Evaluator by slices of the rows where the network is wide (Backpropagation::IsWide), whole where a slice
/// would take less than a thread takes to wake. A row's result does not depend on the others: slices change no bit.
class SlicedEvaluator {
 public:
  /// Room for `max_rows` rows; runs what `packed`, of `network`, holds.
  SlicedEvaluator(const nn::Network& network, const std::shared_ptr<const nn::PackedNetwork>& packed,
                  std::int64_t max_rows, const Executor& executor)
      : executor_(executor),
        slice_rows_(Backpropagation::IsWide(network) ? std::min(kSliceRows, max_rows) : max_rows),
        slices_(static_cast<std::size_t>((max_rows + slice_rows_ - 1) / slice_rows_)) {
    for (Slice& slice : slices_) {
      slice.evaluator = std::make_unique<nn::Evaluator>(packed, slice_rows_);
      slice.inputs.resize(network.spec().inputs.size());
    }
    for (const nn::Port& input : network.spec().inputs) input_sizes_.push_back(input.size);
    for (std::size_t i = 0; i < network.spec().outputs.size(); ++i) {
      output_sizes_.push_back(network.output_size(i));
      outputs_.emplace_back(slices_.size() > 1 ? static_cast<std::size_t>(max_rows * output_sizes_[i]) : 0);
    }
  }

  /// As nn::Evaluator's.
  void Forward(std::span<const float* const> inputs, std::int64_t rows) {
    Run(inputs, rows, 0, outputs_.size(),
        [](nn::Evaluator& evaluator, std::span<const float* const> of, std::int64_t count) {
          evaluator.Forward(of, count);
        });
  }
  /// As nn::Evaluator's.
  void ForwardTo(std::size_t index, std::span<const float* const> inputs, std::int64_t rows) {
    Run(inputs, rows, index, index + 1,
        [index](nn::Evaluator& evaluator, std::span<const float* const> of, std::int64_t count) {
          evaluator.ForwardTo(index, of, count);
        });
  }
  /// As nn::Evaluator's.
  const float* output(std::size_t index) const {
    return sliced_ ? outputs_[index].data() : slices_[0].evaluator->output(index);
  }

 private:
  static constexpr std::int64_t kSliceRows = 128;
  struct Slice {
    std::unique_ptr<nn::Evaluator> evaluator;
    std::vector<const float*> inputs;  // where its rows begin
  };

  template <class ForwardFunction>
  void Run(std::span<const float* const> inputs, std::int64_t rows, std::size_t first_output, std::size_t end_output,
           ForwardFunction&& forward) {
    sliced_ = rows > slice_rows_;
    if (!sliced_) return forward(*slices_[0].evaluator, inputs, rows);
    executor_.ForEach((rows + slice_rows_ - 1) / slice_rows_, [&](std::int64_t s) {
      Slice& slice = slices_[static_cast<std::size_t>(s)];
      const std::int64_t first = s * slice_rows_, count = std::min(slice_rows_, rows - first);
      for (std::size_t i = 0; i < inputs.size(); ++i) slice.inputs[i] = inputs[i] + first * input_sizes_[i];
      forward(*slice.evaluator, slice.inputs, count);
      for (std::size_t i = first_output; i < end_output; ++i) {
        const std::int64_t size = output_sizes_[i];
        std::copy_n(slice.evaluator->output(i), count * size, outputs_[i].data() + first * size);
      }
    });
  }

  Executor executor_;
  std::int64_t slice_rows_;
  std::vector<Slice> slices_;
  std::vector<std::int64_t> input_sizes_, output_sizes_;
  std::vector<std::vector<float>> outputs_;  // [outputs] each [max_rows, size]; of one slice its own are read
  bool sliced_ = false;                      // the latest run
};

}  // namespace consac::learn
