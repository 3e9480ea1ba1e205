#pragma once
// The `.consac` file: a valid safetensors file whose metadata holds one JSON specification. This header is the
// container; policy/policy.h is the acting model inside. Format in words: spec/model_file.md.

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/dtype.h"
#include "consac/base/status.h"

namespace consac {

/// A named tensor.
struct Tensor {
  DType dtype = DType::kF32;        ///< element type
  std::vector<std::int64_t> shape;  ///< row-major
  std::vector<std::byte> bytes;     ///< packed, little-endian

  /// A float32 tensor holding a copy of `values`.
  static Tensor OfFloats(std::span<const float> values, std::vector<std::int64_t> shape);
  /// The elements when dtype is kF32, else empty. Valid while the tensor lives.
  std::span<const float> floats() const;
};

/// Content of a `.consac` file: the specification text and the tensors.
struct ModelFile {
  std::string spec_json;                               ///< the JSON specification (spec/model_file.md)
  std::map<std::string, Tensor, std::less<>> tensors;  ///< by name: "pi/0/w", "norm/mean", "test/0/in", ...

  /// Reads a file from memory: bounds, holes, overlaps, types, version and SHA-256 are checked before anything is
  /// used. kDataLoss with what is wrong; never allocates more than the file is long (plus its index).
  static Result<ModelFile> Parse(std::span<const std::byte> bytes);
  /// Reads a file; the error begins with the path.
  static Result<ModelFile> Load(const std::string& path);
  /// The file's bytes: tensors sorted by name, header padded to 8.
  std::vector<std::byte> Serialise() const;
  /// Writes by temporary file, sync and rename.
  Status Save(const std::string& path) const;

  /// Puts every field of `state` in as a tensor "state/<path>" (checkpoints).
  void PutState(const StateMap& state);
  /// The reverse of PutState.
  StateMap TakeState() const;
};

}  // namespace consac
