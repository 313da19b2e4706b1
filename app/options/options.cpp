/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "options.h"

#include <algorithm>
#include <sstream>
#include <string_view>
#include <utility>

#include <CLI/CLI.hpp>

#include "failure.h"

namespace codedexposure::app
{

namespace
{

constexpr std::size_t kColumn = 22, kWidth = 80;
/* The one that has a letter, too. */
constexpr std::string_view kOutput = "--output";

/* @text behind @head, in lines of kWidth whose words begin at kColumn. */
std::string
wrapped (const std::string &head, const std::string &text)
{
  std::string line = head, all;
  if (line.size () + 2 > kColumn) {
    all = line + "\n";
    line.clear ();
  }
  line.resize (kColumn, ' ');
  bool empty = true;
  std::istringstream words (text);
  for (std::string word; words >> word;) {
    if (!empty && line.size () + 1 + word.size () > kWidth) {
      all += line + "\n";
      line.assign (kColumn, ' ');
      empty = true;
    }
    line += (empty ? "" : " ") + word;
    empty = false;
  }
  return all + line + "\n";
}

} // namespace

Options::Options (CLI::App &app) : app_ (app) {}

void
Options::read_with (const std::string &name, const std::string &placeholder,
    const std::string &help, const std::string &must_be,
    std::function<bool (const std::string &)> read)
{
  app_.add_option (name == kOutput ? "-o," + name : name)
      ->expected (1)
      ->multi_option_policy (CLI::MultiOptionPolicy::TakeLast);
  declared_.push_back (
      {name, placeholder, help, heading_, must_be, std::move (read)});
}

void
Options::flag (const std::string &name, bool &into, const std::string &help)
{
  app_.add_flag (name, into);
  declared_.push_back ({name, "", help, heading_, "", nullptr});
}

void
Options::word (const std::string &what, std::string &into, bool may_be_missing)
{
  const std::string name = "word" + std::to_string (words_.size ());
  app_.add_option (name, into)->expected (1);
  words_.push_back ({what, name, may_be_missing});
}

void
Options::words (std::vector<std::string> &into)
{
  app_.add_option ("words", into)->expected (1, 1 << 20);
}

void
Options::rest (std::vector<std::string> &into)
{
  rest_ = &into;
  app_.prefix_command ();
}

void
Options::need (
    std::initializer_list<const char *> names, const std::string &needed)
{
  for (const char *name : names)
    relations_.push_back ({name, needed, true});
}

void
Options::exclude (
    std::initializer_list<const char *> names, const std::string &other)
{
  for (const char *name : names)
    relations_.push_back ({name, other, false});
}

void
Options::require (const std::string &name, const std::string &placeholder)
{
  required_.emplace_back (name, placeholder);
}

bool
Options::has (const std::string &name) const
{
  const CLI::Option *option = app_.get_option_no_throw (name);
  return option && option->count () > 0;
}

std::string
Options::value_text (const std::string &name) const
{
  return app_.get_option (name)->results ().back ();
}

std::vector<std::string>
Options::given (std::initializer_list<const char *> names) const
{
  std::vector<std::string> words;
  for (const Declared &option : declared_)
    if (has (option.name) &&
        std::ranges::find (names, option.name) != names.end ())
      words.push_back (
          option.name + (option.read ? "=" + value_text (option.name) : ""));
  return words;
}

void
Options::check_value (const Declared &option) const
{
  if (!option.read || !has (option.name))
    return;
  const std::string value = value_text (option.name);
  if (value.starts_with ("--"))
    usage_error (option.name + " needs a value, and " + value +
                 " is an option; write a value after " + option.name +
                 ", and a file of that name as ./" + value);
  if (value.starts_with ("~/"))
    usage_error (option.name + " " + value +
                 ": the shell leaves the ~ as it is behind = and in quotes; "
                 "write " +
                 option.name + " " + value +
                 " without them, and a folder of that name as ./" + value);
  if (!option.read (value))
    usage_error (option.name + " must be " + option.must_be + ", not " + value);
}

void
Options::finish () const
{
  for (const Declared &option : declared_)
    check_value (option);
  if (rest_) {
    *rest_ = app_.remaining ();
    if (!rest_->empty () && rest_->front ().starts_with ("-"))
      usage_error ("unknown option " + rest_->front ());
    const bool marked = rest_->empty () && !end_of_rest_.empty ();
    rest_->insert (rest_->end (), end_of_rest_.begin () + (marked ? 1 : 0),
        end_of_rest_.end ());
  }
  for (const Relation &relation : relations_) {
    if (!has (relation.name) || has (relation.other) == relation.needs)
      continue;
    usage_error (relation.needs
                     ? relation.name + " is for " + relation.other + "; set " +
                           relation.other + ", or leave " + relation.name +
                           " out"
                     : relation.name + " and " + relation.other +
                           " exclude each other; leave one of them out");
  }
  for (const Word &word : words_)
    if (!word.may_be_missing && app_.get_option (word.name)->count () == 0)
      usage_error ("give one " + word.what);
  for (const auto &[name, placeholder] : required_)
    if (!has (name))
      usage_error ("set " + name + " " + placeholder);
}

std::string
Options::help () const
{
  std::string text, heading = declared_.empty () ? "" : "\n";
  for (const Declared &option : declared_) {
    if (option.heading != heading) {
      heading = option.heading;
      text += heading.empty () ? "\n" : "\n" + heading + ":\n";
    }
    text += wrapped ((option.name == kOutput ? "  -o, " : "  ") + option.name +
                         (option.placeholder.empty () ? "" : " ") +
                         option.placeholder,
        option.help);
  }
  return text;
}

} // namespace codedexposure::app
