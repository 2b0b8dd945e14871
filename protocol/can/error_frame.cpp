#include "protocol/can/error_frame.hpp"

#include <array>
#include <iterator>
#include <string_view>

#include <fmt/format.h>
#include <linux/can/error.h>

namespace shaker::protocol::can {
namespace {

struct Row {
  std::uint32_t bit;
  std::string_view says;
};

// The most severe class first: the sentence describes the first one that applies.
constexpr std::array kClasses = {
    Row{CAN_ERR_BUSOFF,
        "the controller is bus-off and sends and receives nothing: check wiring, termination (two "
        "times "
        "120 ohm) and bit rate; it comes back by itself only with 'ip link set {} type can "
        "restart-ms 100'"},
    Row{CAN_ERR_RESTARTED, "the controller has been restarted after bus-off"},
    Row{CAN_ERR_TRX,
        "the transceiver reports a fault: check CAN_H and CAN_L for a short or a break"},
    Row{CAN_ERR_ACK,
        "nobody acknowledges frames: is another node powered, and at the same bit rate?"},
    Row{CAN_ERR_TX_TIMEOUT,
        "the driver could not send in time: check that another node is on the bus"},
    Row{CAN_ERR_BUSERROR, "bus errors: check wiring, termination and bit rate"},
    Row{CAN_ERR_PROT,
        "a frame broke the bus protocol: check bit rate, sample point and termination"},
    Row{CAN_ERR_LOSTARB,
        "lost arbitration: another node sends with the same or a stronger identifier"},
};

struct ControllerRow {
  std::uint8_t bit;
  std::string_view says;
};
constexpr std::array kController = {
    ControllerRow{CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE,
                  "the controller is error-passive (128 errors), bus-off is next: check wiring, "
                  "termination and bit rate"},
    ControllerRow{CAN_ERR_CRTL_RX_OVERFLOW,
                  "the adapter's receive buffer ran over and frames are lost: lower the bus load"},
    ControllerRow{CAN_ERR_CRTL_TX_OVERFLOW,
                  "the adapter's send buffer ran over and frames are lost: lower the bus load"},
    ControllerRow{CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING,
                  "the controller has counted 96 errors: check wiring, termination and bit rate"},
    ControllerRow{CAN_ERR_CRTL_ACTIVE, "the controller is error-active again"},
};

std::uint8_t controller_state(const Frame& frame) {
  return (frame.id & CAN_ERR_CRTL) != 0 && frame.length > 1 ? frame.data[1] : std::uint8_t{0};
}

}  // namespace

ErrorReport interpret_error(const Frame& frame) {
  const std::uint8_t state = controller_state(frame);
  ErrorReport report;
  report.bus_off = (frame.id & CAN_ERR_BUSOFF) != 0;
  report.restarted = (frame.id & CAN_ERR_RESTARTED) != 0;
  report.passive = (state & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0;
  report.lost = (state & CAN_ERR_CRTL_RX_OVERFLOW) != 0 ? 1 : 0;
  return report;
}

void describe_error(const Frame& frame, const std::string& interface, std::string& text) {
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{}: ", interface);
  for (const Row& row : kClasses) {
    if ((frame.id & row.bit) == 0) continue;
    fmt::format_to(out, fmt::runtime(row.says), interface);
    return;
  }
  const std::uint8_t state = controller_state(frame);
  for (const ControllerRow& row : kController) {
    if ((state & row.bit) == 0) continue;
    fmt::format_to(out, "{}", row.says);
    return;
  }
  fmt::format_to(out, "the adapter reports trouble of class 0x{:x}: see linux/can/error.h",
                 frame.id);
}

}  // namespace shaker::protocol::can
