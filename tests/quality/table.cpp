/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Tables of figures for terminals, documents and programs. */
#include "table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>

#include <nlohmann/json.hpp>

namespace codedexposure::quality
{

namespace
{

constexpr const char *kEndMark = "<!-- end -->\n";

std::string
begin_mark (const std::string &id)
{
  return "<!-- table " + id + " -->\n";
}

std::string
cell_text (const Cell &cell, int decimals)
{
  if (cell.is_text ())
    return cell.text;
  if (std::isinf (cell.number))
    return "exact";
  if (std::isnan (cell.number))
    return "-";
  char text[64];
  std::snprintf (text, sizeof text, "%.*f", decimals, cell.number);
  return text;
}

/* Titles and cells as text, titles first. */
std::vector<std::vector<std::string>>
texts_of (const Table &table)
{
  std::vector<std::vector<std::string>> texts (1);
  for (const Column &column : table.columns)
    texts[0].push_back (column.title);
  for (const auto &row : table.rows) {
    auto &line = texts.emplace_back ();
    for (std::size_t c = 0; c < row.size (); c++)
      line.push_back (cell_text (row[c], table.columns[c].decimals));
  }
  return texts;
}

bool
is_text (const Table &table, std::size_t column)
{
  return !table.rows.empty () && table.rows[0][column].is_text ();
}

/* The same, every column as wide as its widest cell: texts to the left, numbers
 * to the right. */
std::vector<std::vector<std::string>>
aligned_texts_of (const Table &table)
{
  auto texts = texts_of (table);
  for (std::size_t c = 0; c < table.columns.size (); c++) {
    std::size_t width = 3;
    for (const auto &line : texts)
      width = std::max (width, line[c].size ());
    for (auto &line : texts) {
      const std::size_t missing = width - line[c].size ();
      line[c].insert (is_text (table, c) ? line[c].size () : 0, missing, ' ');
    }
  }
  return texts;
}

std::string
markdown_row (const std::vector<std::string> &cells)
{
  std::string row = "|";
  for (const std::string &cell : cells)
    row.append (" ").append (cell).append (" |");
  return row.append ("\n");
}

std::string
trimmed (const std::string &text)
{
  const auto first = text.find_first_not_of (' ');
  if (first == std::string::npos)
    return "";
  return text.substr (first, text.find_last_not_of (' ') - first + 1);
}

} // namespace

std::string
to_text (const Table &table)
{
  std::string out = table.title + "\n";
  for (const auto &line : aligned_texts_of (table)) {
    std::string row;
    for (const std::string &cell : line)
      row.append ("  ").append (cell);
    out += row.substr (0, row.find_last_not_of (' ') + 1) + "\n";
  }
  return out;
}

std::string
to_markdown (const Table &table)
{
  auto lines = aligned_texts_of (table);
  std::vector<std::string> rule;
  for (std::size_t c = 0; c < table.columns.size (); c++) {
    rule.emplace_back (lines[0][c].size (), '-');
    rule.back ().back () = is_text (table, c) ? '-' : ':';
  }
  lines.insert (lines.begin () + 1, std::move (rule));
  std::string out = table.title + ":\n\n";
  for (const auto &line : lines)
    out += markdown_row (line);
  return out + "\n";
}

std::string
to_json (const std::vector<Table> &tables)
{
  auto all = nlohmann::ordered_json::array ();
  for (const Table &table : tables) {
    auto rows = nlohmann::ordered_json::array ();
    for (const auto &row : table.rows) {
      nlohmann::ordered_json object;
      for (std::size_t c = 0; c < row.size (); c++) {
        auto &value = object[table.columns[c].title];
        if (row[c].is_text () || !std::isfinite (row[c].number))
          value = cell_text (row[c], 0);
        else
          value = row[c].number;
      }
      rows.push_back (std::move (object));
    }
    all.push_back (
        {{"id", table.id}, {"title", table.title}, {"rows", std::move (rows)}});
  }
  return all.dump (2) + "\n";
}

Result<std::string>
with_tables (std::string document, const std::vector<Table> &tables)
{
  for (const Table &table : tables) {
    const std::string mark = begin_mark (table.id);
    const auto begin = document.find (mark);
    const auto end = document.find (kEndMark, begin);
    if (begin == std::string::npos || end == std::string::npos)
      return Error{"the document has no place for table " + table.id +
                   ": add a line \"" + mark.substr (0, mark.size () - 1) +
                   "\" and below it a line \"<!-- end -->\""};
    const auto inside = begin + mark.size ();
    document.replace (inside, end - inside, to_markdown (table));
  }
  return document;
}

bool
update_document (const std::string &path, const std::vector<Table> &tables)
{
  std::ifstream in (path);
  const std::string document (std::istreambuf_iterator<char> (in), {});
  const auto updated = with_tables (document, tables);
  if (!updated) {
    std::cerr << path << ": " << updated.error ().message << '\n';
    return false;
  }
  std::ofstream out (path);
  out << *updated << std::flush;
  if (!out)
    std::cerr << path << ": it cannot be written\n";
  return bool (out);
}

std::vector<std::vector<std::string>>
table_cells (const std::string &document, const std::string &id)
{
  const auto begin = document.find (begin_mark (id));
  if (begin == std::string::npos)
    return {};
  std::istringstream lines (
      document.substr (begin, document.find (kEndMark, begin) - begin));
  std::vector<std::vector<std::string>> rows;
  int head = 2; // titles and rule
  for (std::string line; std::getline (lines, line);) {
    if (line.empty () || line[0] != '|' || head-- > 0)
      continue;
    std::istringstream cells (line.substr (1));
    auto &row = rows.emplace_back ();
    for (std::string cell; std::getline (cells, cell, '|');)
      row.push_back (trimmed (cell));
  }
  return rows;
}

} // namespace codedexposure::quality
