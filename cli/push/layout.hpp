// The tables that `shakerctl push` fills, as SQL for a PostgreSQL server.
#pragma once

#include <string>

namespace shaker::cli {

inline constexpr int kPushLayout = 1;  // the row of table `layout`

// True for a name that needs no quotes in SQL: a lower-case letter or '_', then also digits, at
// most 63 characters.
bool is_schema_name(const std::string& name);

// Makes schema `schema` and its tables. Precondition: is_schema_name(schema).
std::string layout_sql(const std::string& schema);

}  // namespace shaker::cli
