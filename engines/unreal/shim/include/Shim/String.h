#pragma once
// FString, FName, FText.

#include <compare>
#include <string>

#include "Shim/Format.h"
#include "Shim/Macros.h"

/// Text in UTF-16. No narrow literals: Unreal takes them as Latin-1 at best.
class FString {
 public:
  FString() = default;
  FString(const TCHAR* text) : text_(text != nullptr ? text : u"") {}
  FString(int32 count, const TCHAR* text) : text_(text, static_cast<std::size_t>(count)) {}
  FString(const char*) = delete;
  const TCHAR* operator*() const { return text_.c_str(); }
  bool IsEmpty() const { return text_.empty(); }
  int32 Len() const { return static_cast<int32>(text_.size()); }
  template <std::size_t N, class... T>
  static FString Printf(const TCHAR (&format)[N], T... arguments) {
    return FString(Shim::Format(format, {Shim::ArgumentOf(arguments)...}).c_str());
  }
  friend bool operator==(const FString& a, const FString& b) { return a.text_ == b.text_; }

 private:
  std::u16string text_;
};

/// A name: compared as a whole, without case in Unreal, with it here (stricter).
class FName {
 public:
  FName() = default;
  FName(const TCHAR* text) : text_(text) {}
  FName(const char*) = delete;
  FString ToString() const { return text_.empty() ? FString(u"None") : FString(text_.c_str()); }
  friend bool operator==(const FName& a, const FName& b) { return a.text_ == b.text_; }

 private:
  std::u16string text_;
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

 private:
  FString text_;
};
