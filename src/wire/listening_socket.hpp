// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/io/block_file.hpp"
#include "risley/wire/address.hpp"

namespace risley::wire {

/// A non-blocking listening TCP socket.
/// @param local  an address of this machine, not 0.0.0.0; its port, if 0, becomes the chosen free
/// one
/// @throws InvalidArgument, NetworkError
io::FileDescriptor listening_socket(Endpoint& local);

}  // namespace risley::wire
