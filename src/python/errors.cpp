// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <exception>
#include <filesystem>
#include <utility>

#include <pybind11/stl.h>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/wire/udp_socket.hpp"

#include "python/bind.hpp"

namespace risley::python {
namespace {

/// Types of exceptions, which live as long as the interpreter.
struct ErrorTypes {
  py::handle file, missing_file, network, estimation, cancelled;
};

ErrorTypes& error_types() {
  static ErrorTypes types;
  return types;
}

py::handle new_error(py::module_& module, const char* name, const char* doc,
                     const py::handle& base) {
  const std::string full = std::string("risley.") + name;
  PyObject* type = PyErr_NewExceptionWithDoc(full.c_str(), doc, base.ptr(), nullptr);
  if (type == nullptr) throw py::error_already_set();
  module.attr(name) = py::handle(type);
  return type;
}

void raise_file_error(const FileError& error) {
  std::error_code ignored;
  const bool missing = !std::filesystem::exists(error.path(), ignored);
  const py::handle type = missing ? error_types().missing_file : error_types().file;
  const py::object raised = type(error.what());
  raised.attr("path") = error.path();
  raised.attr("byte_offset") = error.place().byte_offset;
  raised.attr("line") = error.place().line;
  raised.attr("problem") = error.problem();
  PyErr_SetObject(type.ptr(), raised.ptr());
}

}  // namespace

void bind_errors(py::module_& module) {
  ErrorTypes& types = error_types();
  types.file =
      new_error(module, "FileError",
                "A file is damaged, of an unknown kind, or cannot be read or written.\n\n"
                "Attributes\n----------\n"
                "path : str\n    The file.\n"
                "byte_offset, line : int or None\n    Where in it, if that is known; lines count "
                "from 1.\nproblem : str\n    What was expected and what was found.\n",
                PyExc_OSError);
  const py::tuple both = py::make_tuple(types.file, py::handle(PyExc_FileNotFoundError));
  types.missing_file = new_error(module, "MissingFileError",
                                 "A file does not exist; also a FileNotFoundError.", both);
  types.network =
      new_error(module, "NetworkError",
                "No sensor answers, or the system refuses a socket or an address.", PyExc_OSError);
  types.estimation =
      new_error(module, "EstimationError",
                "The data give no result: too few data, no convergence, or no valid shot.",
                PyExc_RuntimeError);
  types.cancelled =
      new_error(module, "Cancelled", "A call was stopped because the interpreter is about to end.",
                PyExc_RuntimeError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(std::move(thrown));
    } catch (const InvalidArgument& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const FileError& error) {
      raise_file_error(error);
    } catch (const wire::NetworkError& error) {
      PyErr_SetString(error_types().network.ptr(), error.what());
    } catch (const EstimationError& error) {
      PyErr_SetString(error_types().estimation.ptr(), error.what());
    } catch (const Cancelled& error) {
      PyErr_SetString(error_types().cancelled.ptr(), error.what());
    }
  });
}

}  // namespace risley::python
