#include "rows.h"

namespace consac::c {

static_assert(static_cast<int>(SpaceKind::kDiscrete) == CONSAC_DISCRETE);
static_assert(static_cast<int>(SpaceKind::kBox) == CONSAC_BOX);
static_assert(static_cast<int>(SpaceKind::kMultiDiscrete) == CONSAC_MULTI_DISCRETE);
static_assert(static_cast<int>(SpaceKind::kMultiBinary) == CONSAC_MULTI_BINARY);
static_assert(static_cast<int>(DType::kF32) == CONSAC_FLOAT32);
static_assert(static_cast<int>(DType::kU8) == CONSAC_UINT8);
static_assert(static_cast<int>(DType::kBool) == CONSAC_BOOL);

Status DescribeLeaf(const Leaf& leaf, const char* name, consac_leaf* into) {
  consac_leaf facts{};
  facts.name = name;
  facts.kind = static_cast<consac_kind>(leaf.space.kind());
  facts.type = static_cast<consac_type>(leaf.dtype);
  facts.count = leaf.count;
  facts.offset = leaf.offset;
  facts.mask_offset = leaf.mask_offset;
  facts.mask_count = leaf.mask_count;
  return GiveFacts(facts, "leaf", into);
}

Status SeenOrDone(consac_rows rows) {
  if (rows == CONSAC_OBSERVATION || rows == CONSAC_ACTION) return Status::Ok();
  return {StatusCode::kInvalidArgument,
          "rows is " + std::to_string(rows) + "; give CONSAC_OBSERVATION (0) or CONSAC_ACTION (1)"};
}

}  // namespace consac::c
