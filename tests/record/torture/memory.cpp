// In a file of its own, because it replaces operator new of the whole program.
#include "tests/record/torture/memory.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

#include <sqlite3.h>

namespace shaker::record::torture {
namespace {

std::atomic<std::int64_t> at{0}, calls{0};
std::atomic<bool> good{false};
sqlite3_mem_methods usual_memory{};

bool runs_out() {
  const std::int64_t n = at.load();
  if (n == 0) return false;
  const std::int64_t call = ++calls;
  return call == n || (good.load() && call > n);
}

void* allocate(int size) {
  return runs_out() ? nullptr : usual_memory.xMalloc(size);
}
void* reallocate(void* memory, int size) {
  return runs_out() ? nullptr : usual_memory.xRealloc(memory, size);
}

}  // namespace

void Memory::install() {
  if (usual_memory.xMalloc != nullptr) return;
  sqlite3_shutdown();
  sqlite3_config(SQLITE_CONFIG_GETMALLOC, &usual_memory);
  sqlite3_mem_methods failing = usual_memory;
  failing.xMalloc = allocate;
  failing.xRealloc = reallocate;
  sqlite3_config(SQLITE_CONFIG_MALLOC, &failing);
}

void Memory::fail_at(std::int64_t n, bool for_good) {
  at = 0;
  calls = 0;
  good = for_good;
  at = n;
}

bool Memory::reached() {
  return at.load() > 0 && calls.load() >= at.load();
}

}  // namespace shaker::record::torture

// NOLINTBEGIN(misc-new-delete-overloads)
void* operator new(std::size_t size) {
  void* memory = shaker::record::torture::runs_out() ? nullptr : std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void* operator new[](std::size_t size) {
  return operator new(size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
// NOLINTEND(misc-new-delete-overloads)
