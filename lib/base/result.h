/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A value or the reason why there is none; nothing in lib/ throws across its
 * border. */
#pragma once

#include <string>
#include <utility>
#include <variant>

namespace cexp
{

/** Why something could not be done: what was expected, what came, and what to
 * do about it, in one sentence a user can read on the bus. */
struct Error {
  std::string message;
};

/** Either a @p T or an Error. Test it before value() or error(). */
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

/** Done, or the reason why not. */
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

} // namespace cexp
