#pragma once
// The trainer's end of either protocol, and how it is chosen. Private to core/server.

#include <memory>
#include <span>

#include "consac/server/env_client.h"

namespace consac {

/// Text protocol 1; `first` has come already.
Result<std::unique_ptr<EnvClient>> OpenTextClient(std::unique_ptr<Transport> transport, const EnvClientOptions& options,
                                                  std::span<const std::byte> first);
/// Protocol 2: says HELLO. kFailedPrecondition when a text setup comes back: an old engine that was slow to speak.
Result<std::unique_ptr<EnvClient>> OpenClient2(std::unique_ptr<Transport> transport, const EnvClientOptions& options);

}  // namespace consac
