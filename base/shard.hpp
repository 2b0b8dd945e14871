// A long computation in parts: each part takes every count-th case, so that all take about as long.
#pragma once

#include <cstddef>
#include <string>

namespace shaker {

// Part `index` of `count`, from 1 on: the cases index - 1, index - 1 + count, ...
struct Shard {
  std::size_t index = 1, count = 1;
};

// Reads "3/7". Throws std::invalid_argument with a sentence for anything else.
Shard shard_from(const std::string& text);

}  // namespace shaker
