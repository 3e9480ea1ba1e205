#include "grad/gradient_ops.h"

#include <array>
#include <vector>

namespace consac::learn {
namespace {

/// The rows of this library, then what AddGradientOp brought.
std::vector<const GradientOp*>& GradientTable() {
  static const std::array kGradientOps = {DenseGradientOp(),    DuellingGradientOp(),      ConvolutionGradientOp(),
                                          FlattenGradientOp(),  ConcatenationGradientOp(), SliceGradientOp(),
                                          LayerNormGradientOp()};
  static std::vector<const GradientOp*> table = [] {
    std::vector<const GradientOp*> rows;
    for (const GradientOp& op : kGradientOps) rows.push_back(&op);
    return rows;
  }();
  return table;
}

}  // namespace

const GradientOp* FindGradientOp(std::string_view name) {
  for (const GradientOp* op : GradientTable()) {
    if (op->name == name) return op;
  }
  return nullptr;
}

void AddGradientOp(const GradientOp& op) {
  CONSAC_ASSERT(FindGradientOp(op.name) == nullptr);
  GradientTable().push_back(&op);
}

}  // namespace consac::learn
