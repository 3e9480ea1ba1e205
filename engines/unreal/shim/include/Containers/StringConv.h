#pragma once
#include "CoreMinimal.h"

/// UTF-16 as UTF-8, for as long as it lives.
class FTCHARToUTF8 {
 public:
  explicit FTCHARToUTF8(const TCHAR* text) : text_(Shim::Narrow(text)) {}
  FTCHARToUTF8(const FTCHARToUTF8&) = delete;
  FTCHARToUTF8& operator=(const FTCHARToUTF8&) = delete;
  const char* Get() const { return text_.c_str(); }
  int32 Length() const { return static_cast<int32>(text_.size()); }

 private:
  std::string text_;
};

/// UTF-8 as UTF-16, for as long as it lives. The text need not end with a zero.
class FUTF8ToTCHAR {
 public:
  FUTF8ToTCHAR(const char* text, int32 length) : text_(Shim::Wide({text, static_cast<std::size_t>(length)})) {}
  FUTF8ToTCHAR(const FUTF8ToTCHAR&) = delete;
  FUTF8ToTCHAR& operator=(const FUTF8ToTCHAR&) = delete;
  const TCHAR* Get() const { return text_.c_str(); }
  int32 Length() const { return static_cast<int32>(text_.size()); }

 private:
  std::u16string text_;
};

#define TCHAR_TO_UTF8(text) (FTCHARToUTF8(text).Get())
#define UTF8_TO_TCHAR(text) (FUTF8ToTCHAR(text, static_cast<int32>(std::char_traits<char>::length(text))).Get())
