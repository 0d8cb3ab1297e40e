// Both formats are lines of two numbers in groups. Of an aerofoil the groups may be the elements of a wing,
// each around its trailing edge (Selig), or the two sides of one, both from the leading edge (Lednicer, who
// writes the counts of the sides first).
#include "vdb/detail/outline_parse.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "vdb/detail/surface_parse.h"

namespace lamina::detail {
namespace {

struct Line {
  std::string_view text;
  std::int64_t number;
};

/// Points between two separators, with the line of the first.
struct Group {
  std::vector<Vec2> points;
  std::int64_t line = 0;
};

[[noreturn]] void reject(const std::string& name, std::int64_t line, const std::string& what) {
  throw Error(ErrorCode::kFileFormat, fmt::format("{}:{}: {}", name, line, what));
}

std::vector<Line> lines_of(std::string_view bytes) {
  std::vector<Line> lines;
  for (std::int64_t number = 1; !bytes.empty(); ++number) {
    const std::size_t end = std::min(bytes.find_first_of("\r\n"), bytes.size());
    lines.push_back({trim(bytes.substr(0, end)), number});
    const bool pair = bytes.substr(end, 2) == "\r\n";
    bytes.remove_prefix(std::min(bytes.size(), end + (pair ? 2 : 1)));
  }
  return lines;
}

/// Words parted by white space, commas or semicolons.
std::vector<std::string_view> words_of(std::string_view text) {
  constexpr std::string_view kSeparators = " \t\v\f,;";
  std::vector<std::string_view> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(kSeparators, at)) != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// The numbers of a line; empty when it is words.
std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  for (const std::string_view word : words_of(text)) {
    double x = 0.0;
    if (!parse_number(word, x)) return std::nullopt;
    numbers.push_back(x);
  }
  return numbers;
}

Vec2 point_of(const Line& line, const std::string& name) {
  const auto numbers = numbers_of(line.text);
  if (!numbers)
    reject(name, line.number, fmt::format("\"{}\" is no point: give x and y", printable(line.text)));
  const bool in_space = numbers->size() == 3 && (*numbers)[2] == 0.0;
  if (numbers->size() != 2 && !in_space)
    reject(name, line.number,
           fmt::format("{} numbers in \"{}\": a point of the plane is x and y", numbers->size(),
                       printable(line.text)));
  const Vec2 x((*numbers)[0], (*numbers)[1]);
  constexpr double kLargest = 1e30;
  if (!(std::abs(x[0]) <= kLargest && std::abs(x[1]) <= kLargest))
    reject(name, line.number, fmt::format("\"{}\" is not a finite point", printable(line.text)));
  return x;
}

bool is_comment(const Line& line) { return !line.text.empty() && line.text.front() == '#'; }

/// Lines that begin with a letter, in quotes or brackets, are titles.
bool is_title(const Line& line) {
  if (line.text.empty()) return false;
  const auto numbers = numbers_of(line.text);
  return !numbers && std::string_view("+-.0123456789").find(line.text.front()) == std::string_view::npos;
}

/// Groups of points. The first `skip` lines are passed over.
template <class Parts>
std::vector<Group> groups_of(const std::vector<Line>& lines, std::size_t skip, const std::string& name,
                             Parts&& parts) {
  std::vector<Group> groups(1);
  for (std::size_t i = skip; i < lines.size(); ++i) {
    const Line& line = lines[i];
    if (is_comment(line)) continue;
    if (parts(line)) {
      if (!groups.back().points.empty()) groups.emplace_back();
      continue;
    }
    if (groups.back().points.empty()) groups.back().line = line.number;
    groups.back().points.push_back(point_of(line, name));
  }
  if (groups.back().points.empty()) groups.pop_back();
  if (groups.empty()) throw Error(ErrorCode::kSurfaceEmpty, fmt::format("{}: holds no points", name));
  return groups;
}

double extent_of(const Group& g) {
  Box<2> box;
  for (const Vec2& x : g.points) box.extend(x);
  return box.size().maxCoeff();
}

/// Distance of the ends against the extent: blunt trailing edges are a few per cent of the chord.
double gap_of(const Group& g) {
  const double extent = extent_of(g);
  return extent > 0.0 ? (g.points.back() - g.points.front()).norm() / extent : 0.0;
}

/// Upper and lower side, both from the leading edge, as one curve from the trailing edge around it.
Group joined(const Group& upper, const Group& lower) {
  Group g{{upper.points.rbegin(), upper.points.rend()}, upper.line};
  g.points.insert(g.points.end(), lower.points.begin(), lower.points.end());
  return g;
}

/// The counts of Lednicer's two sides.
std::optional<std::array<std::size_t, 2>> side_counts(const Line& line) {
  const auto n = numbers_of(line.text);
  if (!n || n->size() != 2) return std::nullopt;
  for (const double x : *n)
    if (!(x >= 3.0 && x < 1e6) || x != std::floor(x)) return std::nullopt;
  return std::array{static_cast<std::size_t>((*n)[0]), static_cast<std::size_t>((*n)[1])};
}

Group lednicer(std::vector<Group> groups, const std::array<std::size_t, 2>& counts, std::int64_t line,
               const std::string& name) {
  Group all = groups.front();
  for (std::size_t i = 1; i < groups.size(); ++i)
    all.points.insert(all.points.end(), groups[i].points.begin(), groups[i].points.end());
  if (all.points.size() != counts[0] + counts[1])
    reject(name, line,
           fmt::format("{} and {} points are announced, {} follow: complete the file, or remove this line",
                       counts[0], counts[1], all.points.size()));
  const auto middle = all.points.begin() + static_cast<std::ptrdiff_t>(counts[0]);
  return joined({{all.points.begin(), middle}, all.line}, {{middle, all.points.end()}, all.line});
}

OutlineCurve aerofoil_of(Group g, const std::string& name) {
  constexpr double kBluntest = 0.25;
  if (g.points.size() < 4)
    reject(name, g.line, fmt::format("{} points are too few for an aerofoil", g.points.size()));
  if (gap_of(g) > kBluntest)
    reject(
        name, g.line,
        fmt::format("the aerofoil does not close: it begins at ({:g}, {:g}) and ends at ({:g}, {:g}); list "
                    "the points from the trailing edge around the leading edge and back, or as .csv",
                    g.points.front()[0], g.points.front()[1], g.points.back()[0], g.points.back()[1]));
  if (g.points.front() == g.points.back()) g.points.pop_back();
  return {.points = std::move(g.points), .closed = true, .smooth = true};
}

}  // namespace

