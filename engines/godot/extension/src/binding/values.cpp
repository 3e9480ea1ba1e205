#include "binding/values.h"

namespace consac::godot {
namespace {

// The hashes stand for the methods' signatures; the engine's extension_api.json lists them.
constexpr GDExtensionInt kSizeHash = 3173160232, kResizeHash = 848867239, kKeysHash = 4144163970;

GDExtensionPtrBuiltInMethod MethodOf(GDExtensionVariantType type, const char* name, GDExtensionInt hash) {
  return engine.variant_get_ptr_builtin_method(type, StringName(name).ptr(), hash);
}

std::size_t SizeOfBuiltin(GDExtensionPtrBuiltInMethod method, const void* self) {
  std::int64_t size = 0;
  method(const_cast<void*>(self), nullptr, &size, 0);
  return static_cast<std::size_t>(size);
}

void Resize(GDExtensionPtrBuiltInMethod method, void* self, std::size_t size) {
  const auto wanted = static_cast<std::int64_t>(size);
  const std::array<GDExtensionConstTypePtr, 1> arguments{&wanted};
  std::int64_t error = 0;
  method(self, arguments.data(), &error, 1);
}

template <class T>
std::size_t PackedSize(const T& array) {
  static const GDExtensionPtrBuiltInMethod method = MethodOf(T::kType, "size", kSizeHash);
  return SizeOfBuiltin(method, array.ptr());
}

// The engine does not say whether growing an array fills it.
template <class T>
T ZerosOf(std::size_t count) {
  static const GDExtensionPtrBuiltInMethod method = MethodOf(T::kType, "resize", kResizeHash);
  T array;
  Resize(method, array.ptr(), count);
  const auto values = array.writable();
  std::fill(values.begin(), values.end(), 0);
  return array;
}

template <class T>
Variant Wrap(GDExtensionVariantType type, T& value) {
  Variant variant;
  FunctionsOf(type).to_variant(variant.ptr(), &value);
  return variant;
}

}  // namespace

const BuiltinFunctions& FunctionsOf(GDExtensionVariantType type) {
  static const std::vector<BuiltinFunctions> all = [] {
    std::vector<BuiltinFunctions> found(GDEXTENSION_VARIANT_TYPE_VARIANT_MAX);
    for (int i = 1; i < GDEXTENSION_VARIANT_TYPE_VARIANT_MAX; ++i) {
      const auto each = static_cast<GDExtensionVariantType>(i);
      found[static_cast<std::size_t>(i)] = {
          engine.variant_get_ptr_constructor(each, 0), engine.variant_get_ptr_constructor(each, 1),
          engine.variant_get_ptr_destructor(each), engine.get_variant_from_type_constructor(each),
          engine.get_variant_to_type_constructor(each)};
    }
    return found;
  }();
  return all[static_cast<std::size_t>(type)];
}

String::String(std::string_view text) {
  FunctionsOf(kType).destroy(ptr());
  engine.string_new_with_utf8_chars_and_len2(ptr(), text.data(), static_cast<GDExtensionInt>(text.size()));
}

std::string String::utf8() const {
  const GDExtensionInt size = engine.string_to_utf8_chars(ptr(), nullptr, 0);
  std::string text(static_cast<std::size_t>(size), '\0');
  engine.string_to_utf8_chars(ptr(), text.data(), size);
  return text;
}

StringName::StringName(const char* text) {
  FunctionsOf(kType).destroy(ptr());
  engine.string_name_new_with_utf8_chars(ptr(), text);
}

Floats Floats::OfSize(std::size_t count) {
  return ZerosOf<Floats>(count);
}

std::span<const float> Floats::span() const {
  const std::size_t size = PackedSize(*this);
  if (size == 0) return {};
  return {engine.packed_float32_array_operator_index_const(ptr(), 0), size};
}

std::span<float> Floats::writable() {
  const std::size_t size = PackedSize(*this);
  if (size == 0) return {};
  return {engine.packed_float32_array_operator_index(ptr(), 0), size};
}

Doubles Doubles::Of(std::span<const double> numbers) {
  Doubles array = ZerosOf<Doubles>(numbers.size());
  std::copy(numbers.begin(), numbers.end(), array.writable().begin());
  return array;
}

std::span<const double> Doubles::span() const {
  const std::size_t size = PackedSize(*this);
  if (size == 0) return {};
  return {engine.packed_float64_array_operator_index_const(ptr(), 0), size};
}

std::span<double> Doubles::writable() {
  const std::size_t size = PackedSize(*this);
  if (size == 0) return {};
  return {engine.packed_float64_array_operator_index(ptr(), 0), size};
}

Bytes Bytes::OfSize(std::size_t count) {
  return ZerosOf<Bytes>(count);
}

std::span<const std::uint8_t> Bytes::span() const {
  const std::size_t size = PackedSize(*this);
  if (size == 0) return {};
  return {engine.packed_byte_array_operator_index_const(ptr(), 0), size};
}

std::span<std::uint8_t> Bytes::writable() {
  const std::size_t size = PackedSize(*this);
  if (size == 0) return {};
  return {engine.packed_byte_array_operator_index(ptr(), 0), size};
}

Variant Variant::Copy(const void* raw) {
  Variant made{Raw{}};
  engine.variant_new_copy(made.ptr(), raw);
  return made;
}

Variant Variant::Of(std::int64_t value) {
  return Wrap(GDEXTENSION_VARIANT_TYPE_INT, value);
}
Variant Variant::Of(double value) {
  return Wrap(GDEXTENSION_VARIANT_TYPE_FLOAT, value);
}
Variant Variant::Of(bool value) {
  GDExtensionBool truth = value ? 1 : 0;
  return Wrap(GDEXTENSION_VARIANT_TYPE_BOOL, truth);
}
Variant Variant::Of(std::string_view value) {
  String text(value);
  return Wrap(GDEXTENSION_VARIANT_TYPE_STRING, text);
}
Variant Variant::Of(const Array& value) {
  Array copy(value);
  return Wrap(GDEXTENSION_VARIANT_TYPE_ARRAY, copy);
}
Variant Variant::Of(const Dictionary& value) {
  Dictionary copy(value);
  return Wrap(GDEXTENSION_VARIANT_TYPE_DICTIONARY, copy);
}

Variant Variant::Of(const Floats& value) {
  Floats copy(value);
  return Wrap(Floats::kType, copy);
}

std::string Variant::text() const {
  String text;
  engine.variant_stringify(ptr(), text.ptr());
  return text.utf8();
}

std::size_t Array::size() const {
  return PackedSize(*this);
}

Variant Array::element(std::size_t index) const {
  return Variant::Copy(engine.array_operator_index_const(ptr(), static_cast<GDExtensionInt>(index)));
}

void Array::Append(const Variant& value) {
  static const GDExtensionPtrBuiltInMethod method = MethodOf(kType, "resize", kResizeHash);
  const std::size_t end = size();
  Resize(method, ptr(), end + 1);
  void* place = engine.array_operator_index(ptr(), static_cast<GDExtensionInt>(end));
  engine.variant_destroy(place);
  engine.variant_new_copy(place, value.ptr());
}

std::vector<std::pair<std::string, Variant>> Dictionary::entries() const {
  static const GDExtensionPtrBuiltInMethod method = MethodOf(kType, "keys", kKeysHash);
  Array keys;
  method(const_cast<void*>(ptr()), nullptr, keys.ptr(), 0);
  std::vector<std::pair<std::string, Variant>> all;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const Variant key = keys.element(i);
    all.emplace_back(key.text(), Variant::Copy(engine.dictionary_operator_index_const(ptr(), key.ptr())));
  }
  return all;
}

void Dictionary::Set(std::string_view key, const Variant& value) {
  void* place = engine.dictionary_operator_index(ptr(), Variant::Of(key).ptr());
  engine.variant_destroy(place);
  engine.variant_new_copy(place, value.ptr());
}

std::string TypeName(GDExtensionVariantType type) {
  String name;
  engine.variant_get_type_name(type, name.ptr());
  return name.utf8();
}

}  // namespace consac::godot
