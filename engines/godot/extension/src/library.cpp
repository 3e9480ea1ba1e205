// Where the engine enters: consac.gdextension names consac_godot_initialise.
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "binding/class.h"
#include "consac/base/hooks.h"
#include "interrupts.h"
#include "model.h"
#include "robot.h"
#include "world.h"

#if defined(_WIN32)
#define CONSAC_GODOT_EXPORT __declspec(dllexport)
#else
#define CONSAC_GODOT_EXPORT __attribute__((visibility("default")))
#endif

namespace consac::godot {
namespace {

// Every class that scripts see; the one place to add one.
constexpr ClassTable (*kClasses[])() = {&WorldTable, &ModelTable, &RobotTable};

std::vector<std::unique_ptr<RegisteredClass>> registered;

void LogLine(void*, LogLevel level, std::string_view line) {
  if (level == LogLevel::kError) PrintError("consac", line);
  if (level == LogLevel::kWarning) PrintWarning("consac", line);
}

void Assertion(void*, const char* expression, const char* file, int line) {
  PrintError("consac", std::string("assertion failed: ") + expression + " in " + file + ":" + std::to_string(line));
}

void Initialise(void*, GDExtensionInitializationLevel level) {
  if (level == GDEXTENSION_INITIALIZATION_EDITOR) {
    for (const auto table : kClasses) {
      const std::string help = HelpOf(table());
      engine.editor_help_load_xml_from_utf8_chars_and_len(help.data(), static_cast<GDExtensionInt>(help.size()));
    }
  }
  if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
  Hooks hooks;
  hooks.log = &LogLine;
  hooks.assertion = &Assertion;
  SetHooks(hooks);
  for (const auto table : kClasses) registered.push_back(std::make_unique<RegisteredClass>(table()));
}

void Deinitialise(void*, GDExtensionInitializationLevel level) {
  if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
  registered.clear();
  EndInterrupts();
  SetHooks(Hooks{});
}

}  // namespace
}  // namespace consac::godot

extern "C" CONSAC_GODOT_EXPORT GDExtensionBool consac_godot_initialise(GDExtensionInterfaceGetProcAddress find,
                                                                       GDExtensionClassLibraryPtr library,
                                                                       GDExtensionInitialization* initialization) {
  if (!consac::godot::engine.Load(find, library)) return 0;
  initialization->minimum_initialization_level = GDEXTENSION_INITIALIZATION_SCENE;
  initialization->userdata = nullptr;
  initialization->initialize = &consac::godot::Initialise;
  initialization->deinitialize = &consac::godot::Deinitialise;
  return 1;
}
