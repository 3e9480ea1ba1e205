#include "consac/nn/ops.h"

#include <array>

#include "consac/base/text.h"
#include "nn/blocks.h"

namespace consac::nn {
namespace {

/// The rows of this library, then what AddOp brought.
std::vector<const Op*>& OpTable() {
  static const std::array kOps = {DenseOp(),         DuellingOp(), ConvolutionOp(), FlattenOp(),
                                  ConcatenationOp(), SliceOp(),    LayerNormOp()};
  static std::vector<const Op*> table = [] {
    std::vector<const Op*> rows;
    for (const Op& op : kOps) rows.push_back(&op);
    return rows;
  }();
  return table;
}

}  // namespace

const Op* FindOp(std::string_view name) {
  for (const Op* op : OpTable()) {
    if (op->name == name) return op;
  }
  return nullptr;
}

std::vector<std::string_view> OpNames() {
  std::vector<std::string_view> names;
  for (const Op* op : OpTable()) names.push_back(op->name);
  return names;
}

void AddOp(const Op& op) {
  CONSAC_ASSERT(FindOp(op.name) == nullptr);
  OpTable().push_back(&op);
}

Status BlockFault(const Block& block, std::string_view message) {
  return Status(StatusCode::kInvalidArgument, "block " + Quote(block.name) + ": " + std::string(message));
}

Status CheckInputCount(const Block& block, std::span<const Shape> inputs, std::size_t count) {
  if (inputs.size() == count) return {};
  return BlockFault(block, block.op + " has " + std::to_string(count) + (count == 1 ? " input" : " inputs") + ", not " +
                               std::to_string(inputs.size()));
}

}  // namespace consac::nn
