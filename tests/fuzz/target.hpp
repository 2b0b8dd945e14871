// What libFuzzer calls, and what run_short.cpp calls where libFuzzer is not at hand.
#pragma once

#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
