// Pictures for pages and reports, as SVG for an HTML page or a file: curves, bands, points,
// bars and maps over two axes. Pure; any thread.
//
// People with colour-vision deficiency can distinguish the colours; the stroke of the line
// helps too. A picture is dark on white, so that it can be printed.
#pragma once

#include <string>
#include <vector>

#include "report/plot/axis.hpp"

namespace shaker::report {

enum class Ink { first, second, third, fourth, quiet };  // blue, orange, green, purple, grey
enum class Stroke { line, dashed, points, steps };

struct Curve {
  std::string name;          // in the legend; empty: no entry
  std::vector<double> x, y;  // of equal length; a value that is not finite interrupts the curve
  Ink ink = Ink::first;
  Stroke stroke = Stroke::line;
};

// The area between two curves over the same x.
struct Band {
  std::string name;
  std::vector<double> x, lower, upper;
  Ink ink = Ink::first;
};

// A vertical or horizontal line with a text.
struct Mark {
  std::string text;
  double at = 0.0;
  bool vertical = true;
};

struct Plot {
  std::string title;  // one sentence that says what to see
  Axis x, y;
  std::vector<Band> bands;
  std::vector<Curve> curves;
  std::vector<Mark> marks;
  int width = 560, height = 340;
};

// One group of bars for each label, one bar for each series: values[series][label].
struct Bars {
  std::string title;
  std::vector<std::string> labels, series;
  std::vector<std::vector<double>> values;
  Axis y;
  std::vector<Mark> marks;  // horizontal lines
  int width = 560, height = 340;
  std::vector<Ink> inks = {Ink::first, Ink::second, Ink::third, Ink::fourth};  // by series
};

// Values over cells of a plane; a cell without a finite value stays empty. Negative values are
// blue, positive ones red, zero is white.
struct Map {
  std::string title, unit;
  std::vector<double> x_edges, y_edges;  // one more than there are cells
  std::vector<double> values;            // row by row: y times x
  std::vector<char> dotted;              // for each value: a dot in the cell; may be empty
  Axis x, y;
  int width = 560, height = 360;
};

std::string to_svg(const Plot& plot);
std::string to_svg(const Bars& bars);
std::string to_svg(const Map& map);

// The same as a separate SVG file, with its style inside.
std::string svg_file(const std::string& svg);

// The content of the <style> element that a page with these pictures needs once.
std::string plot_style();

// Escapes & < > " ' in text for HTML and SVG.
std::string escaped(const std::string& text);

}  // namespace shaker::report
