#include "drivers/factory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::drivers {
namespace {

TEST(Factory, NamesThePartOfTheRigFileThatItCannotMake) {
  RealClock clock;
  config::RigConfig rig;
  config::ModbusExciter exciter;
  std::get<config::ModbusTcp>(exciter.link.transport).host = "no such host";
  rig.exciter.device = exciter;
  const Result<Devices> devices = make_devices(rig, clock);
  ASSERT_FALSE(devices);
  EXPECT_THAT(devices.error().what, testing::StartsWith("exciter: "));
}

}  // namespace
}  // namespace shaker::drivers
