#include "consac/base/dtype.h"

namespace consac {
namespace {

struct DTypeRow {
  DType dtype;
  std::size_t bytes;
  std::string_view name;
};

// In the order of the enum's numbers.
constexpr DTypeRow kDTypeRows[] = {
    {DType::kF32, 4, "F32"}, {DType::kF64, 8, "F64"}, {DType::kU8, 1, "U8"},     {DType::kI8, 1, "I8"},
    {DType::kI16, 2, "I16"}, {DType::kI32, 4, "I32"}, {DType::kI64, 8, "I64"},   {DType::kU16, 2, "U16"},
    {DType::kU32, 4, "U32"}, {DType::kU64, 8, "U64"}, {DType::kBool, 1, "BOOL"},
};

}  // namespace

std::size_t SizeOf(DType dtype) {
  return kDTypeRows[static_cast<std::size_t>(dtype)].bytes;
}

std::string_view NameOf(DType dtype) {
  return kDTypeRows[static_cast<std::size_t>(dtype)].name;
}

bool ParseDType(std::string_view name, DType* dtype) {
  for (const DTypeRow& row : kDTypeRows) {
    if (row.name == name) {
      *dtype = row.dtype;
      return true;
    }
  }
  return false;
}

}  // namespace consac
