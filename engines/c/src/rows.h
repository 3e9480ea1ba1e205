#pragma once
// What a leaf of a layout is to C. Private to engines/c.

#include "calls.h"
#include "consac/space/layout.h"

namespace consac::c {

/// Writes what `leaf` is; `name` is what C sees as its name and lives with the handle.
Status DescribeLeaf(const Leaf& leaf, const char* name, consac_leaf* into);
/// Ok for CONSAC_OBSERVATION and CONSAC_ACTION.
Status SeenOrDone(consac_rows rows);

}  // namespace consac::c
