#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/modbus/block.hpp"
#include "protocol/modbus/exception.hpp"

namespace shaker::protocol::modbus {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

RegisterSpec at(int address, RegisterType type = RegisterType::u16,
                RegisterTable table = RegisterTable::holding) {
  RegisterSpec spec;
  spec.address = address;
  spec.type = type;
  spec.table = table;
  return spec;
}

TEST(ModbusBlocks, JoinAdjacentRegistersAndLeaveHolesAlone) {
  const std::vector<RegisterSpec> specs = {at(4), at(0, RegisterType::f32),
                                           at(2, RegisterType::u32), at(6),
                                           at(0, RegisterType::u16, RegisterTable::input)};
  const Plan plan = plan_reads(specs);
  EXPECT_THAT(plan.blocks,
              ElementsAre(Block{RegisterTable::holding, 0, 5}, Block{RegisterTable::holding, 6, 1},
                          Block{RegisterTable::input, 0, 1}));
  EXPECT_EQ(plan.placements[0].offset, 4);
  EXPECT_EQ(plan.placements[2].offset, 2);
  EXPECT_EQ(plan.placements[3].block, 1);
  EXPECT_EQ(plan.placements[4].block, 2);
}

TEST(ModbusBlocks, NeverSplitA32BitValueAtTheLimit) {
  std::vector<RegisterSpec> specs;
  for (int address = 0; address < 260; address += 2)
    specs.push_back(at(address, RegisterType::i32));
  const Plan reads = plan_reads(specs);
  EXPECT_THAT(reads.blocks, ElementsAre(Block{RegisterTable::holding, 0, 124},
                                        Block{RegisterTable::holding, 124, 124},
                                        Block{RegisterTable::holding, 248, 12}));
  const Result<Plan> writes = plan_writes(specs);
  ASSERT_TRUE(writes);
  EXPECT_EQ(writes->blocks[0].words, 122);
}

TEST(ModbusBlocks, HoldEveryValueWholeWhateverTheMap) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<RegisterSpec> specs;
    for (int i = 0; i < 120; ++i) {
      specs.push_back(at(static_cast<int>(random() % 400),
                         random() % 2 ? RegisterType::u16 : RegisterType::f32));
    }
    const Plan plan = plan_reads(specs);
    for (std::size_t i = 0; i < specs.size(); ++i) {
      const Placement place = plan.placements[i];
      const Block& block = plan.blocks[static_cast<std::size_t>(place.block)];
      EXPECT_LE(block.words, kMaxReadWords);
      EXPECT_EQ(block.address + place.offset, specs[i].address);
      EXPECT_LE(place.offset + word_count(specs[i].type), block.words);
    }
  }
}

TEST(ModbusBlocks, RefuseToWriteOneRegisterTwiceOrAnInputRegister) {
  const std::vector<RegisterSpec> overlap = {at(0, RegisterType::f32), at(1)};
  const Result<Plan> plan = plan_writes(overlap);
  ASSERT_FALSE(plan);
  EXPECT_THAT(plan.error().what, HasSubstr("register 1 "));
  const std::vector<RegisterSpec> input = {at(0, RegisterType::u16, RegisterTable::input)};
  EXPECT_FALSE(plan_writes(input));
}

TEST(ModbusException, HasASentenceWithARemedyForEveryCode) {
  std::vector<std::string> seen;
  for (int code = 0x01; code <= 0x0B; ++code) {
    const std::string sentence = exception_sentence(code);
    EXPECT_THAT(sentence, HasSubstr("; ")) << "meaning; remedy";
    EXPECT_THAT(seen, ::testing::Not(::testing::Contains(sentence)));
    seen.push_back(sentence);
  }
  EXPECT_THAT(exception_sentence(0x0A), HasSubstr("exception 0A: the gateway has no path"));
  EXPECT_THAT(exception_sentence(0x55), HasSubstr("exception 55: not a code of the standard"));
}

TEST(ModbusException, FiveIsNoErrorAndSixMeansRetry) {
  EXPECT_EQ(reaction_to(0x05), Reaction::accepted);
  EXPECT_EQ(reaction_to(0x06), Reaction::retry);
  for (const int code : {0x01, 0x02, 0x03, 0x04, 0x07, 0x08, 0x09, 0x0A, 0x0B, 0xFF}) {
    EXPECT_EQ(reaction_to(code), Reaction::give_up) << code;
  }
}

}  // namespace
}  // namespace shaker::protocol::modbus
