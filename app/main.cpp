/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure: what people type. */
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <string_view>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/text.h"
#include "command.h"
#include "options/common.h"
#include "pipeline/program.h"

namespace codedexposure::app
{

namespace
{

constexpr const char *kName = "codedexposure";

/** A command, its place on the command line, and its options. */
struct Node {
  std::string path; ///< "codedexposure schedule show"
  Command command;
  CLI::App *app = nullptr;
  std::unique_ptr<Options> options;
  std::vector<Node> below = {};
};

void
print_list (const std::vector<Node> &nodes)
{
  for (const Node &node : nodes)
    if (const CommandText &text = node.command.text; !text.summary.empty ())
      std::printf ("  %-18s  %s\n", text.name.c_str (), text.summary.c_str ());
}

void
print_help (const Node &node)
{
  const CommandText &text = node.command.text;
  const auto shown = [] (const std::string &of) {
    return of.c_str () + (of.starts_with ('\n') ? 1 : 0);
  };
  std::printf ("Usage: %s %s\n%s", node.path.c_str (), text.usage.c_str (),
      shown (text.description));
  if (!node.below.empty ())
    std::printf ("\n");
  print_list (node.below);
  std::printf ("%s  -h, --help          show this help\n",
      node.options->help ().c_str ());
  if (!text.notes.empty ())
    std::printf ("\n%s", shown (text.notes));
}

void
print_commands (const std::vector<Node> &nodes)
{
  std::printf ("Usage: %s COMMAND [option...]\n"
               "A fast camera from a slow one: records, decodes and shows the "
               "frames of a camera\nbehind a digital micromirror device "
               "(DMD).\n\nCommands:\n",
      kName);
  print_list (nodes);
  std::printf ("\n  -h, --help          show this help, or that of a COMMAND\n"
               "  --version           show the version\n");
}

Node
add_node (CLI::App &above, const std::string &path, Command command)
{
  const CommandText &text = command.text;
  CLI::App *app = above.add_subcommand (text.name, text.summary);
  app->set_help_flag ();
  app->add_flag ("-h,--help");
  Node node{path + " " + text.name, std::move (command), app,
      std::make_unique<Options> (*app)};
  node.command.declare (*node.options);
  for (const Command &below : node.command.below)
    node.below.push_back (add_node (*app, node.path, below));
  return node;
}

/* What stands on the command line, in the words of this program. */
std::string
words_for (const CLI::ParseError &error, const CLI::App &app, bool in_group)
{
  if (dynamic_cast<const CLI::ExtrasError *> (&error)) {
    const std::string word = app.remaining (true).front ();
    if (in_group && !word.starts_with ("-"))
      return no_command (word);
    for (const std::string &other : app.remaining (true))
      if (other.starts_with ("-"))
        return "unknown option " + other;
    return word +
           " belongs to no option; name a file with its option, as in "
           "--output " +
           word;
  }
  std::string text = error.what ();
  if (dynamic_cast<const CLI::ArgumentMismatch *> (&error))
    if (const auto end = text.find (": "); text.starts_with ("--"))
      return text.substr (0, end) + " needs a value";
  return text;
}

/* With commands of its own, the one of them; null: there is none. */
const Node *
chosen (const std::vector<Node> &nodes)
{
  for (const Node &node : nodes)
    if (node.app->parsed ()) {
      const Node *below = chosen (node.below);
      return below ? below : &node;
    }
  return nullptr;
}

int
report (const Failure &failure, const std::string &path, bool json)
{
  const std::string &message = failure.error.message;
  const auto command = path.find (' ');
  if (json)
    print_json ({{"error", message}}, 2);
  std::fprintf (stderr, "%s: %s\n",
      command == path.npos ? path.c_str () : path.c_str () + command + 1,
      message.c_str ());
  if (failure.exit == Exit::usage)
    std::fprintf (stderr, "Try: %s --help\n", path.c_str ());
  return int (failure.exit);
}

int
run (int argc, char **argv)
{
  CLI::App app;
  app.set_help_flag ();
  app.add_flag ("-h,--help");
  app.add_flag ("--version");
  app.add_flag ("--build"); // after --version: which build it is
  std::vector<Node> nodes;
  for (const Command &command : all_commands ())
    nodes.push_back (add_node (app, kName, command));

  std::string path = kName;
  const Node *node = nullptr;
  try {
    int own = argc;
    for (const Node &each : nodes) {
      if (argc < 2 || each.command.text.name != argv[1])
        continue;
      if (each.command.run_with)
        each.command.run_with ({argv + 2, argv + argc});
      /* From "--" on, words are another program's, which CLI11 would read. */
      if (each.options->takes_rest ()) {
        own = int (
            std::find (argv + 2, argv + argc, std::string_view ("--")) - argv);
        each.options->end_rest ({argv + own, argv + argc});
      }
    }
    try {
      app.parse (own, argv);
    } catch (const CLI::ParseError &error) {
      node = chosen (nodes);
      if (node)
        path = node->path;
      /* --help wins over what is missing beside it. */
      if (!node || node->app->count ("--help") == 0)
        throw Failure{Exit::usage,
            Error{words_for (error, app, !node || !node->below.empty ())}};
    }
    node = chosen (nodes);
    if (!node) {
      if (app.count ("--version") > 0) {
        std::printf ("%s %s%s\n", kName, VERSION,
            app.count ("--build") > 0 ? (" " + build_id ()).c_str () : "");
        return 0;
      }
      if (app.count ("--help") == 0)
        usage_error ("give a command");
      print_commands (nodes);
      return 0;
    }
    path = node->path;
    if (node->app->count ("--help") > 0) {
      print_help (*node);
      return 0;
    }
    if (!node->below.empty ())
      usage_error ("give one of its commands");
    node->options->finish ();
    return int (node->command.run ());
  } catch (const Failure &failure) {
    return report (failure, path, node && node->options->has ("--json"));
  }
}

/* Flags of a command may stand before it. A command that was called
 * codedexposure-NAME is codedexposure NAME now. */
std::vector<char *>
words_of (int argc, char **argv, std::string &name)
{
  std::vector<char *> words (argv, argv + argc);
  while (words.size () > 2 && (std::string_view (words[1]) == "--json" ||
                                  std::string_view (words[1]) == "--quiet"))
    std::rotate (words.begin () + 1, words.begin () + 2, words.end ());
  const std::string_view called = argv[0];
  const auto base = called.substr (called.rfind ('/') + 1);
  constexpr std::string_view kOld = "codedexposure-";
  if (!base.starts_with (kOld))
    return words;
  name = base.substr (kOld.size ());
  std::fprintf (stderr,
      "%s: this is now \"%s %s\"; the old name goes with the "
      "next version\n",
      std::string (base).c_str (), kName, name.c_str ());
  words.insert (words.begin () + 1, name.data ());
  return words;
}

} // namespace

} // namespace codedexposure::app

int
main (int argc, char **argv)
{
  using namespace codedexposure;
  /* It is for windows, and no other run may end because of it. */
  std::signal (SIGUSR1, SIG_IGN);
  /* A file that may grow no longer is an error, as a full disk is. */
  std::signal (SIGXFSZ, SIG_IGN);
  std::string name;
  auto words = app::words_of (argc, argv, name);
  int code = app::run (int (words.size ()), words.data ());
  if (const auto written = finish_output (); !written) {
    std::fprintf (
        stderr, "codedexposure: %s\n", written.error ().message.c_str ());
    code = int (app::Exit::failed);
  }
  return code;
}
