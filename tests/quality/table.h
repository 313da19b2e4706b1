/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Tables of figures for terminals, documents and programs. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

namespace codedexposure::quality
{

/** Text, or a number: infinite prints as "exact", not a number as "-". */
struct Cell {
  Cell (std::string words) : text (std::move (words)) {}
  Cell (const char *words) : text (words) {}
  Cell (double value) : number (value) {}

  bool is_text () const { return !text.empty (); }

  std::string text; // empty for a number
  double number = 0.0;
};

struct Column {
  std::string title;
  int decimals = 1;
};

struct Table {
  std::string id;    ///< one word; finds the table in a document
  std::string title; ///< one line, units included
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows; ///< as many cells as columns, each
};

/** Columns aligned for a terminal. */
std::string to_text (const Table &table);
std::string to_markdown (const Table &table);
/** An object of id, title and rows, each an object keyed by column. */
std::string to_json (const std::vector<Table> &tables);

/**
 * @p document with each table in the place that is marked for it, between
 * "<!-- table ID -->" and "<!-- end -->", each on a line of its own. Error
 * when a table has no place.
 */
Result<std::string> with_tables (
    std::string document, const std::vector<Table> &tables);
/** The same in the file @p path; false, with a word on the standard error, when
 * that cannot be done. */
bool update_document (
    const std::string &path, const std::vector<Table> &tables);

/**
 * The cells of table @p id in a document made so, as text, without its head.
 * Empty when there is none.
 */
std::vector<std::vector<std::string>> table_cells (
    const std::string &document, const std::string &id);

} // namespace codedexposure::quality
