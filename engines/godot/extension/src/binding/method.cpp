#include "binding/method.h"

namespace consac::godot {
namespace {

bool Refuse(GDExtensionCallError* error, GDExtensionCallErrorType kind, GDExtensionInt argument,
            GDExtensionInt expected) {
  error->error = kind;
  error->argument = static_cast<std::int32_t>(argument);
  error->expected = static_cast<std::int32_t>(expected);
  return false;
}

}  // namespace

void Instance::Report(const std::string& where, const Status& status) {
  last_error_ = status.message();
  PrintError(where, last_error_);
}

bool CheckArguments(const Method& method, const void* instance, const GDExtensionConstVariantPtr* arguments,
                    GDExtensionInt count, GDExtensionCallError* error) {
  const auto expected = static_cast<GDExtensionInt>(method.argument_types.size());
  if (instance == nullptr) return Refuse(error, GDEXTENSION_CALL_ERROR_INSTANCE_IS_NULL, 0, 0);
  if (count < expected) return Refuse(error, GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS, count, expected);
  if (count > expected) return Refuse(error, GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS, count, expected);
  for (GDExtensionInt i = 0; i < count; ++i) {
    const GDExtensionVariantType wanted = method.argument_types[static_cast<std::size_t>(i)];
    const GDExtensionVariantType given = engine.variant_get_type(arguments[i]);
    if (given != wanted && engine.variant_can_convert_strict(given, wanted) == 0) {
      return Refuse(error, GDEXTENSION_CALL_ERROR_INVALID_ARGUMENT, i, wanted);
    }
  }
  error->error = GDEXTENSION_CALL_OK;
  return true;
}

}  // namespace consac::godot
