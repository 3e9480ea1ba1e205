// The counter of heap allocations of this test program.
#include "tests/allocation_counter.h"

#include <gtest/gtest.h>

// The counter itself must be able to see an allocation, or no other test could fail.
TEST(AllocationCounter, SeesAnAllocation) {
  const std::int64_t before = consac::testing::AllocationCount();
  int* volatile number = new int(3);
  delete number;
  EXPECT_GT(consac::testing::AllocationCount(), before);
}
