// Starts modbus_server.py (python3-pymodbus, code that is not ours) and gives it orders.
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

  // One line of modbus_server.py's orders; returns its answer.
  std::string order(const std::string& text);
  // SIGKILL, as a power cut would.
  void kill();
  // On the same port (TCP), or with a new pty that `link` then names.
  void restart();
  // How to reach it, with short pauses for tests.
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
