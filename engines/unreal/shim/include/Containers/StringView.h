#pragma once
#include "Shim/Macros.h"

/// A part of a text that somebody else keeps.
class FStringView {
 public:
  FStringView(const TCHAR* text, int32 count) : text_(text), count_(count) {}
  const TCHAR* GetData() const { return text_; }
  int32 Len() const { return count_; }

 private:
  const TCHAR* text_;
  int32 count_;
};
