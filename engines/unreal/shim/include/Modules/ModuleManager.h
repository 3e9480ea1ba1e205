#pragma once
#include "CoreMinimal.h"

class IModuleInterface {
 public:
  virtual ~IModuleInterface() = default;
  virtual void StartupModule() {}
  virtual void ShutdownModule() {}
};
class FDefaultModuleImpl : public IModuleInterface {};

namespace Shim {
/// Keeps a module for StartModules.
int AddModule(const char* name, IModuleInterface& module);
/// What the engine does at its start and its end.
void StartModules();
void StopModules();
}  // namespace Shim

#define IMPLEMENT_MODULE(type, name) \
  static type shim_module_of_##name; \
  [[maybe_unused]] static const int shim_number_of_##name = Shim::AddModule(#name, shim_module_of_##name);
