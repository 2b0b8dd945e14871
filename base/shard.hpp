// A long computation in parts: each part takes every count-th case, so that all take about as long.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace shaker {

// Part `index` of `count`, from 1 on: the cases index - 1, index - 1 + count, ...
struct Shard {
  std::size_t index = 1, count = 1;
};

// Reads "3/7". Throws std::invalid_argument with a sentence for anything else.
Shard shard_from(const std::string& text);

// Calls `take` for each line of the files that parts have kept: its text, its number in the file
// from 1 on, and its place in words. Throws std::runtime_error for a file that cannot be read.
using TakeLine = std::function<void(const std::string& text, int number, const std::string& here)>;
void each_kept_line(const std::vector<std::filesystem::path>& files, const TakeLine& take);

}  // namespace shaker
