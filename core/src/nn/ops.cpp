#include "consac/nn/ops.h"

#include <array>

#include "nn/dense.h"

namespace consac::nn {
namespace {

const auto& OpTable() {
  static const std::array kOps = {DenseOp()};
  return kOps;
}

}  // namespace

const Op* FindOp(std::string_view name) {
  for (const Op& op : OpTable()) {
    if (op.name == name) return &op;
  }
  return nullptr;
}

std::vector<std::string_view> OpNames() {
  std::vector<std::string_view> names;
  for (const Op& op : OpTable()) names.push_back(op.name);
  return names;
}

}  // namespace consac::nn
