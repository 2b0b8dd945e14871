#include "protocol/modbus/block.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include <fmt/format.h>

namespace shaker::protocol::modbus {
namespace {

std::vector<std::size_t> by_address(std::span<const RegisterSpec> specs) {
  std::vector<std::size_t> order(specs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(specs[a].table, specs[a].address) <
           std::tuple(specs[b].table, specs[b].address);
  });
  return order;
}

}  // namespace

Plan plan_reads(std::span<const RegisterSpec> specs, int max_words) {
  Plan plan;
  plan.placements.resize(specs.size());
  for (const std::size_t i : by_address(specs)) {
    const RegisterSpec& spec = specs[i];
    const int end = spec.address + word_count(spec.type);
    const bool joins = !plan.blocks.empty() && plan.blocks.back().table == spec.table &&
                       spec.address <= plan.blocks.back().address + plan.blocks.back().words &&
                       end - plan.blocks.back().address <= max_words;
    if (!joins) plan.blocks.push_back({spec.table, spec.address, 0});
    Block& block = plan.blocks.back();
    block.words = std::max(block.words, end - block.address);
    plan.placements[i] = {static_cast<int>(plan.blocks.size()) - 1, spec.address - block.address};
  }
  return plan;
}

Result<Plan> plan_writes(std::span<const RegisterSpec> specs, int max_words) {
  int free_from = 0;
  for (const std::size_t i : by_address(specs)) {
    const RegisterSpec& spec = specs[i];
    if (spec.table != RegisterTable::holding) {
      return Error{ErrorKind::invalid,
                   fmt::format("input register {} cannot be written: only holding registers can",
                               spec.address)};
    }
    if (spec.address < free_from) {
      return Error{ErrorKind::invalid,
                   fmt::format("register {} is part of two values that are written: addresses "
                               "must not overlap (a 32-bit value takes two)",
                               spec.address)};
    }
    free_from = spec.address + word_count(spec.type);
  }
  return plan_reads(specs, max_words);
}

}  // namespace shaker::protocol::modbus
