#pragma once
// What a block of a network says of itself besides its sizes: a kernel's geometry, a normaliser's epsilon. Each value
// is kept as its JSON text, so that the model file keeps whatever a block has, known to this program or not.

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace consac::nn {

/// Values by name.
class Attributes {
 public:
  /// A whole number.
  void SetInteger(std::string name, std::int64_t value);
  /// A number; reads back as exactly this.
  void SetNumber(std::string name, double value);
  /// A text.
  void SetText(std::string name, std::string_view value);
  /// A list of whole numbers.
  void SetIntegers(std::string name, std::span<const std::int64_t> values);
  /// JSON as it is; the caller has checked it.
  void SetJson(std::string name, std::string json);

  /// The whole number of that name; nothing where there is none or something else.
  std::optional<std::int64_t> Integer(std::string_view name) const;
  /// The number of that name.
  std::optional<double> Number(std::string_view name) const;
  /// The text of that name.
  std::optional<std::string> Text(std::string_view name) const;
  /// The list of whole numbers of that name.
  std::optional<std::vector<std::int64_t>> Integers(std::string_view name) const;
  /// True when there is a value of that name, of whatever kind.
  bool contains(std::string_view name) const { return json_.contains(name); }

  /// All of them as JSON texts, by name.
  const std::map<std::string, std::string, std::less<>>& json() const { return json_; }
  friend bool operator==(const Attributes&, const Attributes&) = default;

 private:
  std::map<std::string, std::string, std::less<>> json_;
};

}  // namespace consac::nn
