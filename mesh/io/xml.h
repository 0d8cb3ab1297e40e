// A pull scanner for the subset of XML that VTK files use: elements, attributes, text, comments and
// declarations.
//
// A library was rejected because the raw appended data of a .vtu is not XML: here the caller stops at any
// element and takes the bytes behind it. Document types that declare something, CDATA and processing beyond
// the five named entities are refused.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "mesh/io/raw.h"

namespace lamina::io {

struct XmlAttribute {
  std::string_view name;
  std::string_view value;  ///< as written, entities not replaced
};

struct XmlEvent {
  enum class Kind { kOpen, kClose, kText, kEnd };
  Kind kind = Kind::kEnd;
  std::string_view name;  ///< of the element, for kOpen and kClose
  std::string_view text;  ///< for kText, never blank
  std::vector<XmlAttribute> attributes;
  std::size_t offset = 0;  ///< of the event in the file

  /// Value of an attribute, or `fallback`.
  [[nodiscard]] std::string_view attribute(std::string_view key, std::string_view fallback = {}) const;
};

class XmlScanner {
 public:
  explicit XmlScanner(const Source& source) : source_(&source) {}

  /// The next event; an empty element gives kOpen and kClose. Errors: kFileFormat with the line for anything
  /// that is not well formed, among it closing tags that do not match.
  XmlEvent next();
  /// Byte behind the last event.
  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  bool skip_markup();
  [[nodiscard]] bool declares_nothing() const;
  XmlEvent open_tag();
  XmlEvent close_tag();
  std::string_view name();
  XmlAttribute attribute();
  void skip_space();
  [[noreturn]] void fail(const std::string& what) const;
  [[nodiscard]] bool starts_with(std::string_view s) const {
    return source_->bytes.substr(at_, s.size()) == s;
  }

  const Source* source_;
  std::size_t at_ = 0;
  std::vector<std::string_view> open_;
  bool close_pending_ = false;
};

/// Replaces &amp; &lt; &gt; &quot; &apos;.
std::string xml_unescape(std::string_view text);
/// The reverse; control characters become spaces.
std::string xml_escape(std::string_view text);

}  // namespace lamina::io
