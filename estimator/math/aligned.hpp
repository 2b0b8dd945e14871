/// \file
/// Arrays of doubles on cache-line boundaries, for loops over points.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace shaker::estimator {

/// An allocator for std::vector whose arrays begin at a multiple of 64 bytes.
template <class T>
struct AlignedAllocator {
  /// Type of an element.
  using value_type = T;
  /// It has no state.
  AlignedAllocator() = default;
  /// The same for elements of another type.
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}  // NOLINT: allocators convert
  /// \param count number of elements
  /// \return the array; throws std::bad_alloc
  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t(64)));
  }
  /// \param p an array of allocate()
  void deallocate(T* p, std::size_t) { ::operator delete(p, std::align_val_t(64)); }
  /// \return true: all are equal
  template <class U>
  bool operator==(const AlignedAllocator<U>&) const {
    return true;
  }
};

/// Doubles from a multiple of 64 bytes on.
using AlignedVector = std::vector<double, AlignedAllocator<double>>;

}  // namespace shaker::estimator
