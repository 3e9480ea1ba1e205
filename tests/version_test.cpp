// The build has read the header's version as the compiler does.
#include "consac/base/version.h"

#include <gtest/gtest.h>

TEST(Version, ProjectEqualsHeader) {
  EXPECT_STREQ(consac::kVersion, CONSAC_VERSION);
}
