// The version in the header is the project's.
#include "consac/base/version.h"

#include <gtest/gtest.h>

TEST(Version, HeaderEqualsProject) {
  EXPECT_STREQ(consac::kVersion, CONSAC_VERSION);
}
