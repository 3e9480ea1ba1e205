#include "nn/ops.h"

namespace consac::nn {
namespace {

std::vector<Parameter> DenseParameters(const Block& block) {
  return {{block.name + "/w", {block.out_size, block.in_size}, 0, block.out_size * block.in_size},
          {block.name + "/b", {block.out_size}, 0, block.out_size}};
}

constexpr Op kOps[] = {
    {"dense", DenseParameters},
};
constexpr std::string_view kOpNames[] = {"dense"};
static_assert(std::size(kOps) == std::size(kOpNames));

}  // namespace

const Op* FindOp(std::string_view name) {
  for (const Op& op : kOps) {
    if (op.name == name) return &op;
  }
  return nullptr;
}

std::span<const std::string_view> OpNames() { return kOpNames; }

}  // namespace consac::nn
