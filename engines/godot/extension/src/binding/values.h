#pragma once
// The engine's own values as C++ values: Variant, String (as UTF-8), Array, Dictionary and the packed arrays that
// observations and poses travel in. Each owns what it holds; copies share the content where the engine's do.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "binding/engine.h"

namespace consac::godot {

static_assert(sizeof(void*) == 8, "the engine's values have these sizes on 64-bit machines only");

/// Constructors and destructor of a built-in type, looked up once.
struct BuiltinFunctions {
  GDExtensionPtrConstructor make = nullptr;                          ///< of an empty value
  GDExtensionPtrConstructor copy = nullptr;                          ///< of another
  GDExtensionPtrDestructor destroy = nullptr;                        ///< null: nothing to do
  GDExtensionVariantFromTypeConstructorFunc to_variant = nullptr;    ///< a Variant that holds it
  GDExtensionTypeFromVariantConstructorFunc from_variant = nullptr;  ///< what a Variant holds, converted
};
/// Those of `type`.
const BuiltinFunctions& FunctionsOf(GDExtensionVariantType type);

/// A value of the engine that lives in `size` bytes of ours.
template <GDExtensionVariantType type, std::size_t size>
class Builtin {
 public:
  static constexpr GDExtensionVariantType kType = type;

  /// An empty one.
  Builtin() { FunctionsOf(type).make(storage_.data(), nullptr); }
  Builtin(const Builtin& other) : Builtin(other.ptr()) {}
  Builtin(Builtin&& other) noexcept : Builtin() { storage_.swap(other.storage_); }
  Builtin& operator=(Builtin other) noexcept {
    storage_.swap(other.storage_);
    return *this;
  }
  ~Builtin() {
    if (FunctionsOf(type).destroy != nullptr) FunctionsOf(type).destroy(storage_.data());
  }
  /// A copy of the engine's value at `raw`.
  explicit Builtin(const void* raw) {
    const std::array<GDExtensionConstTypePtr, 1> from{raw};
    FunctionsOf(type).copy(storage_.data(), from.data());
  }

  /// Where the engine finds it.
  void* ptr() { return storage_.data(); }
  /// The same.
  const void* ptr() const { return storage_.data(); }
  /// Puts it in the place of the engine's value at `raw`.
  void MoveTo(void* raw) { std::swap_ranges(storage_.begin(), storage_.end(), static_cast<std::byte*>(raw)); }

 private:
  alignas(8) std::array<std::byte, size> storage_;
};

/// The engine's String.
class String : public Builtin<GDEXTENSION_VARIANT_TYPE_STRING, 8> {
 public:
  using Builtin::Builtin;
  /// Of UTF-8 text.
  explicit String(std::string_view text);
  /// As UTF-8.
  std::string utf8() const;
};

/// The engine's StringName.
class StringName : public Builtin<GDEXTENSION_VARIANT_TYPE_STRING_NAME, 8> {
 public:
  using Builtin::Builtin;
  /// Of UTF-8 text.
  explicit StringName(const char* text);
};

/// PackedFloat32Array.
class Floats : public Builtin<GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT32_ARRAY, 16> {
 public:
  using Builtin::Builtin;
  /// `count` zeros.
  static Floats OfSize(std::size_t count);
  /// What it holds; valid while it lives and is not written.
  std::span<const float> span() const;
  /// To write into; a content that others share is copied first.
  std::span<float> writable();
};

/// PackedFloat64Array.
class Doubles : public Builtin<GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT64_ARRAY, 16> {
 public:
  using Builtin::Builtin;
  /// A copy of `numbers`.
  static Doubles Of(std::span<const double> numbers);
  /// What it holds; valid while it lives and is not written.
  std::span<const double> span() const;
  /// To write into; a content that others share is copied first.
  std::span<double> writable();
};

/// PackedByteArray.
class Bytes : public Builtin<GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY, 16> {
 public:
  using Builtin::Builtin;
  /// `count` zeros.
  static Bytes OfSize(std::size_t count);
  /// What it holds; valid while it lives and is not written.
  std::span<const std::uint8_t> span() const;
  /// To write into; a content that others share is copied first.
  std::span<std::uint8_t> writable();
};

class Array;
class Dictionary;

/// Anything that a script can hold.
class Variant {
 public:
  Variant() { engine.variant_new_nil(storage_.data()); }
  Variant(const Variant& other) : Variant(Copy(other.ptr())) {}
  Variant(Variant&& other) noexcept : Variant() { storage_.swap(other.storage_); }
  Variant& operator=(Variant other) noexcept {
    storage_.swap(other.storage_);
    return *this;
  }
  ~Variant() { engine.variant_destroy(storage_.data()); }
  /// A copy of the engine's Variant at `raw`.
  static Variant Copy(const void* raw);
  /// Holding a number, a truth, a text, a list or a table.
  static Variant Of(std::int64_t value);
  static Variant Of(double value);
  static Variant Of(bool value);
  static Variant Of(std::string_view value);
  static Variant Of(const Array& value);
  static Variant Of(const Dictionary& value);
  static Variant Of(const Floats& value);

