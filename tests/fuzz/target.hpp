// The function that libFuzzer calls; run_short.cpp calls it when libFuzzer is not available.
#pragma once

#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
