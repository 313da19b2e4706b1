/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Runs a fuzz target over its corpus and a fixed set of mutations, which every
 * build can do without a fuzzer. */
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

extern "C" int LLVMFuzzerTestOneInput (const std::uint8_t *, std::size_t);

namespace
{

constexpr int kMutations = 50'000;

using Corpus = std::vector<std::string>;

/** The files of the folder that CORPUS names, in the order of their names. */
Corpus
read_corpus ()
{
  const char *folder = std::getenv ("CORPUS");
  if (folder == nullptr)
    return {};
  std::vector<std::filesystem::path> paths;
  for (const auto &entry : std::filesystem::directory_iterator (folder))
    paths.push_back (entry.path ());
  std::sort (paths.begin (), paths.end ());

  Corpus corpus;
  for (const auto &path : paths) {
    std::ifstream file (path, std::ios::binary);
    corpus.emplace_back (std::istreambuf_iterator<char> (file),
        std::istreambuf_iterator<char> ());
  }
  return corpus;
}

void
run (const std::string &input)
{
  EXPECT_EQ (LLVMFuzzerTestOneInput (
                 reinterpret_cast<const std::uint8_t *> (input.data ()),
                 input.size ()),
      0);
}

class Mutator
{
public:
  explicit Mutator (const Corpus &corpus) : corpus_ (corpus) {}

  std::string draw ()
  {
    std::string text = any ();
    for (int steps = 1 + below (4); steps > 0; steps--)
      mutate (text);
    return text;
  }

private:
  int below (std::size_t bound) { return int (random_ () % bound); }
  const std::string &any ()
  {
    return corpus_[std::size_t (below (corpus_.size ()))];
  }
  std::size_t place (const std::string &text)
  {
    return std::size_t (below (text.size () + 1));
  }
  std::string piece (const std::string &text)
  {
    return text.substr (place (text), std::size_t (1 + below (12)));
  }

  void mutate (std::string &text)
  {
    static const std::string kLively = "0123456789/,:=.-x\"[]{}\\ e\xff\xc3";
    const std::size_t at = place (text);
    switch (below (5)) {
    case 0:
      text.insert (at, 1, kLively[std::size_t (below (kLively.size ()))]);
      break;
    case 1:
      text.erase (at, std::size_t (1 + below (4)));
      break;
    case 2:
      if (at < text.size ())
        text[at] = char (text[at] ^ 1 << below (8));
      break;
    case 3:
      text.insert (at, piece (text));
      break;
    default:
      text.replace (at, std::size_t (below (12)), piece (any ()));
    }
  }

  const Corpus &corpus_;
  std::mt19937 random_{1};
};

} // namespace

TEST (Replay, Corpus)
{
  const Corpus corpus = read_corpus ();
  ASSERT_FALSE (corpus.empty ()) << "CORPUS must name the folder of the seeds";
  for (const std::string &input : corpus)
    run (input);
}

TEST (Replay, Mutations)
{
  const Corpus corpus = read_corpus ();
  ASSERT_FALSE (corpus.empty ()) << "CORPUS must name the folder of the seeds";
  Mutator mutator (corpus);
  for (int i = 0; i < kMutations; i++)
    run (mutator.draw ());
}
