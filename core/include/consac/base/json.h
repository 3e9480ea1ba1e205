#pragma once
// The one reader of JSON from outside: messages, model and checkpoint headers, what is nested in them. It refuses too
// deep, too long and too many before a tree is built. No JSON library here: whoever reads names its value type, and
// includes it in a source file. tools/check_text.py holds everything else to it.

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "consac/base/status.h"

namespace consac {

/// What is taken. Defaults: of a model's or checkpoint's specification; at most about 100 MB for the tree.
struct JsonLimits {
  std::size_t bytes = std::size_t{16} << 20;  ///< of text
  std::size_t values = std::size_t{1} << 20;  ///< objects, lists, texts, numbers, truths and nulls
  int depth = 64;                             ///< objects and lists within each other; 16 levels of space need 53
};

/// Ok when `text` is one JSON value within `limits` and no object names a member twice; kDataLoss says what it is
/// instead. Cost: one pass (keys are sorted per object); the stack does not grow with the depth.
Status CheckJson(std::string_view text, const JsonLimits& limits = {});

/// Reads checked JSON; `Json` is nlohmann::json. Throws nothing.
template <class Json>
Result<Json> ReadJson(std::string_view text, const JsonLimits& limits = {}) {
  CONSAC_RETURN_IF_ERROR(CheckJson(text, limits));
  return Json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
}

/// `json` as text on one line, in UTF-8; bytes that are none are replaced. Throws nothing.
template <class Json>
std::string JsonText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
}

/// The same with everything but ASCII as \uXXXX: for a terminal or a program that reads it.
template <class Json>
std::string AsciiJsonText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
}

}  // namespace consac
