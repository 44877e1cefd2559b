// What a library call returns when data may be at fault.
#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace crumple {

// A sentence for the person at the desk: it names the file, field, sensor or view, and what to do about it.
struct Error {
  std::string message;
};

template <typename T>
using Expected = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(std::string message) { return tl::unexpected<Error>(Error{std::move(message)}); }

}  // namespace crumple
