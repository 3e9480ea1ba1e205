#pragma once
#include "IAssetTools.h"

class FAssetToolsModule {
 public:
  static FAssetToolsModule& GetModule() {
    static FAssetToolsModule module;
    return module;
  }
  IAssetTools& Get() const {
    static IAssetTools tools;
    return tools;
  }
};
