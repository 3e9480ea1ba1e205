#include "consac/base/memory.h"

#include <cstdlib>

namespace consac {

Status CheckMemory(std::size_t bytes, std::string_view what) {
  void* volatile memory = std::malloc(bytes);  // volatile: or a compiler leaves the attempt out
  const bool enough = memory != nullptr;
  std::free(memory);
  if (enough) return Status::Ok();
  return {StatusCode::kResourceExhausted,
          "there is not enough free memory for " + std::string(what) + ": " + std::to_string(bytes) + " bytes"};
}

}  // namespace consac
