#pragma once
// The engine's C interface: the functions that this extension uses, found by name when the library is loaded.
// Everything else here stands on it. One process, one engine: hence one object.

#include <string_view>

#include "gdextension_interface.h"

namespace consac::godot {

/// Every function that is used: its type and its name; the one place to add one.
#define CONSAC_GODOT_FUNCTIONS(X)                                                                            \
  X(GDExtensionInterfacePrintError, print_error)                                                             \
  X(GDExtensionInterfacePrintWarning, print_warning)                                                         \
  X(GDExtensionInterfaceVariantNewNil, variant_new_nil)                                                      \
  X(GDExtensionInterfaceVariantNewCopy, variant_new_copy)                                                    \
  X(GDExtensionInterfaceVariantDestroy, variant_destroy)                                                     \
  X(GDExtensionInterfaceVariantGetType, variant_get_type)                                                    \
  X(GDExtensionInterfaceVariantCanConvertStrict, variant_can_convert_strict)                                 \
  X(GDExtensionInterfaceVariantGetTypeName, variant_get_type_name)                                           \
  X(GDExtensionInterfaceVariantStringify, variant_stringify)                                                 \
  X(GDExtensionInterfaceGetVariantFromTypeConstructor, get_variant_from_type_constructor)                    \
  X(GDExtensionInterfaceGetVariantToTypeConstructor, get_variant_to_type_constructor)                        \
  X(GDExtensionInterfaceVariantGetPtrConstructor, variant_get_ptr_constructor)                               \
  X(GDExtensionInterfaceVariantGetPtrDestructor, variant_get_ptr_destructor)                                 \
  X(GDExtensionInterfaceVariantGetPtrBuiltinMethod, variant_get_ptr_builtin_method)                          \
  X(GDExtensionInterfaceVariantGetPtrUtilityFunction, variant_get_ptr_utility_function)                      \
  X(GDExtensionInterfaceStringNewWithUtf8CharsAndLen2, string_new_with_utf8_chars_and_len2)                  \
  X(GDExtensionInterfaceStringToUtf8Chars, string_to_utf8_chars)                                             \
  X(GDExtensionInterfaceStringNameNewWithUtf8Chars, string_name_new_with_utf8_chars)                         \
  X(GDExtensionInterfacePackedByteArrayOperatorIndex, packed_byte_array_operator_index)                      \
  X(GDExtensionInterfacePackedByteArrayOperatorIndexConst, packed_byte_array_operator_index_const)           \
  X(GDExtensionInterfacePackedFloat32ArrayOperatorIndex, packed_float32_array_operator_index)                \
  X(GDExtensionInterfacePackedFloat32ArrayOperatorIndexConst, packed_float32_array_operator_index_const)     \
  X(GDExtensionInterfacePackedFloat64ArrayOperatorIndex, packed_float64_array_operator_index)                \
  X(GDExtensionInterfacePackedFloat64ArrayOperatorIndexConst, packed_float64_array_operator_index_const)     \
  X(GDExtensionInterfaceArrayOperatorIndex, array_operator_index)                                            \
  X(GDExtensionInterfaceArrayOperatorIndexConst, array_operator_index_const)                                 \
  X(GDExtensionInterfaceDictionaryOperatorIndex, dictionary_operator_index)                                  \
  X(GDExtensionInterfaceDictionaryOperatorIndexConst, dictionary_operator_index_const)                       \
  X(GDExtensionInterfaceGlobalGetSingleton, global_get_singleton)                                            \
  X(GDExtensionsInterfaceEditorHelpLoadXmlFromUtf8CharsAndLen, editor_help_load_xml_from_utf8_chars_and_len) \
  X(GDExtensionInterfaceObjectMethodBindPtrcall, object_method_bind_ptrcall)                                 \
  X(GDExtensionInterfaceObjectSetInstance, object_set_instance)                                              \
  X(GDExtensionInterfaceClassdbConstructObject2, classdb_construct_object2)                                  \
  X(GDExtensionInterfaceClassdbGetMethodBind, classdb_get_method_bind)                                       \
  X(GDExtensionInterfaceClassdbRegisterExtensionClass4, classdb_register_extension_class4)                   \
  X(GDExtensionInterfaceClassdbRegisterExtensionClassMethod, classdb_register_extension_class_method)        \
  X(GDExtensionInterfaceClassdbRegisterExtensionClassIntegerConstant,                                        \
    classdb_register_extension_class_integer_constant)                                                       \
  X(GDExtensionInterfaceClassdbUnregisterExtensionClass, classdb_unregister_extension_class)

/// The functions, and which library the engine knows us as.
struct Engine {
#define CONSAC_GODOT_MEMBER(type, name) type name = nullptr;
  CONSAC_GODOT_FUNCTIONS(CONSAC_GODOT_MEMBER)
#undef CONSAC_GODOT_MEMBER
  GDExtensionClassLibraryPtr library = nullptr;  ///< our own token

  /// Finds all functions. False, with a line in the engine's log, when this engine lacks one: it is too old.
  bool Load(GDExtensionInterfaceGetProcAddress find, GDExtensionClassLibraryPtr token);
};

/// The engine that has loaded us.
inline Engine engine;

/// Writes an error into the engine's log and its debugger; `where` is "ConsacWorld.serve". Any thread.
void PrintError(std::string_view where, std::string_view message);
/// The same for a warning.
void PrintWarning(std::string_view where, std::string_view message);

}  // namespace consac::godot
