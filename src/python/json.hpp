// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/json/results.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// Dictionaries, lists, texts, numbers and None; invalid UTF-8 bytes of a text are replaced.
py::object python_of(const json::Json& value);

/// A job's result as a dictionary, after the versions of the format and of risley.
py::object dict_of(const json::Json& found);

}  // namespace risley::python
