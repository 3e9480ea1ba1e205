#include "consac/model/model_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "consac/base/file.h"
#include "consac/base/hash.h"
#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"

namespace consac {
namespace {

using Json = nlohmann::json;

static_assert(std::endian::native == std::endian::little, "model files are little-endian and copied as they are");

constexpr std::size_t kLengthBytes = 8;
constexpr JsonLimits kHeaderLimits = {.depth = 8};
constexpr std::int64_t kFormatVersion = 1;
constexpr std::string_view kStatePrefix = "state/";
constexpr const char* kTensorsHash = "consac.tensors.sha256";

Status Damaged(std::string what) {
  return {StatusCode::kDataLoss, "not a usable model file: " + std::move(what)};
}

/// A tensor's place in the data buffer, as the header gives it.
struct TensorEntry {
  std::string name;
  DType dtype = DType::kF32;
  std::vector<std::int64_t> shape;
  std::uint64_t begin = 0, end = 0;
};

std::string HashOf(std::string_view spec, std::span<const std::byte> data) {
  const std::span<const std::byte> pieces[] = {std::as_bytes(std::span(spec)), data};
  return Sha256Hex(pieces);
}

/// Of what each tensor is, which the other one does not see: a changed name would be a field that is missing.
std::string HashOfTensors(const std::map<std::string, Tensor, std::less<>>& tensors) {
  std::string lines;
  for (const auto& [name, tensor] : tensors) {
    lines += name + '\t' + std::string(NameOf(tensor.dtype)) + '\t';
    for (const std::int64_t size : tensor.shape) lines += std::to_string(size) + ' ';
    lines += '\n';
  }
  const std::span<const std::byte> pieces[] = {std::as_bytes(std::span(lines))};
  return Sha256Hex(pieces);
}

bool ReadUnsigned(const Json& value, std::uint64_t* out) {
  if (!value.is_number_unsigned()) return false;
  *out = value.get<std::uint64_t>();
  return true;
}

Status ReadShape(const Json& json, TensorEntry& entry, std::uint64_t* elements) {
  if (!json.is_array() || json.size() > 16) return Damaged("tensor " + Quote(entry.name) + " has no list of sizes");
  *elements = 1;
  for (const Json& size : json) {
    std::uint64_t value = 0;
    if (!ReadUnsigned(size, &value) || (value != 0 && *elements > (std::uint64_t{1} << 40) / value)) {
      return Damaged("tensor " + Quote(entry.name) + " has an impossible size");
    }
    *elements *= value;
    entry.shape.push_back(static_cast<std::int64_t>(value));
  }
  return Status::Ok();
}

Result<TensorEntry> ReadEntry(const std::string& name, const Json& json) {
  TensorEntry entry;
  entry.name = name;
  if (!json.is_object() || !json.contains("dtype") || !json.contains("shape") || !json.contains("data_offsets")) {
    return Damaged("tensor " + Quote(name) + " lacks dtype, shape or data_offsets");
  }
  const Json& dtype = json["dtype"];
  if (!dtype.is_string() || !ParseDType(dtype.get_ref<const std::string&>(), &entry.dtype)) {
    return Damaged("tensor " + Quote(name) + " has an unknown dtype");
  }
  std::uint64_t elements = 0;
  CONSAC_RETURN_IF_ERROR(ReadShape(json["shape"], entry, &elements));
  const Json& offsets = json["data_offsets"];
  if (!offsets.is_array() || offsets.size() != 2 || !ReadUnsigned(offsets[0], &entry.begin) ||
      !ReadUnsigned(offsets[1], &entry.end) || entry.end < entry.begin) {
    return Damaged("tensor " + Quote(name) + " has no usable data_offsets");
  }
  if (entry.end - entry.begin != elements * SizeOf(entry.dtype)) {
    return Damaged("tensor " + Quote(name) + " has " + std::to_string(entry.end - entry.begin) +
                   " bytes, its shape needs " + std::to_string(elements * SizeOf(entry.dtype)));
  }
  return entry;
}

// The buffer must be covered completely, without holes or overlap.
Status CheckCoverage(std::vector<TensorEntry>& entries, std::uint64_t data_bytes) {
  std::sort(entries.begin(), entries.end(), [](const TensorEntry& a, const TensorEntry& b) {
    return a.begin != b.begin ? a.begin < b.begin : a.end < b.end;
  });
  std::uint64_t at = 0;
  for (const TensorEntry& entry : entries) {
    if (entry.begin != at) {
      return Damaged("tensor " + Quote(entry.name) + " begins at byte " + std::to_string(entry.begin) + ", expected " +
                     std::to_string(at));
    }
    at = entry.end;
  }
  if (at != data_bytes) {
    return Damaged("it has " + std::to_string(data_bytes) + " bytes of data, its tensors need " + std::to_string(at));
  }
  return Status::Ok();
}

struct Metadata {
  std::string spec, hash;
  std::optional<std::string> tensors_hash;  // files of before 2026-11-23 have none
};

Result<Metadata> ReadMetadata(const Json& header) {
  if (!header.contains("__metadata__") || !header["__metadata__"].is_object()) {
    return Damaged("a safetensors file without CONSAC's metadata; convert it first");
  }
  const Json& metadata = header["__metadata__"];
  const auto text = [&](const char* key) -> std::string {
    return metadata.contains(key) && metadata[key].is_string() ? metadata[key].get<std::string>() : "";
  };
  if (text("format") != "consac")
    return Damaged("a safetensors file of format " + Quote(text("format")) + ", not 'consac'");
  std::int64_t version = 0;
  if (!ParseNumber(text("consac.version"), &version) || version < 1) {
    return Damaged("its version " + Quote(text("consac.version")) + " is no number from 1");
  }
  if (version > kFormatVersion) {
    return Damaged("it has format version " + std::to_string(version) + ", this program reads up to " +
                   std::to_string(kFormatVersion) + "; use a newer CONSAC");
  }
  Metadata read{text("consac.spec"), text("consac.sha256"), std::nullopt};
  if (metadata.contains(kTensorsHash)) read.tensors_hash = text(kTensorsHash);
  return read;
}

}  // namespace

Tensor Tensor::OfFloats(std::span<const float> values, std::vector<std::int64_t> shape) {
  const auto bytes = std::as_bytes(values);
  return {DType::kF32, std::move(shape), std::vector<std::byte>(bytes.begin(), bytes.end())};
}

std::span<const float> Tensor::floats() const {
  if (dtype != DType::kF32) return {};
  return {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)};
}

