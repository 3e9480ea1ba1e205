#include "cli/twin_hints.h"

#include <nlohmann/json.hpp>
#include <random>
#include <span>

#include "consac/base/file.h"
#include "consac/base/hash.h"
#include "consac/base/json.h"
#include "consac/base/path.h"
#include "consac/twin/cad_joints.h"

namespace consac::cli {
namespace {

using HintsJson = nlohmann::ordered_json;

constexpr std::size_t kMostHintsBytes = std::size_t{16} << 20;

// So that a page cannot write over what it has not read.
std::string VersionOf(std::string_view text) {
  const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
  return Sha256Hex({&bytes, 1});
}

}  // namespace

TwinHints::TwinHints(std::string path) : path_(std::move(path)) {
  std::random_device random;
  constexpr char kDigits[] = "0123456789abcdef";
  for (int i = 0; i < 32; ++i) token_ += kDigits[random() % 16];
}

Result<std::string> TwinHints::Written() const {
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(path_, kMostHintsBytes);
  if (bytes.ok()) return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  if (bytes.status().code() == StatusCode::kNotFound) return std::string();
  return bytes.status();
}

std::string TwinHints::Text(std::string_view candidates) const {
  Result<HintsJson> found = ReadJson<HintsJson>(candidates);
  HintsJson out = found.ok() && found->is_object() ? std::move(*found) : HintsJson::object();
  out["hints"] = HintsJson::object();
  if (path_.empty()) return JsonText(out);
  out["file"] = FromPath(ToPath(path_).filename());
  const Result<std::string> written = Written();
  Result<HintsJson> hints = written.ok() && !written->empty() ? ReadJson<HintsJson>(*written) : HintsJson::object();
  if (!written.ok() || !hints.ok() || !hints->is_object()) {  // nothing is saved over what cannot be read
    out["error"] = !written.ok() ? written.status().message()
                   : !hints.ok() ? hints.status().message()
                                 : "it is no object";
    return JsonText(out);
  }
  out["hints"] = std::move(*hints);
  out["version"] = VersionOf(*written);
  out["token"] = token_;
  return JsonText(out);
}

Result<std::string> TwinHints::Asked(std::string_view body) const {
  const Result<HintsJson> json = ReadJson<HintsJson>(body);
  const bool asked = json.ok() && json->is_object() && json->contains("token") && json->contains("hints");
  if (!asked) return Status{StatusCode::kInvalidArgument, "{\"token\": \"...\", \"hints\": {...}} is expected"};
  if (path_.empty() || (*json)["token"] != token_)
    return Status{StatusCode::kFailedPrecondition,
                  "only the page itself may save, and only where --hints named a file; load the page anew"};
  const Result<std::string> written = Written();
  if (!written.ok()) return written.status();
  if (json->value("version", HintsJson()) != VersionOf(*written))
    return Status{StatusCode::kFailedPrecondition,
                  "the file of --hints has changed since this page read it; load the page anew"};
  const std::string text = JsonText((*json)["hints"], 1) + "\n";
  const Result<twin::JointHints> hints = twin::ReadHints(text);
  if (!hints.ok()) return hints.status();
  return text;
}

Status TwinHints::Save(const std::string& hints) const {
  return WriteFileAtomically(path_, std::as_bytes(std::span<const char>(hints)));
}

}  // namespace consac::cli
