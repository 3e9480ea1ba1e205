#pragma once
// FString, FName, FText.

#include <algorithm>
#include <compare>
#include <string>

#include "Containers/StringView.h"
#include "Shim/Format.h"
#include "Shim/Macros.h"

namespace Shim {
/// ASCII in small letters; Unreal folds no other letters in names.
inline std::u16string Lower(std::u16string_view text) {
  std::u16string lower(text);
  for (char16_t& c : lower) c = c >= u'A' && c <= u'Z' ? static_cast<char16_t>(c + 32) : c;
  return lower;
}
}  // namespace Shim

/// Text in UTF-16. No narrow literals: Unreal takes them as Latin-1 at best.
class FString {
 public:
  FString() = default;
  FString(const TCHAR* text) : text_(text != nullptr ? text : u"") {}
  explicit FString(FStringView text) : text_(text.GetData(), static_cast<std::size_t>(text.Len())) {}
  SHIM_DEPRECATED("since 5.4; FString(FStringView(text, count)) is one of all versions")
  FString(int32 count, const TCHAR* text) : FString(FStringView(text, count)) {}
  FString(const char*) = delete;
  const TCHAR* operator*() const { return text_.c_str(); }
  bool IsEmpty() const { return text_.empty(); }
  int32 Len() const { return static_cast<int32>(text_.size()); }
  template <std::size_t N, class... T>
  static FString Printf(const TCHAR (&format)[N], T... arguments) {
    return FString(Shim::Format(format, {Shim::ArgumentOf(arguments)...}).c_str());
  }
  FString ToLower() const { return FString(Shim::Lower(text_).c_str()); }
  bool Contains(const TCHAR* part) const { return Shim::Lower(text_).find(Shim::Lower(part)) != std::u16string::npos; }
  /// Without so many letters of its beginning.
  FString RightChop(int32 count) const {
    return FString(text_.substr(std::min(static_cast<std::size_t>(count), text_.size())).c_str());
  }
  /// Without case, as the engine compares.
  friend bool operator==(const FString& a, const FString& b) { return Shim::Lower(a.text_) == Shim::Lower(b.text_); }

 private:
  std::u16string text_;
};

namespace Shim {
/// The one spelling of a name, in whatever case it is asked for: that of who came first, as in a packaged game.
const std::u16string* SpellingOf(std::u16string_view text);
}  // namespace Shim

/// A name: compared as a whole and without case.
class FName {
 public:
  FName() = default;
  FName(const TCHAR* text) : spelling_(Shim::SpellingOf(text)) {}
  FName(const char*) = delete;
  FString ToString() const { return spelling_ == nullptr ? FString(u"None") : FString(spelling_->c_str()); }
  friend bool operator==(const FName& a, const FName& b) { return a.spelling_ == b.spelling_; }

 private:
  const std::u16string* spelling_ = nullptr;
};
inline const FName NAME_None;

/// Text that people read.
class FText {
 public:
  static FText FromString(const FString& text) {
    FText made;
    made.text_ = text;
    return made;
  }
  const FString& ShimToString() const { return text_; }

 private:
  FString text_;
};
