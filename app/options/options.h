/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The options of a command: each is declared once, with its rule and its help,
 * and with the options that it needs or excludes. An option that would be
 * ignored is an error. */
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "rules.h"

namespace CLI
{
class App;
}

namespace codedexposure::app
{

/** Declares options at a CLI::App; used by Command::declare (). */
class Options
{
public:
  explicit Options (CLI::App &app);
  Options (const Options &) = delete;
  Options &operator= (const Options &) = delete;

  /** The options that follow stand below this line in --help. */
  void heading (std::string text) { heading_ = std::move (text); }

  /**
   * An option with a value: value ("--bits", bits, "N", "significant bits [8]",
   * whole (1, 16)). @p into, which may be an optional, keeps its value, which
   * is the default, unless the option is given.
   */
  template <typename T, typename Into>
  void value (const std::string &name, Into &into,
      const std::string &placeholder, const std::string &help, Rule<T> rule)
  {
    read_with (name, placeholder, help, rule.must_be,
        [&into, read = std::move (rule.read)] (const std::string &text) {
          auto read_value = read (text);
          if (read_value)
            into = std::move (*read_value);
          return bool (read_value);
        });
  }
  /** Text without a rule. */
  void value (const std::string &name, std::optional<Text> &into,
      const std::string &placeholder, const std::string &help)
  {
    value (name, into, placeholder, help, any_text ());
  }
  void flag (const std::string &name, bool &into, const std::string &help);

  /** A word that belongs to no option; "RECORDING.mkv". Words are taken in the
   * order in which they are declared. */
  void word (
      const std::string &what, std::string &into, bool may_be_missing = false);
  /** Any number of words. */
  void words (std::vector<std::string> &into);
  /** The first word that is no option, and all after it. */
  void rest (std::vector<std::string> &into);
  bool takes_rest () const { return rest_; }
  /** The last words of the rest, from the first "--" of the command line on,
   * which is not one of them if they are all. */
  void end_rest (std::vector<std::string> words)
  {
    end_of_rest_ = std::move (words);
  }

  /** Each of @p names is an error without @p needed. */
  void need (
      std::initializer_list<const char *> names, const std::string &needed);
  /** Each of @p names is an error together with @p other. */
  void exclude (
      std::initializer_list<const char *> names, const std::string &other);
  /** The option must be given. */
  void require (const std::string &name, const std::string &placeholder);

  /** Whether the option stands on the command line. */
  bool has (const std::string &name) const;
  /** Those of @p names that do, as words of another command line. */
  std::vector<std::string> given (
      std::initializer_list<const char *> names) const;

  /** After the command line was parsed: reads the values and checks the
   * relations. Throws Failure. */
  void finish () const;
  /** The options as text, for --help. */
  std::string help () const;

private:
  struct Declared {
    std::string name, placeholder, help, heading, must_be;
    std::function<bool (const std::string &)> read; // null: a flag
  };
  struct Relation {
    std::string name, other;
    bool needs;
  };
  void read_with (const std::string &name, const std::string &placeholder,
      const std::string &help, const std::string &must_be,
      std::function<bool (const std::string &)> read);
  std::string value_text (const std::string &name) const;
  void check_value (const Declared &option) const;

  CLI::App &app_;
  std::string heading_;
  std::vector<Declared> declared_;
  std::vector<Relation> relations_;
  std::vector<std::pair<std::string, std::string>> required_;
  struct Word {
    std::string what, name;
    bool may_be_missing;
  };
  std::vector<Word> words_;
  std::vector<std::string> *rest_ = nullptr;
  std::vector<std::string> end_of_rest_;
};

} // namespace codedexposure::app
