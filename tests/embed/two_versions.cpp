// A game of one binary links all of its plugins into one program. Here another one brings its own version of a library
// that we stand on: both are in, and each calls its own.
#include <cstdint>
#include <cstdio>

#include "consac/nn/kernels.h"

namespace hwy {
std::int64_t SupportedTargets();
}

int main() {
  const bool theirs = hwy::SupportedTargets() == std::int64_t{1} << 60;
  const bool ours =
      !consac::nn::InstructionSets().empty() && consac::nn::UseInstructionSet(consac::nn::InstructionSets()[0]);
  if (!theirs || !ours) std::printf("two versions of Highway in one program were mixed up\n");
  return theirs && ours ? 0 : 1;
}
