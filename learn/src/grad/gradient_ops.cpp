#include "grad/gradient_ops.h"

#include <array>

namespace consac::learn {

const GradientOp* FindGradientOp(std::string_view name) {
  static const std::array kGradientOps = {DenseGradientOp(), DuellingGradientOp()};
  for (const GradientOp& op : kGradientOps) {
    if (op.name == name) return &op;
  }
  return nullptr;
}

}  // namespace consac::learn
