// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cstring>
#include <optional>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/tables/netcdf.hpp"

#include "tables/confined_process.hpp"
#include "tables/netcdf_file.hpp"
#include "tables/netcdf_library.hpp"

namespace risley::tables {
namespace {

enum class Request : std::uint8_t {
  open,
  has_attribute,
  text,
  number,
  text_group,
  dimension,
  has_variable,
  texts,
  variable,
  get,
};
enum class Outcome : std::uint8_t { done, file_error };

/// Numbers and texts one after another, for a process that is a copy of this one.
class Parcel {
 public:
  template <class T>
  Parcel& put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Parcel& put_text(std::string_view text) {
    put(text.size());
    bytes_.append(text);
    return *this;
  }
  /// Makes room for more bytes at the end.
  char* extend(std::size_t size) {
    bytes_.resize(bytes_.size() + size);
    return bytes_.data() + bytes_.size() - size;
  }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

/// Takes a parcel apart. Data from a process whose library misbehaved are not trusted.
class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : left_(bytes) {}

  template <class T>
  T take() {
    T value{};
    const std::string_view own = take_bytes(sizeof value);
    std::memcpy(&value, own.data(), sizeof value);
    return value;
  }
  std::string take_text() { return std::string(take_bytes(take<std::size_t>())); }
  std::string_view take_bytes(std::size_t size) {
    if (size > left_.size())
      throw ProcessEnded("the process that reads the file returned an invalid answer");
    const std::string_view taken = left_.substr(0, size);
    left_.remove_prefix(size);
    return taken;
  }

 private:
  std::string_view left_;
};

void put(Parcel& parcel, const NetcdfVariable& variable) {
  parcel.put_text(variable.name).put(variable.type).put(variable.width).put(variable.id);
}
NetcdfVariable take_variable(Unpacker& parcel) {
  NetcdfVariable variable;
  variable.name = parcel.take_text();
  variable.type = parcel.take<NetcdfType>();
  variable.width = parcel.take<std::size_t>();
  variable.id = parcel.take<int>();
  return variable;
}
void put(Parcel& parcel, const NetcdfDimension& dimension) {
  parcel.put_text(dimension.name).put(dimension.length).put(dimension.id);
}
NetcdfDimension take_dimension(Unpacker& parcel) {
  NetcdfDimension dimension;
  dimension.name = parcel.take_text();
  dimension.length = parcel.take<std::size_t>();
  dimension.id = parcel.take<int>();
  return dimension;
}

/// Answers requests about one file, in a separate process.
class Service {
 public:
  explicit Service(const io::InputFile& file)
      : path_(file.path()), name_(file.name_for_libraries()) {}

  std::string operator()(std::string_view request) {
    Parcel answer;
    try {
      answer.put(Outcome::done);
      Unpacker asked(request);
      serve(asked, answer);
    } catch (const FileError& error) {
      answer.bytes().clear();
      answer.put(Outcome::file_error).put_text(error.problem());
    }
    return std::move(answer.bytes());
  }

 private:
  void serve(Unpacker& asked, Parcel& answer) {
    switch (asked.take<Request>()) {
      case Request::open:
        // Some systems prevent processes from opening each other's files.
        file_ = std::make_shared<NetcdfFile>(::access(name_.c_str(), R_OK) == 0 ? name_ : path_);
        break;
      case Request::has_attribute:
        answer.put(file_->has_attribute(asked.take_text()));
        break;
      case Request::text:
        answer.put_text(file_->text(asked.take_text()));
        break;
      case Request::number:
        answer.put(file_->number(asked.take_text()));
        break;
      case Request::text_group: {
        const auto texts = file_->text_group(asked.take_text());
        answer.put(texts.size());
        for (const auto& [name, text] : texts) answer.put_text(name).put_text(text);
        break;
      }
      case Request::dimension:
        put(answer, file_->dimension(asked.take_text()));
        break;
      case Request::has_variable:
        answer.put(file_->has_variable(asked.take_text()));
        break;
      case Request::texts: {
        const std::string name = asked.take_text();
        const std::vector<std::string> texts = file_->texts(name, take_dimension(asked));
        answer.put(texts.size());
        for (const std::string& text : texts) answer.put_text(text);
        break;
      }
      case Request::variable: {
        const std::string name = asked.take_text();
        const auto type = asked.take<NetcdfType>();
        std::vector<NetcdfDimension> dimensions(asked.take<std::size_t>());
        for (NetcdfDimension& one : dimensions) one = take_dimension(asked);
        put(answer, file_->variable(name, type, dimensions, asked.take<std::size_t>()));
        break;
      }
      case Request::get: {
        const NetcdfVariable variable = take_variable(asked);
        const auto first = asked.take<std::size_t>(), count = asked.take<std::size_t>();
        file_->get(variable, first, count,
                   answer.extend(count * variable.width * bytes_of(variable.type)));
        break;
      }
    }
  }

