// Fills the JSON of one document: bounds its strings and lists, and leaves out numbers that are
// not finite. For protocol/ only.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "protocol/documents.hpp"

namespace shaker::protocol {

using OrderedJson =
    nlohmann::ordered_json;  // the type and the sequence number come first for readers

inline constexpr std::size_t kMaxName = 96, kMaxText = 1024;  // bytes
inline constexpr std::size_t kMaxChannels = 64;

// At most `limit` bytes; never cuts a UTF-8 character.
inline std::string clip(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return std::string(text);
  std::size_t end = limit - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U)
    --end;
  return std::string(text.substr(0, end)) + "...";
}

// Fills one JSON object; `pointer` is its place in the document.
class Filler {
 public:
  Filler(OrderedJson& object, OrderedJson& omitted, std::string pointer)
      : object_(object), omitted_(omitted), pointer_(std::move(pointer)) {}

  Filler& number(const char* key, double value) {
    if (std::isfinite(value)) {
      object_[key] = value;
    } else {
      omit(key, std::isnan(value) ? "not a number" : value > 0 ? "infinite" : "minus infinite");
    }
    return *this;
  }
  Filler& number(const char* key, const std::optional<double>& value) {
    return value ? number(key, *value) : *this;
  }
  template <class T>
  Filler& put(const char* key, const T& value) {
    object_[key] = value;
    return *this;
  }
  template <class T>
  Filler& put(const char* key, const std::optional<T>& value) {
    if (value) put(key, *value);
    return *this;
  }
  Filler& name(const char* key, const std::string& value) {
    return put(key, clip(value, kMaxName));
  }
  Filler& name(const char* key, const std::optional<std::string>& value) {
    return value ? name(key, *value) : *this;
  }
  Filler& text(const char* key, const std::string& value) {
    return put(key, clip(value, kMaxText));
  }
  void omit(const std::string& key, const std::string& reason) {
    omitted_.push_back({{"pointer", pointer_ + "/" + key}, {"reason", reason}});
  }
  // Number of a list's entries to write; lists the rest under "omitted".
  std::size_t bounded(const char* key, std::size_t count, std::size_t limit) {
    if (count <= limit) return count;
    omit(fmt::format("{}/{}", key, limit), fmt::format("{} more", count - limit));
    return limit;
  }
  Filler inner(const char* list, std::size_t index) {
    OrderedJson& array = object_[list];
    array.push_back(OrderedJson::object());
    return {array.back(), omitted_, fmt::format("{}/{}/{}", pointer_, list, index)};
  }
  OrderedJson& object() { return object_; }

 private:
  OrderedJson& object_;
  OrderedJson& omitted_;
  std::string pointer_;
};

// onlooker_documents.cpp
void fill(Filler& out, const WaveDocument& d);
void fill(Filler& out, const ScopeDocument& d);
void fill(Filler& out, const RigDocument& d);

}  // namespace shaker::protocol
