// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// What stands before the elements of a NumPy array file (npy 1.0): signature, length and
/// description, filled up so that the elements begin where numpy has them begin.
/// @param description  the dictionary of descr, fortran_order and shape, as Python writes it
/// @throws InvalidArgument for a description whose length does not fit into 16 bits
std::string npy_head(std::string description);

}  // namespace risley::io
