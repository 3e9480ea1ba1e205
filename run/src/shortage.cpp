#include "consac/run/shortage.h"

#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace consac::run {
namespace {

constexpr std::size_t kLeastReserve = std::size_t{1} << 20;

std::atomic<void*> reserve{nullptr};  // for the handler, which may run on any thread
std::atomic<std::uint64_t> shortages{0};

/// Called where operator new finds no memory; it tries again when this returns.
void GiveUpReserve() {
  void* memory = reserve.exchange(nullptr);
  if (memory == nullptr) throw std::bad_alloc();
  shortages.fetch_add(1);
  std::free(memory);
}

/// Further threads would each take 64 MiB of address space for what they allocate, and so all that is given up to one.
void AllocateInOnePlace() {
#if defined(__GLIBC__)
  mallopt(M_ARENA_MAX, 1);
#endif
}

Status MemoryShort() {
  return {StatusCode::kResourceExhausted,
          "there is not enough free memory for that; lower --envs or n_steps, or the network"};
}

}  // namespace

MemoryReserve::MemoryReserve(std::size_t bytes) : shortages_before_(shortages.load()) {
  AllocateInOnePlace();
  void* memory = nullptr;
  for (; memory == nullptr && bytes >= kLeastReserve; bytes /= 2) memory = std::malloc(bytes);
  void* none = nullptr;
  holds_ = memory != nullptr && reserve.compare_exchange_strong(none, memory);
  if (holds_)
    std::set_new_handler(GiveUpReserve);
  else
    std::free(memory);
}

MemoryReserve::~MemoryReserve() {
  if (holds_) std::free(reserve.exchange(nullptr));
}

Status MemoryReserve::health() const {
  if (shortages.load(std::memory_order_relaxed) == shortages_before_) return Status::Ok();
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