  std::string path_, name_;
  std::shared_ptr<NetcdfFile> file_;  // shared: a service is copied, an open file cannot be
};

Parcel request(Request kind) {
  Parcel parcel;
  parcel.put(kind);
  return parcel;
}
Parcel request(Request kind, const std::string& name) {
  Parcel parcel = request(kind);
  parcel.put_text(name);
  return parcel;
}

}  // namespace

/// The process that reads the file.
class NetcdfInput::Process {
 public:
  Process(const NetcdfInput& owner, const io::InputFile& file, const Progress& progress)
      : owner_(owner) {
    try {
      const NetcdfLock lock;  // no call of the library is in progress in the copy of this process
      process_.emplace(Service(file), progress);
    } catch (const ProcessEnded& error) {
      owner_.fail(error.what());
    }
  }

  /// @return the answer without its outcome
  std::string ask(Parcel request, const std::string& about) {
    try {
      std::string answer = process_->ask(request.bytes());
      Unpacker parcel(answer);
      if (parcel.take<Outcome>() == Outcome::file_error) owner_.fail(parcel.take_text());
      answer.erase(0, sizeof(Outcome));
      return answer;
    } catch (const ProcessEnded& error) {
      owner_.fail(fmt::format("{} cannot be read by the NetCDF library: {}", about, error.what()));
    }
  }

 private:
  const NetcdfInput& owner_;
  std::optional<ConfinedProcess> process_;
};

NetcdfInput::NetcdfInput(io::InputFile file, const Progress& progress)
    : file_(std::move(file)), process_(std::make_unique<Process>(*this, file_, progress)) {
  process_->ask(request(Request::open), "the file");
}

NetcdfInput::~NetcdfInput() = default;

void NetcdfInput::fail(const std::string& problem) const { throw FileError(path(), {}, problem); }

bool NetcdfInput::has_attribute(const std::string& name) const {
  const std::string answer =
      process_->ask(request(Request::has_attribute, name), fmt::format("attribute {}", name));
  return Unpacker(answer).take<bool>();
}

std::string NetcdfInput::text(const std::string& name) const {
  const std::string answer =
      process_->ask(request(Request::text, name), fmt::format("attribute {}", name));
  return Unpacker(answer).take_text();
}

std::uint32_t NetcdfInput::number(const std::string& name) const {
  const std::string answer =
      process_->ask(request(Request::number, name), fmt::format("attribute {}", name));
  return Unpacker(answer).take<std::uint32_t>();
}

std::vector<std::pair<std::string, std::string>> NetcdfInput::text_group(
    const std::string& group) const {
  const std::string answer =
      process_->ask(request(Request::text_group, group), fmt::format("group {}", group));
  Unpacker parcel(answer);
  std::vector<std::pair<std::string, std::string>> texts;
  for (auto left = parcel.take<std::size_t>(); left > 0; --left) {
    std::string name = parcel.take_text();
    texts.emplace_back(std::move(name), parcel.take_text());
  }
  return texts;
}

NetcdfDimension NetcdfInput::dimension(const std::string& name) const {
  const std::string answer =
      process_->ask(request(Request::dimension, name), fmt::format("dimension {}", name));
  Unpacker parcel(answer);
  return take_dimension(parcel);
}

NetcdfDimension NetcdfInput::dimension(const std::string& name, std::size_t length) const {
  NetcdfDimension found = dimension(name);
  if (found.length != length) {
    fail(fmt::format("dimension {} has length {}, expected {}", name, found.length, length));
  }
  return found;
}

bool NetcdfInput::has_variable(const std::string& name) const {
  const std::string answer =
      process_->ask(request(Request::has_variable, name), fmt::format("variable {}", name));
  return Unpacker(answer).take<bool>();
}

std::vector<std::string> NetcdfInput::texts(const std::string& name,
                                            const NetcdfDimension& along) const {
  Parcel asked = request(Request::texts, name);
  put(asked, along);
  const std::string answer = process_->ask(std::move(asked), fmt::format("variable {}", name));
  Unpacker parcel(answer);
  std::vector<std::string> texts;
  for (auto left = parcel.take<std::size_t>(); left > 0; --left) {
    texts.push_back(parcel.take_text());
  }
  return texts;
}

NetcdfVariable NetcdfInput::variable(const std::string& name, NetcdfType type,
                                     std::span<const NetcdfDimension* const> dimensions,
                                     std::size_t block) const {
  require_dimensions(name, dimensions);
  Parcel asked = request(Request::variable, name);
  asked.put(type).put(dimensions.size());
  for (const NetcdfDimension* one : dimensions) put(asked, *one);
  asked.put(block);
  const std::string answer = process_->ask(std::move(asked), fmt::format("variable {}", name));
  Unpacker parcel(answer);
  return take_variable(parcel);
}

void NetcdfInput::get(const NetcdfVariable& variable, NetcdfType type, std::size_t first,
                      std::size_t count, void* values) const {
  if (type != variable.type) {
    throw InvalidArgument(fmt::format("variable {} has the type {}, asked for {}", variable.name,
                                      name_of(variable.type), name_of(type)));
  }
  if (count == 0 || variable.width == 0) return;
  Parcel asked = request(Request::get);
  put(asked, variable);
  asked.put(first).put(count);
  const std::string answer = process_->ask(
      std::move(asked),
      fmt::format("entries {} to {} of variable {}", first, first + count - 1, variable.name));
  const std::string_view bytes =
      Unpacker(answer).take_bytes(count * variable.width * bytes_of(type));
  std::memcpy(values, bytes.data(), bytes.size());
}

}  // namespace risley::tables
