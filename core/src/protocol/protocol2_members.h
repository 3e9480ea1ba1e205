#pragma once
// Members of a message's JSON, each of the type that it should have. Private to core/protocol.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"

namespace consac::protocol2 {

using Json = nlohmann::json;

/// A number that every language's JSON has exactly.
inline bool IsWhole(const Json& value) {
  constexpr std::int64_t kMost = (std::int64_t{1} << 53) - 1;
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= static_cast<std::uint64_t>(kMost);
  return value.is_number_integer() && value.get<std::int64_t>() >= -kMost && value.get<std::int64_t>() <= kMost;
}

/// Members of an object, and what holds where they are missing. One of another type than it should have is remembered.
struct Members {
  const Json& json;
  mutable std::string wrong = {};  ///< the first such member

  const Json* Find(const char* name) const {
    const auto found = json.find(name);
    return found == json.end() ? nullptr : &*found;
  }
  /// The member if it is `what`; null where it is missing or something else.
  template <class Is>
  const Json* Find(const char* name, Is is, const char* what) const {
    const Json* value = Find(name);
    if (value == nullptr || std::invoke(is, *value)) return value;
    if (wrong.empty()) wrong = std::string(name) + " is " + Quote(JsonText(*value)) + ", expected " + what;
    return nullptr;
  }
  std::string Text(const char* name) const {
    const Json* value = Find(name, &Json::is_string, "a text");
    return value != nullptr ? value->get<std::string>() : std::string();
  }
  std::int64_t Whole(const char* name, std::int64_t otherwise = 0) const {
    const Json* value = Find(name, IsWhole, "a whole number below 2^53");
    return value != nullptr ? value->get<std::int64_t>() : otherwise;
  }
  /// 0 or more, and 0 where it is missing.
  std::int64_t Count(const char* name) const {
    const auto is_count = [](const Json& value) { return IsWhole(value) && value >= 0; };
    const Json* value = Find(name, is_count, "a whole number from 0, below 2^53");
    return value != nullptr ? value->get<std::int64_t>() : 0;
  }
  double Number(const char* name, double otherwise) const {
    const Json* value = Find(name, &Json::is_number, "a number");
    return value != nullptr ? value->get<double>() : otherwise;
  }
  bool Truth(const char* name) const {
    const Json* value = Find(name, &Json::is_boolean, "true or false");
    return value != nullptr && value->get<bool>();
  }
  /// Remembers that a member which must be there is not.
  void Need(const char* name) const {
    if (Find(name) == nullptr && wrong.empty()) wrong = std::string(name) + " is missing";
  }
  const Json* List(const char* name) const { return Find(name, &Json::is_array, "a list"); }
  std::vector<std::string> Texts(const char* name) const {
    std::vector<std::string> texts;
    const Json* value = List(name);
    for (const Json& text : value != nullptr ? *value : Json::array()) {
      if (text.is_string())
        texts.push_back(text.get<std::string>());
      else if (wrong.empty())
        wrong = std::string(name) + " holds " + Quote(JsonText(text)) + ", expected texts";
    }
    return texts;
  }
  /// A size that the peer will take, kept within what is sane.
  std::size_t FrameLimit() const {
    const std::int64_t asked = Whole("max_frame", static_cast<std::int64_t>(kLargestFrame));
    return static_cast<std::size_t>(std::clamp<std::int64_t>(asked, static_cast<std::int64_t>(kLargestBeforeWelcome),
                                                             static_cast<std::int64_t>(kLargestFrame)));
  }
  /// `value`, or MALFORMED where a member that was asked for is of another type.
  template <class T>
  Result<T> Checked(const char* message, T value) const {
    if (wrong.empty()) return value;
    return Fault("MALFORMED", std::string(message) + ": " + wrong);
  }
};

}  // namespace consac::protocol2
