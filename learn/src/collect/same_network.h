#pragma once
// Whether another model's weights fit a learner's network. Private to learn.

#include "consac/nn/network.h"

namespace consac::learn {

/// True when both are alike but for what only fresh parameters are made by, which no model file says.
inline bool SameNetwork(nn::NetworkSpec a, nn::NetworkSpec b) {
  for (nn::NetworkSpec* spec : {&a, &b}) {
    for (nn::Block& block : spec->blocks) {
      block.init = nn::Init();
      block.gain = 1.0f;
    }
  }
  return a == b;
}

}  // namespace consac::learn
