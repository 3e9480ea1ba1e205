#pragma once
// Reads a Dictionary that a script has written: every key is known, has its type, and is named in the error when not.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "binding/values.h"
#include "consac/base/status.h"

namespace consac::godot {

/// Takes values out of a Dictionary, key by key; what was wrong is told at the end, the first of it.
class Reader {
 public:
  /// `what` begins every error: "serve: ".
  Reader(const Dictionary& table, std::string what);

  /// A whole number.
  void Take(std::string_view key, std::int64_t* value);
  /// One that fits.
  void Take(std::string_view key, std::int32_t* value);
  /// A whole number that is not negative.
  void Take(std::string_view key, std::uint64_t* value);
  /// A finite number.
  void Take(std::string_view key, double* value);
  /// True or false.
  void Take(std::string_view key, bool* value);
  /// A String or StringName.
  void Take(std::string_view key, std::string* value);
  /// Further tables.
  void Take(std::string_view key, std::vector<Dictionary>* value);
  /// A table.
  void Take(std::string_view key, Dictionary* value);
  /// One number or an array of them.
  void Take(std::string_view key, std::vector<double>* value);
  /// An array of texts.
  void Take(std::string_view key, std::vector<std::string>* value);
  /// One of several words: {"wait", WhileLearning::kWait}, ...
  template <class E>
  void Take(std::string_view key, E* value, std::initializer_list<std::pair<std::string_view, E>> words) {
    std::vector<std::string_view> known;
    for (const auto& word : words) known.push_back(word.first);
    const std::size_t index = TakeWord(key, known);
    if (index < known.size()) *value = words.begin()[index].second;
  }
  /// A PackedByteArray.
  void Take(std::string_view key, Bytes* value);
  /// Whether the key is there.
  bool Has(std::string_view key) const;

  /// The first thing that was wrong; a key that nobody took is one.
  Status Finish() const;

 private:
  struct Item {
    std::string key;
    Variant value;
    bool taken = false;
  };
  const Variant* Find(std::string_view key);
  void Fail(std::string message);
  void Expected(std::string_view key, const Variant& value, std::string_view wanted);
  std::size_t TakeWord(std::string_view key, const std::vector<std::string_view>& words);
  bool Whole(std::string_view key, const Variant& value, std::int64_t low, std::int64_t high, std::int64_t* out);

  std::string what_;
  std::vector<Item> items_;
  std::vector<std::string> known_;
  Status status_;
};

/// Any value as a setting is written: "1e-4", "true", "64,64".
std::string SettingText(const Variant& value);

}  // namespace consac::godot
