// The counter of heap allocations of this test program.
#include "tests/allocation_counter.h"

#include <gtest/gtest.h>

// The counter itself must be able to see an allocation, or no other test could fail.
TEST(AllocationCounter, SeesAnAllocationAndItsSize) {
  const std::int64_t before = consac::testing::AllocationCount();
  (void)consac::testing::TakeLargestAllocation();
  for (const std::size_t size : {1u << 20, 10u}) {
    char* volatile bytes = new char[size];
    delete[] bytes;
  }
  EXPECT_GE(consac::testing::AllocationCount(), before + 2);
  EXPECT_EQ(consac::testing::TakeLargestAllocation(), std::size_t{1} << 20);
  EXPECT_LT(consac::testing::TakeLargestAllocation(), std::size_t{1} << 20) << "since then";
}
