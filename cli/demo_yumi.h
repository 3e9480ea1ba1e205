#pragma once
// consac demo yumi: a robot's description becomes a twin, learns to reach, and is drawn while it does.

#include <cstdint>
#include <string>

namespace consac::cli {

/// What the demo was told.
struct DemoYumiFlags {
  std::int64_t steps = 8000, seed = 1;
  std::string directory = "runs", name = "yumi";
  std::string robot;  ///< its URDF; "" looks for examples/robots/yumi here and around the program
};

/// Tells the story; returns the exit code.
int DemoYumi(const DemoYumiFlags& flags);

}  // namespace consac::cli
