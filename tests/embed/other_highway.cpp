// Another plugin's copy of Highway, of a version that knows one instruction set of its own; see two_versions.cpp.
#define SupportedTargets SupportedTargetsOfThisComputer
#include "hwy/targets.cc"
#undef SupportedTargets

namespace hwy {
std::int64_t SupportedTargets() {
  return std::int64_t{1} << 60;
}
}  // namespace hwy
