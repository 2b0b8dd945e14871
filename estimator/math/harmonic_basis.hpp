// The harmonic basis of all Fourier coefficients: 1, cos 2 pi tau, sin 2 pi tau, cos 4 pi tau, ...
// tau is a phase in periods. Term 2 h - 1 is the cosine of harmonic h, term 2 h its sine.
#pragma once

#include <complex>
#include <span>

namespace shaker::estimator {

// Fills `row` with the first row.size() terms at the phase tau.
void fill_harmonic_row(double tau, std::span<double> row);

// A term at point i of a period of `points` equal steps, from the phase reduced to one period.
double harmonic_term(int term, int point, int points);

// `size` exp(-2 pi i h point / points): the factor of a sample in the Fourier sum of harmonic h.
std::complex<double> fourier_factor(int harmonic, int point, int points, double size = 1.0);

// Sum of the samples of a period on equal steps, each times its factor.
std::complex<double> fourier_sum(std::span<const double> samples, int harmonic, double size = 1.0);

}  // namespace shaker::estimator
