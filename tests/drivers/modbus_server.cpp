#include "modbus_server.hpp"

#include <csignal>
#include <spawn.h>
#include <stdexcept>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace shaker::drivers::modbus {

ModbusServer::ModbusServer(Wire wire) : wire_(wire) {
  start();
}

ModbusServer::~ModbusServer() {
  kill();
}

void ModbusServer::start() {
  int down[2], up[2];
  if (::pipe2(down, O_CLOEXEC) != 0 || ::pipe2(up, O_CLOEXEC) != 0) {
    throw std::runtime_error("no pipe to the Modbus server");
  }
  UniqueFd its_input(down[0]), its_output(up[1]);
  to_ = UniqueFd(down[1]);
  from_ = UniqueFd(up[0]);
  std::vector<std::string> words = {"/usr/bin/python3",
                                    SHAKER_SOURCE_DIR "/tests/drivers/modbus_server.py",
                                    wire_ == Wire::tcp ? "tcp" : "rtu"};
  if (wire_ == Wire::tcp && !place_.empty()) words.push_back(place_);
  std::vector<char*> arguments;
  for (std::string& word : words)
    arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, its_input.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, its_output.get(), STDOUT_FILENO);
  const int failed =
      ::posix_spawn(&child_, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw std::runtime_error("cannot start /usr/bin/python3");
  its_output.reset();  // so that the server's end closes the pipe
  const std::string ready = read_line();
  if (ready.rfind("ready ", 0) != 0) {
    throw std::runtime_error("the Modbus server did not start (is python3-pymodbus installed?)");
  }
  place_ = ready.substr(6);
}

std::string ModbusServer::read_line() {
  std::string line;
  char letter = 0;
  while (::read(from_.get(), &letter, 1) == 1 && letter != '\n')
    line += letter;
  return line;
}

std::string ModbusServer::order(const std::string& text) {
  const std::string line = text + "\n";
  if (::write(to_.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw std::runtime_error("the Modbus server is gone");
  }
  return read_line();
}

void ModbusServer::kill() {
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
  child_ = -1;
}

void ModbusServer::restart() {
  kill();
  start();
}

config::ModbusLink ModbusServer::link() const {
  config::ModbusLink link;
  if (wire_ == Wire::tcp) {
    link.transport = config::ModbusTcp{"127.0.0.1", std::stoi(place_)};
  } else {
    link.transport = config::ModbusRtu{place_, 115200, 'E', 1};
  }
  link.response_timeout_s = 1.0;  // long, because the test machine may be busy
  link.reconnect_s = 0.01;
  return link;
}

}  // namespace shaker::drivers::modbus
