#include "files.h"

#include "binding/values.h"
#include "consac/base/text.h"

namespace consac::godot {
namespace {

// The hashes stand for the methods' signatures; the engine's extension_api.json lists them.
constexpr GDExtensionInt kFileExistsHash = 2323990056, kGetFileAsBytesHash = 659035735, kGlobalizePathHash = 3135753539;

GDExtensionMethodBindPtr MethodOf(const char* class_name, const char* method, GDExtensionInt hash) {
  return engine.classdb_get_method_bind(StringName(class_name).ptr(), StringName(method).ptr(), hash);
}

template <class T>
bool CallWithPath(GDExtensionMethodBindPtr method, GDExtensionObjectPtr object, const String& path, T* result) {
  if (method == nullptr) return false;
  const std::array<GDExtensionConstTypePtr, 1> arguments{path.ptr()};
  engine.object_method_bind_ptrcall(method, object, arguments.data(), result);
  return true;
}

}  // namespace

Result<std::vector<std::byte>> ReadEngineFile(const std::string& path) {
  static const GDExtensionMethodBindPtr exists = MethodOf("FileAccess", "file_exists", kFileExistsHash);
  static const GDExtensionMethodBindPtr read = MethodOf("FileAccess", "get_file_as_bytes", kGetFileAsBytesHash);
  GDExtensionBool there = 0;
  Bytes bytes;
  const String engine_path(path);
  if (!CallWithPath(exists, nullptr, engine_path, &there) || there == 0)
    return Status{StatusCode::kNotFound, "there is no file " + Quote(path) + "; check the path"};
  if (!CallWithPath(read, nullptr, engine_path, &bytes))
    return Status{StatusCode::kInternal, "this Godot has no FileAccess.get_file_as_bytes; use Godot 4.4 or newer"};
  const auto view = std::as_bytes(bytes.span());
  return std::vector<std::byte>(view.begin(), view.end());
}

Result<std::string> PathToWrite(const std::string& path) {
  static const GDExtensionMethodBindPtr globalize = MethodOf("ProjectSettings", "globalize_path", kGlobalizePathHash);
  if (path.empty()) return Status{StatusCode::kInvalidArgument, "the path of the file to write is empty; give one"};
  GDExtensionObjectPtr settings = engine.global_get_singleton(StringName("ProjectSettings").ptr());
  String real;
  const bool done = settings != nullptr && CallWithPath(globalize, settings, String(path), &real);
  const std::string found = done ? real.utf8() : std::string();
  if (found.empty() || found.starts_with("res://") || found.starts_with("user://")) {
    return Status{StatusCode::kInvalidArgument,
                  Quote(path) + " cannot be written, as in an exported game no res:// can; use user://"};
  }
  return found;
}

}  // namespace consac::godot
