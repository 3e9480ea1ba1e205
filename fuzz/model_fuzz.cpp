// The model reader on any bytes: it refuses or loads, and what it loads is written and read back the same.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "consac/policy/demonstration.h"
#include "consac/policy/policy.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data), size);
  const consac::Result<consac::ModelFile> file = consac::ModelFile::Parse(bytes);
  if (file.ok()) {
    const consac::Result<consac::ModelFile> again = consac::ModelFile::Parse(file->Serialise());
    if (!again.ok() || again->spec_json != file->spec_json || again->tensors.size() != file->tensors.size())
      std::abort();
    (void)consac::Policy::FromFile(*file);
    (void)consac::Demonstration::FromFile(*file);
  }
  // The input as a specification, over the tensors of a model that is whole.
  consac::ModelFile made;
  made.spec_json.assign(reinterpret_cast<const char*>(data), size);
  const std::vector<float> ones(64, 1.0f);
  for (const char* name : {"pi/0/w", "pi/0/b", "pi/head/w", "pi/head/b", "norm/obs/mean", "norm/obs/scale",
                           "pi/log_std", "test/0/in", "test/0/out"}) {
    made.tensors[name] = consac::Tensor::OfFloats(ones, {64});
  }
  (void)consac::Policy::FromFile(made);
  made.tensors["rewards"] = consac::Tensor::OfFloats(ones, {64});
  made.tensors["observations"] = made.tensors["actions"] = made.tensors["rewards"];
  for (const char* name : {"terminated", "truncated"})
    made.tensors[name] = {consac::DType::kU8, {64}, std::vector<std::byte>(64)};
  made.tensors["slots"] = {consac::DType::kI32, {64}, std::vector<std::byte>(256)};
  (void)consac::Demonstration::FromFile(made);
  return 0;
}
