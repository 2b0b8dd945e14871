// A checksum in each row of a campaign: SQLite notices a damaged structure, not a damaged value.
//
// `row_sum(value, ...)` is an SQL function, CRC-32 of the values and their types. A row is written
// with that of its other columns, those that change later left out. Private to record/.
#pragma once

#include <cstdint>

#include <SQLiteCpp/SQLiteCpp.h>

namespace shaker::record {

// Must be called on each connection that writes or checks. Throws SQLite::Exception.
void add_row_sum(SQLite::Database& database);

// Rows that do not fit their checksum; 0 for a layout that has none. Reads every row. Throws
// SQLite::Exception.
std::int64_t unsound_rows(SQLite::Database& database);

// Removes them, all but the one that describes the campaign.
void drop_unsound_rows(SQLite::Database& database);

}  // namespace shaker::record
