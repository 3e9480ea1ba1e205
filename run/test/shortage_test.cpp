#include "consac/run/shortage.h"

#include <gtest/gtest.h>

#include <memory>
#include <new>

namespace consac::run {
namespace {

/// Whether an allocation that finds no memory is helped.
bool IsHelped() {
  try {
    std::get_new_handler()();
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

TEST(MemoryReserve, FirstAidIsThereOnceAndIsHeardOf) {
  const MemoryReserve reserve(kFirstAid);
  EXPECT_FALSE(reserve.ran_short());
  EXPECT_TRUE(IsHelped());
  EXPECT_EQ(reserve.health().code(), StatusCode::kResourceExhausted);
  EXPECT_FALSE(IsHelped());
}

TEST(MemoryReserve, WhatIsKeptForSavingHelpsNobodyElse) {
  MemoryReserve reserve(0, kFirstAid);
  EXPECT_FALSE(IsHelped());
  EXPECT_TRUE(reserve.ran_short());
  reserve.Release();
  reserve.Release();
}

TEST(MemoryReserve, NoneTakesOrFreesAnothers) {
  auto first = std::make_unique<MemoryReserve>(kFirstAid);
  EXPECT_TRUE(IsHelped());
  auto second = std::make_unique<MemoryReserve>(kFirstAid);
  EXPECT_FALSE(IsHelped()) << "the first still holds, if nothing any more";
  EXPECT_TRUE(second->ran_short()) << "and those made meanwhile hear of it";
  first.reset();
  const MemoryReserve third(kFirstAid);
  second.reset();
  EXPECT_TRUE(IsHelped());
}

}  // namespace
}  // namespace consac::run
