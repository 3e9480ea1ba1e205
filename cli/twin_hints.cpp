#include "cli/twin_hints.h"

#include <nlohmann/json.hpp>
#include <random>
#include <span>

#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/path.h"
#include "consac/twin/cad_joints.h"

namespace consac::cli {
namespace {

using HintsJson = nlohmann::ordered_json;

constexpr std::size_t kMostHintsBytes = std::size_t{16} << 20;

}  // namespace

TwinHints::TwinHints(std::string path) : path_(std::move(path)) {
  std::random_device random;
  constexpr char kDigits[] = "0123456789abcdef";
  for (int i = 0; i < 32; ++i) token_ += kDigits[random() % 16];
}

std::string TwinHints::Text(std::string_view candidates) const {
  const auto object = [](std::string_view text) {
    Result<HintsJson> json = ReadJson<HintsJson>(text);
    return json.ok() && json->is_object() ? std::move(*json) : HintsJson::object();
  };
  HintsJson out = object(candidates);
  out["hints"] = HintsJson::object();
  if (!path_.empty()) {
    const Result<std::vector<std::byte>> bytes = ReadRegularFile(path_, kMostHintsBytes);
    if (bytes.ok())
      out["hints"] = object(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
    out["file"] = FromPath(ToPath(path_).filename());
    out["token"] = token_;
  }
  return JsonText(out);
}

Result<std::string> TwinHints::Asked(std::string_view body) const {
  const Result<HintsJson> json = ReadJson<HintsJson>(body);
  const bool asked = json.ok() && json->is_object() && json->contains("token") && json->contains("hints");
  if (!asked) return Status{StatusCode::kInvalidArgument, "{\"token\": \"...\", \"hints\": {...}} is expected"};
  if (path_.empty() || (*json)["token"] != token_)
    return Status{StatusCode::kFailedPrecondition,
                  "only the page itself may save, and only where --hints named a file; load the page anew"};
  const std::string text = JsonText((*json)["hints"], 1) + "\n";
  const Result<twin::JointHints> hints = twin::ReadHints(text);
  if (!hints.ok()) return hints.status();
  return text;
}

Status TwinHints::Save(const std::string& hints) const {
  return WriteFileAtomically(path_, std::as_bytes(std::span<const char>(hints)));
}

}  // namespace consac::cli
