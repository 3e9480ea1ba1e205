#include "binding/engine.h"

#include <string>

namespace consac::godot {
namespace {

constexpr char kFile[] = "consac";  // the engine's log shows a file and a line beside every message

}  // namespace

bool Engine::Load(GDExtensionInterfaceGetProcAddress find, GDExtensionClassLibraryPtr token) {
  library = token;
  const char* missing = nullptr;
#define CONSAC_GODOT_FIND(type, name)         \
  name = reinterpret_cast<type>(find(#name)); \
  if (name == nullptr && missing == nullptr) missing = #name;
  CONSAC_GODOT_FUNCTIONS(CONSAC_GODOT_FIND)
#undef CONSAC_GODOT_FIND
  if (missing == nullptr) return true;
  PrintError("consac", std::string("this Godot has no function ") + missing + "; CONSAC needs Godot 4.4 or newer");
  return false;
}

void PrintError(std::string_view where, std::string_view message) {
  if (engine.print_error == nullptr) return;
  engine.print_error(std::string(message).c_str(), std::string(where).c_str(), kFile, 0, 1);
}

void PrintWarning(std::string_view where, std::string_view message) {
  if (engine.print_warning == nullptr) return;
  engine.print_warning(std::string(message).c_str(), std::string(where).c_str(), kFile, 0, 1);
}

}  // namespace consac::godot
