/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A value, or an error with a code and a message.
 *
 * When memory runs out, functions that make objects or work on frames return
 * ErrorCode::out_of_memory; copies of values and their texts throw
 * std::bad_alloc, like standard containers. No other exception leaves the
 * library, and none ends one of its threads. One case ends the program:
 * nlohmann::json allocates memory to free a value, and that fails. */
#pragma once

#include <new>
#include <string>
#include <utility>
#include <variant>

namespace codedexposure
{

/** What kind of error it is, so that a program can act on it. */
enum class ErrorCode {
  invalid_argument, ///< a value is wrong or does not fit the others
  parse,            ///< a text or file is not in the expected format
  not_found,        ///< there is no such file or device
  io,               ///< a file or a connection could not be read or written
  device,           ///< a device refused a command or reported a fault
  denied,           ///< the user has no right to do it
  busy,             ///< another program uses the device
  timeout,          ///< a device or a peer did not answer in time
  cancelled,        ///< the caller asked to stop
  unsupported,      ///< this build, machine or device cannot do it
  out_of_memory,    ///< an allocation failed
};

/** Why something could not be done. The message is one sentence for the user:
 * the value, the rule and the remedy. */
struct Error {
  std::string message;
  ErrorCode code = ErrorCode::invalid_argument;

  /** The same error with @p prefix, which names its subject, before the
   * message. */
  Error with_prefix (const std::string &prefix) const
  {
    return {prefix + message, code};
  }
};

/** Either a @p T or an Error. Test it before value () or error (). */
template <typename T>
class [[nodiscard]] Result
{
public:
  Result (T value) : state_ (std::in_place_index<0>, std::move (value)) {}
  Result (Error error) : state_ (std::in_place_index<1>, std::move (error)) {}

  bool ok () const { return state_.index () == 0; }
  explicit operator bool () const { return ok (); }

  T &value () & { return std::get<0> (state_); }
  const T &value () const & { return std::get<0> (state_); }
  T &&value () && { return std::get<0> (std::move (state_)); }
  T &operator* () & { return value (); }
  const T &operator* () const & { return value (); }
  T &&operator* () && { return std::move (*this).value (); }
  T *operator->() { return &value (); }
  const T *operator->() const { return &value (); }

  const Error &error () const { return std::get<1> (state_); }

private:
  std::variant<T, Error> state_;
};

/** Success, or an Error. */
template <>
class [[nodiscard]] Result<void>
{
public:
  Result () = default;
  Result (Error error) : error_ (std::move (error)), ok_ (false) {}

  bool ok () const { return ok_; }
  explicit operator bool () const { return ok_; }
  const Error &error () const { return error_; }

private:
  Error error_;
  bool ok_ = true;
};

/** What a function returns that caught std::bad_alloc. It allocates nothing:
 * the text fits into the string itself. */
inline Error
out_of_memory () noexcept
{
  return {"out of memory", ErrorCode::out_of_memory};
}

} // namespace codedexposure
