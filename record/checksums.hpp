// A checksum in each row of a campaign. SQLite detects a damaged structure, but not a damaged
// value.
//
// `row_sum(value, ...)` is an SQL function, the CRC-32 of the values and their types. Each row
// is written with the sum of its other columns, except those that change later. Private to
// record/.
#pragma once

#include <cstdint>

#include <SQLiteCpp/SQLiteCpp.h>

namespace shaker::record {

// Call for each connection that writes or checks. Throws SQLite::Exception.
void add_row_sum(SQLite::Database& database);

// Number of rows that do not match their checksum; 0 for a layout without checksums. Reads
// every row. Throws SQLite::Exception.
std::int64_t unsound_rows(SQLite::Database& database);

// Removes these rows, except the one that describes the campaign. Throws SQLite::Exception.
void drop_unsound_rows(SQLite::Database& database);

}  // namespace shaker::record
