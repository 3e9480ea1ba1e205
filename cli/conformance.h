#pragma once
// Puts any server of protocol 2 through spec/conformance/protocol2/server.json.

#include <functional>
#include <string>

#include "consac/transport/transport.h"

namespace consac::cli {

/// The cases as JSON.
const char* ConformanceCases();

/// What became of one case.
struct ConformanceVerdict {
  std::string name;
  Status status;  ///< ok, or which step failed and how
};

/// Runs every case against `endpoint`, telling `say` of each; how many failed. kUnavailable when nobody answers there.
Result<int> RunConformance(const Endpoint& endpoint, const std::string& token,
                           const std::function<void(const ConformanceVerdict&)>& say);

}  // namespace consac::cli