  /// What it holds.
  GDExtensionVariantType type() const { return engine.variant_get_type(storage_.data()); }
  /// As people would print it.
  std::string text() const;
  /// The value converted to T (Builtin, std::int64_t, double, bool); type() has been looked at.
  template <class T>
  T As() const;
  /// Where the engine finds it.
  void* ptr() { return storage_.data(); }
  /// The same.
  const void* ptr() const { return storage_.data(); }

 private:
  struct Raw {};
  explicit Variant(Raw) {}
  alignas(8) std::array<std::byte, 40> storage_;  // 24, or 40 in an engine built for double precision
};

/// The engine's Array.
class Array : public Builtin<GDEXTENSION_VARIANT_TYPE_ARRAY, 8> {
 public:
  using Builtin::Builtin;
  /// How many.
  std::size_t size() const;
  /// The element; index < size().
  Variant element(std::size_t index) const;
  /// Makes it one longer.
  void Append(const Variant& value);
};

/// The engine's Dictionary.
class Dictionary : public Builtin<GDEXTENSION_VARIANT_TYPE_DICTIONARY, 8> {
 public:
  using Builtin::Builtin;
  /// Its keys as they would be printed, with their values, in order.
  std::vector<std::pair<std::string, Variant>> entries() const;
  /// Sets the value of a key.
  void Set(std::string_view key, const Variant& value);
};

template <class T>
T Variant::As() const {
  if constexpr (std::is_same_v<T, std::int64_t>) {
    std::int64_t value = 0;
    FunctionsOf(GDEXTENSION_VARIANT_TYPE_INT).from_variant(&value, const_cast<std::byte*>(storage_.data()));
    return value;
  } else if constexpr (std::is_same_v<T, double>) {
    double value = 0.0;
    FunctionsOf(GDEXTENSION_VARIANT_TYPE_FLOAT).from_variant(&value, const_cast<std::byte*>(storage_.data()));
    return value;
  } else if constexpr (std::is_same_v<T, bool>) {
    GDExtensionBool value = 0;
    FunctionsOf(GDEXTENSION_VARIANT_TYPE_BOOL).from_variant(&value, const_cast<std::byte*>(storage_.data()));
    return value != 0;
  } else {
    alignas(8) std::array<std::byte, sizeof(T)> raw;
    FunctionsOf(T::kType).from_variant(raw.data(), const_cast<std::byte*>(storage_.data()));
    T value;
    value.MoveTo(raw.data());
    FunctionsOf(T::kType).destroy(raw.data());
    return value;
  }
}

/// "int", "Dictionary", ... as scripts call the type.
std::string TypeName(GDExtensionVariantType type);

}  // namespace consac::godot
