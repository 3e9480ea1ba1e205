#pragma once
// Counts every heap allocation of a test program and keeps the size of the largest. Included by exactly one source of
// the program, because it replaces operator new, or defines a sanitizer's hook.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#if defined(_WIN32)
#include <malloc.h>
#endif

namespace {
std::atomic<std::int64_t> allocations{0};
std::atomic<std::size_t> largest{0};

void CountAllocation(std::size_t bytes) noexcept {
  allocations.fetch_add(1, std::memory_order_relaxed);
  for (std::size_t seen = largest.load(std::memory_order_relaxed);
       bytes > seen && !largest.compare_exchange_weak(seen, bytes, std::memory_order_relaxed);) {
  }
}
}  // namespace

#if defined(CONSAC_SANITIZED_THREADS) && defined(__clang__)
// Beside the operators of Clang's ThreadSanitizer others do not link; it calls this for each allocation, those of
// malloc() included.
extern "C" void __sanitizer_malloc_hook(const volatile void*, std::size_t bytes) {
  CountAllocation(bytes);
}
#else
namespace {
/// Null when there is no memory.
void* TryCountedAllocate(std::size_t bytes, std::size_t alignment) noexcept {
  CountAllocation(bytes);
#if defined(_WIN32)
  return _aligned_malloc(bytes == 0 ? 1 : bytes,
                         alignment < alignof(std::max_align_t) ? alignof(std::max_align_t) : alignment);
#else
  if (alignment <= alignof(std::max_align_t)) return std::malloc(bytes == 0 ? 1 : bytes);
  return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
#endif
}

// Not inlined: GCC 12 would take the free() in it for a wrong end of what operator new has given.
[[gnu::noinline]] void Free(void* memory) noexcept {
#if defined(_WIN32)
  _aligned_free(memory);
#else
  std::free(memory);
#endif
}

void* CountedAllocate(std::size_t bytes, std::size_t alignment) {
  while (true) {
    if (void* memory = TryCountedAllocate(bytes, alignment); memory != nullptr) return memory;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}
}  // namespace

void* operator new(std::size_t bytes) {
  return CountedAllocate(bytes, 1);
}
void* operator new[](std::size_t bytes) {
  return CountedAllocate(bytes, 1);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return CountedAllocate(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return CountedAllocate(bytes, static_cast<std::size_t>(alignment));
}
// Every form, or a sanitizer's own would take the place of those that are missing.
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return TryCountedAllocate(bytes, 1);
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return TryCountedAllocate(bytes, 1);
}
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return TryCountedAllocate(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return TryCountedAllocate(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  Free(memory);
}
void operator delete[](void* memory) noexcept {
  Free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  Free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  Free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  Free(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  Free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  Free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  Free(memory);
}
#endif

namespace consac::testing {

/// Heap allocations so far, by any thread.
std::int64_t AllocationCount() {
  return allocations.load();
}

/// Bytes of the largest one since this was called last, by any thread.
std::size_t TakeLargestAllocation() {
  return largest.exchange(0);
}

}  // namespace consac::testing
