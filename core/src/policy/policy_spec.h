#pragma once
// The JSON specification inside a policy's model file, to and from PolicyData. Format: spec/model_file.md. Private to
// core/policy.

#include <string>
#include <vector>

#include "consac/policy/policy.h"

namespace consac {

/// One stored question and answer: network input row(s) and the head's answer(s), by tensor name.
struct SelfTestPair {
  std::string in;           ///< tensor name, [rows, features]
  std::string out;          ///< tensor name, [rows, head size]
  double tolerance = 1e-5;  ///< largest difference, relative to 1 + |answer|
};

/// Writes the specification and every tensor of `data` (not the self-test's tensors).
void WritePolicy(const PolicyData& data, const std::vector<SelfTestPair>& selftest, ModelFile* file);
/// The reverse: checks everything it reads; kDataLoss says what is missing or wrong.
Result<PolicyData> ReadPolicy(const ModelFile& file, std::vector<SelfTestPair>* selftest);

}  // namespace consac
