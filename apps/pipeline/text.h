// Small helpers on words: the nearest known name, and numbers that are read back as they were written.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/types.h"

namespace lamina {

/// The candidate within a third of its length (at least 2 edits: insert, delete, replace, swap neighbours)
/// that is nearest to `word`, the first of equals; empty when none is.
std::string nearest_name(std::string_view word, const std::vector<std::string>& candidates);

/// " (did you mean X?)", or "" when nothing is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

/// The shortest decimal that reads back as the same double.
std::string shortest(double value);

/// The whole of `text` as a finite number; empty when it is none. Independent of the locale.
std::optional<double> parse_number(std::string_view text);

/// Words of `text` in lines of at most `width` columns, each but the first begun with `indent`; `column` is
/// where the first one starts.
std::string wrapped(std::string_view text, std::size_t width, std::string_view indent,
                    std::size_t column = 0);

/// Lower corner, then the upper one: four numbers where the box is one of the plane (core/planar.h).
std::vector<double> box_numbers(const Box<3>& box);
/// The same in words: "0 0 0 1 1 1".
std::string box_text(const Box<3>& box);

/// "a, b, c".
std::string join(const std::vector<std::string>& words, std::string_view separator = ", ");

}  // namespace lamina
