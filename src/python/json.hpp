// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/json/results.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// Dictionaries, lists, texts, numbers and None; bytes of a text that are no UTF-8 are replaced.
py::object python_of(const json::Json& value);

/// What a job found as a dictionary, behind the versions of the format and of risley.
py::object dict_of(const json::Json& found);

}  // namespace risley::python
