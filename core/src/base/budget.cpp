#include "consac/base/budget.h"

#include <string>

namespace consac {

Status MemoryBudget::Take(std::string_view what, std::uint64_t count, std::uint64_t each) {
  if (each > 0 && count > left_ / each) {
    return {StatusCode::kResourceExhausted, std::string(what) + " needs " + std::to_string(count) + " times " +
                                                std::to_string(each) + " bytes, of " + std::to_string(whole_) +
                                                " for everything " + std::to_string(left_) +
                                                " are left; offer fewer or smaller things"};
  }
  left_ -= count * each;
  return Status::Ok();
}

}  // namespace consac