Result<ModelFile> ModelFile::Parse(std::span<const std::byte> bytes) {
  if (bytes.size() < kLengthBytes) return Damaged("it has only " + std::to_string(bytes.size()) + " bytes");
  std::uint64_t header_bytes = 0;
  std::memcpy(&header_bytes, bytes.data(), kLengthBytes);
  if (header_bytes > kHeaderLimits.bytes || header_bytes > bytes.size() - kLengthBytes) {
    const bool text = std::all_of(bytes.begin(), bytes.begin() + kLengthBytes,
                                  [](std::byte b) { return std::to_integer<int>(b) >= 0x09; });
    if (text)
      return Status{StatusCode::kDataLoss,
                    "this is no .consac file: it begins " +
                        Quote(std::string_view(reinterpret_cast<const char*>(bytes.data()), kLengthBytes))};
    return Damaged("its header claims " + std::to_string(header_bytes) + " bytes of a file of " +
                   std::to_string(bytes.size()));
  }
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()) + kLengthBytes,
                              static_cast<std::size_t>(header_bytes));
  const std::span<const std::byte> data = bytes.subspan(kLengthBytes + static_cast<std::size_t>(header_bytes));
  const Result<Json> read = ReadJson<Json>(text, kHeaderLimits);
  if (!read.ok()) return Damaged("its header is " + read.status().message());
  const Json& header = *read;
  if (!text.starts_with('{')) return Damaged("its header is no plain JSON object");

  Result<Metadata> metadata = ReadMetadata(header);
  if (!metadata.ok()) return metadata.status();
  ModelFile file;
  file.spec_json = std::move(metadata->spec);

  std::vector<TensorEntry> entries;
  for (const auto& [name, json] : header.items()) {
    if (name == "__metadata__") continue;
    if (const Status named = CheckName("a tensor's", name); !named.ok()) return Damaged(named.message());
    Result<TensorEntry> entry = ReadEntry(name, json);
    if (!entry.ok()) return entry.status();
    entries.push_back(std::move(*entry));
  }
  CONSAC_RETURN_IF_ERROR(CheckCoverage(entries, data.size()));
  if (metadata->hash != HashOf(file.spec_json, data)) return Damaged("its SHA-256 does not match; the file is damaged");
  for (TensorEntry& entry : entries) {
    const auto piece =
        data.subspan(static_cast<std::size_t>(entry.begin), static_cast<std::size_t>(entry.end - entry.begin));
    file.tensors.emplace(std::move(entry.name), Tensor{entry.dtype, std::move(entry.shape),
                                                       std::vector<std::byte>(piece.begin(), piece.end())});
  }
  if (metadata->tensors_hash.has_value() && *metadata->tensors_hash != HashOfTensors(file.tensors))
    return Damaged("the SHA-256 of its tensors' names and shapes does not match; the file is damaged");
  return file;
}

