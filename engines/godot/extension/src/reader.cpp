#include "reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "consac/base/text.h"

namespace consac::godot {
namespace {

bool IsNumber(const Variant& value) {
  return value.type() == GDEXTENSION_VARIANT_TYPE_INT || value.type() == GDEXTENSION_VARIANT_TYPE_FLOAT;
}

bool IsText(const Variant& value) {
  return value.type() == GDEXTENSION_VARIANT_TYPE_STRING || value.type() == GDEXTENSION_VARIANT_TYPE_STRING_NAME;
}

bool IsArray(const Variant& value) {
  return value.type() == GDEXTENSION_VARIANT_TYPE_ARRAY ||
         (value.type() >= GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY &&
          value.type() <= GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY);
}

}  // namespace

Reader::Reader(const Dictionary& table, std::string what) : what_(std::move(what)) {
  for (auto& [key, value] : table.entries()) items_.push_back({std::move(key), std::move(value)});
}

const Variant* Reader::Find(std::string_view key) {
  known_.emplace_back(key);
  for (Item& item : items_) {
    if (item.key != key) continue;
    item.taken = true;
    return &item.value;
  }
  return nullptr;
}

bool Reader::Has(std::string_view key) const {
  return std::any_of(items_.begin(), items_.end(), [&](const Item& item) { return item.key == key; });
}

void Reader::Fail(std::string message) {
  if (status_.ok()) status_ = {StatusCode::kInvalidArgument, what_ + std::move(message)};
}

void Reader::Expected(std::string_view key, const Variant& value, std::string_view wanted) {
  Fail("'" + std::string(key) + "' is " + TypeName(value.type()) + " " + Quote(value.text()) + "; expected " +
       std::string(wanted));
}

bool Reader::Whole(std::string_view key, const Variant& value, std::int64_t low, std::int64_t high, std::int64_t* out) {
  const std::string wanted = "a whole number from " + std::to_string(low) + " to " + std::to_string(high);
  if (!IsNumber(value)) {
    Expected(key, value, wanted);
    return false;
  }
  if (value.type() == GDEXTENSION_VARIANT_TYPE_FLOAT) {
    const double number = value.As<double>();
    if (number != std::floor(number) || std::abs(number) > 9e15) {
      Expected(key, value, wanted);
      return false;
    }
  }
  const auto number = value.As<std::int64_t>();
  if (number < low || number > high) {
    Expected(key, value, wanted);
    return false;
  }
  *out = number;
  return true;
}

void Reader::Take(std::string_view key, std::int64_t* value) {
  if (const Variant* given = Find(key)) {
    Whole(key, *given, std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(), value);
  }
}

void Reader::Take(std::string_view key, std::int32_t* value) {
  std::int64_t number = 0;
  const Variant* given = Find(key);
  if (given != nullptr &&
      Whole(key, *given, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max(), &number)) {
    *value = static_cast<std::int32_t>(number);
  }
}

void Reader::Take(std::string_view key, std::uint64_t* value) {
  std::int64_t number = 0;
  const Variant* given = Find(key);
  if (given != nullptr && Whole(key, *given, 0, std::numeric_limits<std::int64_t>::max(), &number)) {
    *value = static_cast<std::uint64_t>(number);
  }
}

void Reader::Take(std::string_view key, double* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  if (!IsNumber(*given) || !std::isfinite(given->As<double>())) return Expected(key, *given, "a finite number");
  *value = given->As<double>();
}

void Reader::Take(std::string_view key, bool* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  if (given->type() != GDEXTENSION_VARIANT_TYPE_BOOL) return Expected(key, *given, "true or false");
  *value = given->As<bool>();
}

void Reader::Take(std::string_view key, std::string* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  if (!IsText(*given)) return Expected(key, *given, "a String");
  *value = given->As<String>().utf8();
}

void Reader::Take(std::string_view key, Dictionary* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  if (given->type() != GDEXTENSION_VARIANT_TYPE_DICTIONARY) return Expected(key, *given, "a Dictionary");
  *value = given->As<Dictionary>();
}

void Reader::Take(std::string_view key, std::vector<Dictionary>* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  if (given->type() != GDEXTENSION_VARIANT_TYPE_ARRAY) return Expected(key, *given, "an Array of Dictionaries");
  const Array all = given->As<Array>();
  value->clear();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Variant each = all.element(i);
    if (each.type() != GDEXTENSION_VARIANT_TYPE_DICTIONARY) return Expected(key, each, "an Array of Dictionaries");
    value->push_back(each.As<Dictionary>());
  }
}

void Reader::Take(std::string_view key, std::vector<double>* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  const bool one = IsNumber(*given);
  if (!one && !IsArray(*given)) return Expected(key, *given, "a number or an array of numbers");
  Array all;
  if (one) {
    all.Append(*given);
  } else {
    all = given->As<Array>();
  }
  value->clear();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Variant each = all.element(i);
    if (!IsNumber(each)) return Expected(key, each, "numbers only");
    value->push_back(each.As<double>());
  }
}

void Reader::Take(std::string_view key, std::vector<std::string>* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  if (!IsArray(*given)) return Expected(key, *given, "an array of Strings");
  const Array all = given->As<Array>();
  value->clear();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Variant each = all.element(i);
    if (!IsText(each)) return Expected(key, each, "Strings only");
    value->push_back(each.As<String>().utf8());
  }
}

void Reader::Take(std::string_view key, Bytes* value) {
  const Variant* given = Find(key);
  if (given == nullptr) return;
  if (given->type() != Bytes::kType) return Expected(key, *given, "a PackedByteArray");
  *value = given->As<Bytes>();
}

std::size_t Reader::TakeWord(std::string_view key, const std::vector<std::string_view>& words) {
  const Variant* given = Find(key);
  if (given == nullptr) return words.size();
  const std::string text = given->text();
  const auto found = std::find(words.begin(), words.end(), text);
  if (IsText(*given) && found != words.end()) return static_cast<std::size_t>(found - words.begin());
  Expected(key, *given, "one of " + Join(words));
  return words.size();
}

Status Reader::Finish() const {
  if (!status_.ok()) return status_;
  const std::vector<std::string_view> known(known_.begin(), known_.end());
  for (const Item& item : items_) {
    if (item.taken) continue;
    return {StatusCode::kInvalidArgument, what_ + "unknown key " + Quote(item.key) + Suggestion(item.key, known)};
  }
  return Status::Ok();
}

std::string SettingText(const Variant& value) {
  if (value.type() == GDEXTENSION_VARIANT_TYPE_FLOAT) return NumberText(value.As<double>());
  if (!IsArray(value)) return value.text();
  const Array all = value.As<Array>();
  std::string text;
  for (std::size_t i = 0; i < all.size(); ++i) text += (i > 0 ? "," : "") + SettingText(all.element(i));
  return text;
}

}  // namespace consac::godot
