#include "consac/run/shortage.h"

#include <atomic>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace consac::run {
namespace {

constexpr std::size_t kLeastReserve = std::size_t{1} << 20;

std::mutex reserve_mutex;         // no memory is taken while it is held
MemoryReserve* holder = nullptr;  // guarded by it
std::atomic<std::uint64_t> shortages{0};

/// `bytes`, or as much of them as there is; null where that is next to nothing.
void* TakeUpTo(std::size_t bytes) {
  void* memory = nullptr;
  for (; memory == nullptr && bytes >= kLeastReserve; bytes /= 2) memory = std::malloc(bytes);
  return memory;
}

/// Further threads would each take 64 MiB of address space for what they allocate, and so all that is given up to one.
void AllocateInOnePlace() {
#if defined(__GLIBC__)
  mallopt(M_ARENA_MAX, 1);
#endif
}

Status MemoryShort() {
  try {
    return {StatusCode::kResourceExhausted,
            "there is not enough free memory for that; lower --envs or n_steps, or the network"};
  } catch (const std::bad_alloc&) {
    return {StatusCode::kResourceExhausted, "out of memory"};  // so short a text needs none
  }
}

}  // namespace

void MemoryReserve::OnShortage() {
  void* memory = nullptr;
  {
    const std::lock_guard lock(reserve_mutex);
    shortages.fetch_add(1);
    if (holder != nullptr) memory = std::exchange(holder->first_aid_, nullptr);
  }
  if (memory == nullptr) throw std::bad_alloc();
  std::free(memory);
}

MemoryReserve::MemoryReserve(std::size_t first_aid, std::size_t for_saving) : shortages_before_(shortages.load()) {
  AllocateInOnePlace();
  {
    const std::lock_guard lock(reserve_mutex);
    if (holder != nullptr) return;
    holder = this;
  }
  std::set_new_handler(OnShortage);
  void* const memory = TakeUpTo(first_aid);
  for_saving_ = TakeUpTo(for_saving);
  const std::lock_guard lock(reserve_mutex);
  first_aid_ = memory;
}

MemoryReserve::~MemoryReserve() {
  {
    const std::lock_guard lock(reserve_mutex);
    if (holder == this) holder = nullptr;
  }
  std::free(first_aid_);  // null in those that hold none
  Release();
}

void MemoryReserve::Release() {
  std::free(std::exchange(for_saving_, nullptr));
}

bool MemoryReserve::ran_short() const {
  return shortages.load(std::memory_order_relaxed) != shortages_before_;
}

Status MemoryReserve::health() const {
  if (!ran_short()) return Status::Ok();
  return {StatusCode::kResourceExhausted,
          "memory ran short; lower --envs or n_steps, or the network, or give this program more"};
}

Status CaughtException() {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return MemoryShort();
  } catch (const std::length_error&) {  // more than any memory has
    return MemoryShort();
  } catch (const std::system_error& error) {
    for (const std::errc shortage :
         {std::errc::resource_unavailable_try_again, std::errc::too_many_files_open,
          std::errc::too_many_files_open_in_system, std::errc::not_enough_memory, std::errc::no_space_on_device}) {
      if (error.code() == shortage) return {StatusCode::kResourceExhausted, error.what()};
    }
    return {StatusCode::kInternal, std::string("unexpected: ") + error.what()};
  } catch (const std::exception& error) {
    return {StatusCode::kInternal, std::string("unexpected: ") + error.what()};
  } catch (...) {
    return {StatusCode::kInternal, "unexpected: something was thrown that is no exception"};
  }
}

}  // namespace consac::run
