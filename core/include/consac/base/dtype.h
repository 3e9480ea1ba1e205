#pragma once
// The number types that cross a border: spaces, model files, checkpoints, the wire.

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace consac {

/// Element type of a leaf or tensor. Values are written to files and the wire: never renumber.
enum class DType : std::uint8_t {
  kF32 = 0,
  kF64 = 1,
  kU8 = 2,
  kI8 = 3,
  kI16 = 4,
  kI32 = 5,
  kI64 = 6,
  kU16 = 7,
  kU32 = 8,
  kU64 = 9,
  kBool = 10
};

/// Bytes of one element.
std::size_t SizeOf(DType dtype);
/// Safetensors' name: "F32", "U8", "BOOL", ...
std::string_view NameOf(DType dtype);
/// The reverse of NameOf; false when the name is unknown.
bool ParseDType(std::string_view name, DType* dtype);

/// The DType of a C++ type.
template <class T>
struct DTypeOf;
template <>
struct DTypeOf<float> {
  static constexpr DType value = DType::kF32;
};
template <>
struct DTypeOf<double> {
  static constexpr DType value = DType::kF64;
};
template <>
struct DTypeOf<std::uint8_t> {
  static constexpr DType value = DType::kU8;
};
template <>
struct DTypeOf<std::int8_t> {
  static constexpr DType value = DType::kI8;
};
template <>
struct DTypeOf<std::int16_t> {
  static constexpr DType value = DType::kI16;
};
template <>
struct DTypeOf<std::int32_t> {
  static constexpr DType value = DType::kI32;
};
template <>
struct DTypeOf<std::int64_t> {
  static constexpr DType value = DType::kI64;
};
template <>
struct DTypeOf<std::uint16_t> {
  static constexpr DType value = DType::kU16;
};
template <>
struct DTypeOf<std::uint32_t> {
  static constexpr DType value = DType::kU32;
};
template <>
struct DTypeOf<std::uint64_t> {
  static constexpr DType value = DType::kU64;
};
template <>
struct DTypeOf<bool> {
  static constexpr DType value = DType::kBool;
};

}  // namespace consac
