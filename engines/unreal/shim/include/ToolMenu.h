#pragma once
#include <map>

#include "ToolMenuSection.h"
#include "UObject/Object.h"

class UToolMenu : public UObject {
  SHIM_CLASS(UToolMenu, UObject)
  FToolMenuSection& FindOrAddSection(const FName name, const FText& label) {
    FToolMenuSection& section = shim_sections_[*name.ToString()];
    section.shim_label_ = label;
    return section;
  }
  std::map<std::u16string, FToolMenuSection> shim_sections_;
};
