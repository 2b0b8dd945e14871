// Writes to the log what an operator needs later: alarms, changes of state, ends of runs and
// diagnoses.
#pragma once

#include <string>

#include "protocol/documents.hpp"

namespace shaker::daemon {

// Logs a document. A state document is published repeatedly; `last` holds the last one that was
// logged.
void log_document(const protocol::Document& document, std::string& last);

}  // namespace shaker::daemon
