#include "binding/class.h"

namespace consac::godot {
namespace {

constexpr std::uint32_t kUsageDefault = 6;  // PROPERTY_USAGE_DEFAULT

GDExtensionObjectPtr CreateInstance(void* userdata, GDExtensionBool) {
  const auto& table = *static_cast<const ClassTable*>(userdata);
  GDExtensionObjectPtr object = engine.classdb_construct_object2(StringName("RefCounted").ptr());
  engine.object_set_instance(object, StringName(table.name.c_str()).ptr(), table.make());
  return object;
}

void FreeInstance(void*, GDExtensionClassInstancePtr instance) {
  delete static_cast<Instance*>(instance);
}

// The names that a method's argument or result is described by; they must live until it is registered.
struct Description {
  StringName name, class_name;
  String hint;
  GDExtensionVariantType type;

  Description(const std::string& text, GDExtensionVariantType of) : name(text.c_str()), type(of) {}
  GDExtensionPropertyInfo info() { return {type, name.ptr(), class_name.ptr(), 0, hint.ptr(), kUsageDefault}; }
};

void RegisterMethod(const StringName& class_name, Method& method) {
  StringName name(method.name.c_str());
  Description result("", method.result);
  GDExtensionPropertyInfo result_info = result.info();
  std::vector<Description> arguments;
  std::vector<GDExtensionPropertyInfo> infos;
  for (std::size_t i = 0; i < method.argument_types.size(); ++i) {
    arguments.emplace_back(method.argument_names[i], method.argument_types[i]);
  }
  for (Description& argument : arguments) infos.push_back(argument.info());
  std::vector<GDExtensionClassMethodArgumentMetadata> metadata(infos.size(), GDEXTENSION_METHOD_ARGUMENT_METADATA_NONE);

  GDExtensionClassMethodInfo info{};
  info.name = name.ptr();
  info.method_userdata = &method;
  info.call_func = method.call;
  info.ptrcall_func = method.ptrcall;
  info.method_flags = GDEXTENSION_METHOD_FLAGS_DEFAULT;
  info.has_return_value = method.result != GDEXTENSION_VARIANT_TYPE_NIL ? 1 : 0;
  info.return_value_info = &result_info;
  info.argument_count = static_cast<std::uint32_t>(infos.size());
  info.arguments_info = infos.data();
  info.arguments_metadata = metadata.data();
  engine.classdb_register_extension_class_method(engine.library, class_name.ptr(), &info);
}

}  // namespace

namespace {

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string MethodHelp(const Method& method) {
  const auto type = [](GDExtensionVariantType of) {
    return of == GDEXTENSION_VARIANT_TYPE_NIL ? std::string("void") : TypeName(of);
  };
  std::string text = "<method name=\"" + method.name + "\"><return type=\"" + type(method.result) + "\"/>";
  for (std::size_t i = 0; i < method.argument_types.size(); ++i) {
    text += "<param index=\"" + std::to_string(i) + "\" name=\"" + method.argument_names[i] + "\" type=\"" +
            type(method.argument_types[i]) + "\"/>";
  }
  return text + "<description>" + Escaped(method.help) + "</description></method>";
}

}  // namespace

std::string HelpOf(const ClassTable& table) {
  std::string text = "<class name=\"" + table.name + "\" inherits=\"RefCounted\"><brief_description>" +
                     Escaped(table.brief) + "</brief_description><description>" + Escaped(table.help) +
                     "</description><methods>";
  for (const Method& method : table.methods) text += MethodHelp(method);
  text += "</methods><constants>";
  for (const Constant& constant : table.constants) {
    text += "<constant name=\"" + constant.name + "\" value=\"" + std::to_string(constant.value) + "\" enum=\"" +
            constant.group + "\">" + Escaped(constant.help) + "</constant>";
  }
  return text + "</constants></class>";
}

RegisteredClass::RegisteredClass(ClassTable table) : table_(std::move(table)), name_(table_.name.c_str()) {
  GDExtensionClassCreationInfo4 info{};
  info.is_exposed = 1;
  info.create_instance_func = &CreateInstance;
  info.free_instance_func = &FreeInstance;
  info.class_userdata = &table_;
  engine.classdb_register_extension_class4(engine.library, name_.ptr(), StringName("RefCounted").ptr(), &info);
  for (Method& method : table_.methods) {
    method.where = table_.name + "." + method.name;
    RegisterMethod(name_, method);
  }
  for (const Constant& constant : table_.constants) {
    engine.classdb_register_extension_class_integer_constant(
        engine.library, name_.ptr(), StringName(constant.group.c_str()).ptr(), StringName(constant.name.c_str()).ptr(),
        constant.value, 0);
  }
}

RegisteredClass::~RegisteredClass() {
  engine.classdb_unregister_extension_class(engine.library, name_.ptr());
}

}  // namespace consac::godot
