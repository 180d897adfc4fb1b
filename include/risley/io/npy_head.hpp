// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// Header of a NumPy array file (npy 1.0): signature, length and description, padded so that the
/// elements are aligned as numpy aligns them.
/// @param description  the dictionary of descr, fortran_order and shape, as Python writes it
/// @throws InvalidArgument for a description whose length does not fit into 16 bits
std::string npy_head(std::string description);

}  // namespace risley::io
