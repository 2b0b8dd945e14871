#include "estimator/diagnosis/records/internal/record_parts.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kGap = 8.0;         // steps that may lack samples
constexpr double kShortPart = 0.1;   // of the longest part: tells little, and costs as much
constexpr std::size_t kFewTold = 3;  // gaps that are told one by one

struct Span {
  std::size_t begin = 0, end = 0;

  std::size_t size() const { return end - begin; }
};

std::vector<Span> spans_between_gaps(const std::vector<double>& t) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i)
    steps.push_back(t[i] - t[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  std::vector<Span> spans{{0, t.size()}};
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] - t[i - 1] <= kGap * *middle) continue;
    spans.back().end = i;
    spans.push_back({i, t.size()});
  }
  return spans;
}

std::vector<double> cut(const std::vector<double>& column, Span span) {
  if (column.empty()) return {};
  return {column.begin() + static_cast<std::ptrdiff_t>(span.begin),
          column.begin() + static_cast<std::ptrdiff_t>(span.end)};
}

Recording part_of(const Recording& r, Span span) {
  Recording part = r;
  part.name = fmt::format("{} ({:.4g} to {:.4g} s)", r.name, r.t[span.begin], r.t[span.end - 1]);
  for (auto column : {&Recording::t, &Recording::displacement, &Recording::excitation,
                      &Recording::force, &Recording::acceleration})
    part.*column = cut(r.*column, span);
  return part;
}

}  // namespace

RecordParts parts_between_gaps(const Recording& record, std::size_t fewest) {
  const std::vector<Span> spans = spans_between_gaps(record.t);
  if (spans.size() == 1) return {{record}, {}};
  const std::size_t longest = std::ranges::max(spans, {}, &Span::size).size();
  const auto least =
      std::max(static_cast<double>(fewest), kShortPart * static_cast<double>(longest));
  RecordParts out;
  std::string gaps;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (static_cast<double>(spans[i].size()) >= least)
      out.parts.push_back(part_of(record, spans[i]));
    if (i > 0 && i <= kFewTold)
      gaps += fmt::format("{}{:.6g} and {:.6g} s", i > 1 ? "; " : "", record.t[spans[i].begin - 1],
                          record.t[spans[i].begin]);
  }
  if (spans.size() > kFewTold + 1)
    gaps += fmt::format(", and at {} more places", spans.size() - 1 - kFewTold);
  out.notes.push_back(fmt::format(
      "run {}: samples are missing between t = {}: {} of its {} parts are used, each with "
      "a beginning of its own",
      record.name, gaps, out.parts.size(), spans.size()));
  return out;
}

}  // namespace shaker::estimator::diagnosis
