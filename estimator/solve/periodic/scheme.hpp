/// \file
/// Schemes for the derivatives over the cyclic time on n equal steps (5.17).
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace shaker::estimator {

/// order2 is the scheme of the paper. Smooth problems reach the declared order (tested); |v| v
/// limits it to about 3 unless the kink is corrected (PeriodicSystem). fourier is collocation with
/// all harmonics.
enum class Scheme { order2, order4, order6, fourier };

/// \param scheme a scheme
/// \return its word in documents
constexpr std::string_view name(Scheme scheme) {
  constexpr std::string_view names[] = {"order2", "order4", "order6", "fourier"};
  return names[static_cast<int>(scheme)];
}

/// \param text a word
/// \return the scheme of that name, or nothing
constexpr std::optional<Scheme> scheme_from_name(std::string_view text) {
  for (const Scheme s : {Scheme::order2, Scheme::order4, Scheme::order6, Scheme::fourier}) {
    if (name(s) == text) return s;
  }
  return std::nullopt;
}

inline constexpr int kMostAcross = 7;  ///< points in a stencil

/// Central differences of half-width `reach`: z' ~ n sum first[reach + k] z_{i+k}, z'' ~ n^2 sum
/// second[reach + k] z_{i+k}.
struct Stencil {
  int reach = 0;  ///< points on each side
  /// Weights of the first and second differences: 2 * reach + 1 are in use.
  /// @{
  std::array<double, kMostAcross> first{}, second{};
  /// @}
};

/// \param scheme a difference scheme
/// \return its central differences
constexpr Stencil stencil(Scheme scheme) {
  switch (scheme) {
    case Scheme::order2:
      return {1, {-1. / 2, 0, 1. / 2}, {1, -2, 1}};
    case Scheme::order4:
      return {2,
              {1. / 12, -2. / 3, 0, 2. / 3, -1. / 12},
              {-1. / 12, 4. / 3, -5. / 2, 4. / 3, -1. / 12}};
    default:
      return {3,
              {-1. / 60, 3. / 20, -3. / 4, 0, 3. / 4, -3. / 20, 1. / 60},
              {1. / 90, -3. / 20, 3. / 2, -49. / 18, 3. / 2, -3. / 20, 1. / 90}};
  }
}

/// Stencils for coordinates of first order (internal states), whose equations may be stiff. Central
/// differences do not see an oscillation from point to point and leave it undamped. These stencils
/// are biased backwards by one point and damp it. Their orders are 1, 3 and 5.
/// \param scheme a difference scheme
/// \return the biased first differences
constexpr Stencil upwind_stencil(Scheme scheme) {
  switch (scheme) {
    case Scheme::order2:
      return {1, {-1, 1, 0}, {}};
    case Scheme::order4:
      return {2, {1. / 6, -1, 1. / 2, 1. / 3, 0}, {}};
    default:
      return {3, {-1. / 30, 1. / 4, -1, 1. / 3, 1. / 2, -1. / 20, 0}, {}};
  }
}

}  // namespace shaker::estimator
