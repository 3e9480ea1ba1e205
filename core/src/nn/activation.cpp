#include <array>

#include "consac/base/text.h"
#include "consac/nn/network.h"

namespace consac::nn {
namespace {

constexpr std::array<std::string_view, 8> kActivationNames = {"linear", "tanh",       "relu", "sigmoid",
                                                              "elu",    "leaky_relu", "silu", "softplus"};

}  // namespace

std::string_view NameOf(Activation activation) {
  return kActivationNames[static_cast<std::size_t>(activation)];
}

Result<Activation> ParseActivation(std::string_view name) {
  for (std::size_t i = 0; i < kActivationNames.size(); ++i) {
    if (kActivationNames[i] == name) return static_cast<Activation>(i);
  }
  return Status(StatusCode::kInvalidArgument, "unknown activation " + Quote(name) + Suggestion(name, kActivationNames) +
                                                  "; known: " + Join(kActivationNames));
}

}  // namespace consac::nn
