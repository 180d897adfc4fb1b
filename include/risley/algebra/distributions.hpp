// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

/// @file
/// Probabilities and quantiles of the distributions of test statistics.
namespace risley::algebra {

/// Probability that a normal number of mean 0 and variance 1 exceeds z.
double normal_tail(double z);
/// The distance from 0 that such a number exceeds, on either side, with a probability from 0 to 1.
double two_sided_normal_quantile(double probability);

/// Probability that chi-square of so many degrees of freedom exceeds a value.
double chi_square_tail(double chi2, double degrees);
/// Chi-square over its degrees of freedom where `normal_quantile` standard deviations of a normal
/// distribution have the same probability; NaN without degrees of freedom. Above a thousand degrees
/// by Wilson and Hilferty (1931): to 2e-6 within two, to 3e-5 within 3.5 standard deviations.
double chi_square_per_degree(double degrees, double normal_quantile);

/// Probability that chi-square of so many degrees of freedom, divided by an independent estimate of
/// its variance factor of `factor_degrees`, exceeds a value: F's distribution.
double f_tail(double chi2, double degrees, double factor_degrees);
/// Probability that a number of Student's distribution lies at least so far from 0, on either side.
double two_sided_student_tail(double t, double degrees);

}  // namespace risley::algebra
