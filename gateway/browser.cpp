#include "gateway/browser.hpp"

#include <algorithm>

namespace shaker::gateway {

Browser::Browser(std::size_t max_waiting, const std::vector<Event>& opening)
    : max_waiting_(max_waiting) {
  for (const Event& event : opening) {
    queue_.push_back(event.text);
    bytes_ += event.text->size();
  }
  owed_ = bytes_;
}

bool Browser::offer(const Event& event) {
  const std::size_t behind = bytes_ - std::min(bytes_, owed_);
  if (event.droppable && behind > max_waiting_ / 10) return true;
  queue_.push_back(event.text);
  bytes_ += event.text->size();
  return behind + event.text->size() <= max_waiting_;
}

std::size_t Browser::read(char* to, std::size_t size) {
  std::size_t done = 0;
  while (done < size && !queue_.empty()) {
    const std::string& first = *queue_.front();
    const std::size_t part = std::min(size - done, first.size() - sent_of_first_);
    std::copy_n(first.data() + sent_of_first_, part, to + done);
    done += part;
    sent_of_first_ += part;
    if (sent_of_first_ < first.size()) break;
    queue_.pop_front();
    sent_of_first_ = 0;
  }
  bytes_ -= done;
  owed_ -= std::min(owed_, done);
  return done;
}

}  // namespace shaker::gateway