Outline parse_aerofoil(std::string_view bytes, const std::string& name) {
  const std::vector<Line> lines = lines_of(bytes);
  // Titles come first; one may be made of digits ("0012"), but not of two numbers.
  std::size_t first = 0;
  while (first < lines.size()) {
    const auto numbers = numbers_of(lines[first].text);
    if (numbers && numbers->size() >= 2) break;
    ++first;
  }
  constexpr double kSeparator = 999.0;  // of the elements of a wing, in MSES
  const auto parts = [&](const Line& line) {
    if (line.text.empty() || is_title(line)) return true;
    const auto n = numbers_of(line.text);
    return n && n->size() == 2 && (*n)[0] == kSeparator && (*n)[1] == kSeparator;
  };
  const auto counts = first < lines.size() ? side_counts(lines[first]) : std::nullopt;
  std::vector<Group> groups = groups_of(lines, first + (counts ? 1 : 0), name, parts);
  Outline outline;
  if (counts) {
    outline.curves.push_back(
        aerofoil_of(lednicer(std::move(groups), *counts, lines[first].number, name), name));
    return outline;
  }
  constexpr double kOneSided = 0.5;
  if (groups.size() == 2 && gap_of(groups[0]) > kOneSided && gap_of(groups[1]) > kOneSided)
    groups = {joined(groups[0], groups[1])};
  for (Group& g : groups) outline.curves.push_back(aerofoil_of(std::move(g), name));
  return outline;
}

Outline parse_points(std::string_view bytes, const std::string& name) {
  std::vector<Line> lines = lines_of(bytes);
  // One line of column names may stand before all points.
  std::size_t first = 0;
  while (first < lines.size() && (lines[first].text.empty() || is_comment(lines[first]))) ++first;
  if (first < lines.size() && is_title(lines[first])) ++first;
  constexpr double kSame = 1e-9;  // of the extent: written with nine digits or more
  Outline outline;
  for (Group& g : groups_of(lines, first, name, [](const Line& line) { return line.text.empty(); })) {
    if (g.points.size() < 2)
      reject(name, g.line, "a curve of one point: a blank line ends a curve; give it two points at least");
    const bool closed = g.points.size() > 2 && gap_of(g) <= kSame;
    if (closed) g.points.pop_back();
    outline.curves.push_back({.points = std::move(g.points), .closed = closed, .smooth = false});
  }
  return outline;
}

}  // namespace lamina::detail
