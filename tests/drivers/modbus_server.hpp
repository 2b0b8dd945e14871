// Starts modbus_server.py, which uses python3-pymodbus, and sends it orders.
#pragma once

#include <string>

#include <sys/types.h>

#include "base/unique_fd.hpp"
#include "config/rig.hpp"

namespace shaker::drivers::modbus {

class ModbusServer {
 public:
  enum class Wire { tcp, rtu };

  explicit ModbusServer(Wire wire);
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;
  ~ModbusServer();

  // Sends one order line (see modbus_server.py) and returns the answer.
  std::string order(const std::string& text);
  // SIGKILL, like a power cut.
  void kill();
  // Restarts on the same port (TCP), or with a new pty that `link` then names.
  void restart();
  // The address of the server, with short pauses for tests.
  config::ModbusLink link() const;

 private:
  void start();
  std::string read_line();

  Wire wire_;
  std::string place_;  // port or pty
  pid_t child_ = -1;
  UniqueFd to_, from_;
};

}  // namespace shaker::drivers::modbus
