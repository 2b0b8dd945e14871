#include "report/plot/plot.hpp"

namespace shaker::report {

std::string escaped(const std::string& text) {
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

// The colours of Okabe and Ito, which people with any kind of colour vision can distinguish.
std::string plot_style() {
  return R"(svg.plot{font:12px system-ui,"DejaVu Sans",sans-serif;fill:#222;background:#fff;max-width:100%;height:auto}
svg.plot .title{font-size:13px;font-weight:600}
svg.plot .tick,svg.plot .label{fill:#444}
svg.plot .said{paint-order:stroke;stroke:#fff;stroke-width:4px;stroke-linejoin:round}
svg.plot .grid{stroke:#e4e4e4;fill:none}
svg.plot .axis{stroke:#666;fill:none}
svg.plot .mark{stroke:#444;stroke-dasharray:2 3;fill:none}
svg.plot .curve{fill:none;stroke-width:1.8;stroke-linejoin:round}
svg.plot .dashed{stroke-dasharray:7 4}
svg.plot .dots{fill:none;stroke-width:4;stroke-linecap:round}
svg.plot .band{opacity:.22;stroke:none}
svg.plot .ink1{stroke:#0072b2}svg.plot .ink2{stroke:#d55e00}svg.plot .ink3{stroke:#009e73}svg.plot .ink4{stroke:#7b4fa0}svg.plot .quiet{stroke:#999}
svg.plot .fill,svg.plot .band{stroke:none}
svg.plot .fill.ink1,svg.plot .band.ink1{fill:#0072b2}svg.plot .fill.ink2,svg.plot .band.ink2{fill:#d55e00}svg.plot .fill.ink3,svg.plot .band.ink3{fill:#009e73}svg.plot .fill.ink4,svg.plot .band.ink4{fill:#7b4fa0}svg.plot .band.quiet{fill:#999}
)";
}

std::string svg_file(const std::string& svg) {
  const auto end = svg.find('>') + 1;
  return svg.substr(0, end) + "<style>" + plot_style() + "</style>" + svg.substr(end);
}

}  // namespace shaker::report
