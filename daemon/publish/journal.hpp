// What an operator looks for in the journal afterwards: alarms, changes of state, ends.
#pragma once

#include <string>

#include "protocol/documents.hpp"

namespace shaker::daemon {

// A state is told again as it progresses; `last` holds the last one that was logged.
void log_document(const protocol::Document& document, std::string& last);

}  // namespace shaker::daemon