Result<ModelFile> ModelFile::Load(const std::string& path) {
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(path);
  if (!bytes.ok()) return bytes.status();
  Result<ModelFile> file = Parse(*bytes);
  if (!file.ok()) return Status{file.status().code(), "'" + path + "': " + file.status().message()};
  return file;
}

std::vector<std::byte> ModelFile::Serialise() const {
  std::vector<std::byte> data;
  Json header = Json::object();
  for (const auto& [name, tensor] : tensors) {
    const std::size_t begin = data.size();
    data.insert(data.end(), tensor.bytes.begin(), tensor.bytes.end());
    header[name] = {{"dtype", NameOf(tensor.dtype)}, {"shape", tensor.shape}, {"data_offsets", {begin, data.size()}}};
  }
  header["__metadata__"] = {{"format", "consac"},
                            {"consac.version", std::to_string(kFormatVersion)},
                            {"consac.spec", spec_json},
                            {"consac.sha256", HashOf(spec_json, data)},
                            {kTensorsHash, HashOfTensors(tensors)}};
  std::string text = JsonText(header);
  text.append((8 - text.size() % 8) % 8, ' ');

  const std::uint64_t length = text.size();
  std::vector<std::byte> out(kLengthBytes + text.size() + data.size());
  std::memcpy(out.data(), &length, kLengthBytes);
  std::memcpy(out.data() + kLengthBytes, text.data(), text.size());
  if (!data.empty()) std::memcpy(out.data() + kLengthBytes + text.size(), data.data(), data.size());
  return out;
}

Status ModelFile::Save(const std::string& path) const {
  return WriteFileAtomically(path, Serialise());
}

void ModelFile::PutState(const StateMap& state) {
  for (const auto& [path, field] : state) {
    const auto count = static_cast<std::int64_t>(field.bytes.size() / SizeOf(field.dtype));
    tensors.insert_or_assign(std::string(kStatePrefix) + path, Tensor{field.dtype, {count}, field.bytes});
  }
}

StateMap ModelFile::TakeState() const {
  StateMap state;
  for (const auto& [name, tensor] : tensors) {
    if (!name.starts_with(kStatePrefix)) continue;
    state.emplace(name.substr(kStatePrefix.size()), StateField{tensor.dtype, tensor.bytes});
  }
  return state;
}

}  // namespace consac
