// Pictures for pages and reports, as SVG that stands alone inside an HTML page or a file: curves,
// bands, points, bars and maps over two axes. Pure; any thread.
//
// Colours are told apart by people who do not see all of them, and by the shape of the line; a
// picture is dark on white, so that it prints.
#pragma once

#include <string>
#include <vector>

#include "report/plot/axis.hpp"

namespace shaker::report {

enum class Ink { first, second, third, fourth, quiet };  // blue, orange, green, purple, grey
enum class Stroke { line, dashed, points, steps };

struct Curve {
  std::string name;          // in the legend; empty: not there
  std::vector<double> x, y;  // of one length; a value that is not finite interrupts the curve
  Ink ink = Ink::first;
  Stroke stroke = Stroke::line;
};

// The area between two curves over the same x.
struct Band {
  std::string name;
  std::vector<double> x, lower, upper;
  Ink ink = Ink::first;
};

// A vertical or horizontal line that says something.
struct Mark {
  std::string text;
  double at = 0.0;
  bool vertical = true;
};

struct Plot {
  std::string title;  // one sentence that says what there is to see
  Axis x, y;
  std::vector<Band> bands;
  std::vector<Curve> curves;
  std::vector<Mark> marks;
  int width = 560, height = 340;
};

// One group of bars a label, one bar a series: values[series][label].
struct Bars {
  std::string title;
  std::vector<std::string> labels, series;
  std::vector<std::vector<double>> values;
  Axis y;
  std::vector<Mark> marks;  // horizontal ones
  int width = 560, height = 340;
  std::vector<Ink> inks = {Ink::first, Ink::second, Ink::third, Ink::fourth};  // of the series
};

// Values over cells of a plane; a cell without a finite value stays empty. Blue is negative, red
// positive, white nothing.
struct Map {
  std::string title, unit;
  std::vector<double> x_edges, y_edges;  // one more than cells
  std::vector<double> values;            // row by row: y times x
  std::vector<char> dotted;              // of each value, or empty: a dot in the cell's middle
  Axis x, y;
  int width = 560, height = 360;
};

std::string to_svg(const Plot& plot);
std::string to_svg(const Bars& bars);
std::string to_svg(const Map& map);

// The same as a file of its own, with the style inside.
std::string svg_file(const std::string& svg);

// What pages that hold these pictures need once: the content of a <style>.
std::string plot_style();

// For text in HTML and SVG: & < > " '.
std::string escaped(const std::string& text);

}  // namespace shaker::report
