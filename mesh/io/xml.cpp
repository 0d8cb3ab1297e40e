#include "mesh/io/xml.h"

#include <algorithm>
#include <utility>

namespace lamina::io {
namespace {

constexpr std::size_t kDeepest = 64;

constexpr bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

constexpr bool is_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == ':' ||
         c == '-' || c == '.';
}

constexpr std::pair<std::string_view, char> kEntities[] = {
    {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};

}  // namespace

std::string_view XmlEvent::attribute(std::string_view key, std::string_view fallback) const {
  for (const XmlAttribute& a : attributes)
    if (a.name == key) return a.value;
  return fallback;
}

XmlEvent XmlScanner::next() {
  if (close_pending_) {
    close_pending_ = false;
    XmlEvent event{XmlEvent::Kind::kClose, open_.back(), {}, {}, at_};
    open_.pop_back();
    return event;
  }
  const std::string_view bytes = source_->bytes;
  while (at_ < bytes.size()) {
    if (bytes[at_] == '<') {
      if (skip_markup()) continue;
      return starts_with("</") ? close_tag() : open_tag();
    }
    const std::size_t begin = at_;
    at_ = std::min(bytes.find('<', at_), bytes.size());
    const std::string_view text = bytes.substr(begin, at_ - begin);
    if (std::all_of(text.begin(), text.end(), is_blank)) continue;
    if (open_.empty()) {
      at_ = begin;
      fail("text outside of any element");
    }
    return {XmlEvent::Kind::kText, {}, text, {}, begin};
  }
  if (!open_.empty()) fail("the file ends inside <" + std::string(open_.back().substr(0, 40)) + ">");
  return {};
}

/// Skips a comment or a declaration at the position; false when there is none.
bool XmlScanner::skip_markup() {
  std::string_view end;
  if (starts_with("<!--")) {
    end = "-->";
  } else if (starts_with("<?")) {
    end = "?>";
  } else if (starts_with("<!DOCTYPE") && declares_nothing()) {
    end = ">";
  } else if (starts_with("<!")) {
    fail("document types with declarations and CDATA are not taken");
  } else {
    return false;
  }
  const std::size_t found = source_->bytes.find(end, at_);
  if (found == std::string_view::npos) fail("a comment or declaration that does not end");
  at_ = found + end.size();
  return true;
}

/// True when the document type at the position declares nothing of its own: no [...] but an empty one.
bool XmlScanner::declares_nothing() const {
  const std::string_view rest = source_->bytes.substr(at_);
  const std::string_view type = rest.substr(0, rest.find('>'));
  const std::size_t bracket = type.find('[');
  return bracket == std::string_view::npos || type.substr(bracket, 2) == "[]";
}

XmlEvent XmlScanner::open_tag() {
  XmlEvent event{XmlEvent::Kind::kOpen, {}, {}, {}, at_};
  ++at_;
  event.name = name();
  for (;;) {
    skip_space();
    if (starts_with("/>")) {
      at_ += 2;
      close_pending_ = true;
      break;
    }
    if (starts_with(">")) {
      ++at_;
      break;
    }
    event.attributes.push_back(attribute());
  }
  if (open_.size() == kDeepest) fail("elements nested too deep");
  open_.push_back(event.name);
  return event;
}

XmlEvent XmlScanner::close_tag() {
  const std::size_t begin = at_;
  at_ += 2;
  const std::string_view closed = name();
  skip_space();
  if (!starts_with(">")) fail("expected >");
  if (open_.empty() || open_.back() != closed) fail("a closing tag that matches no opening one");
  ++at_;
  open_.pop_back();
  return {XmlEvent::Kind::kClose, closed, {}, {}, begin};
}

XmlAttribute XmlScanner::attribute() {
  XmlAttribute a;
  a.name = name();
  skip_space();
  if (!starts_with("=")) fail("expected = after an attribute name");
  ++at_;
  skip_space();
  if (!starts_with("\"") && !starts_with("'")) fail("expected a quoted attribute value");
  const char quote = source_->bytes[at_++];
  const std::size_t end = source_->bytes.find(quote, at_);
  if (end == std::string_view::npos) fail("an attribute value that does not end");
  a.value = source_->bytes.substr(at_, end - at_);
  at_ = end + 1;
  return a;
}

std::string_view XmlScanner::name() {
  const std::size_t begin = at_;
  while (at_ < source_->bytes.size() && is_name(source_->bytes[at_])) ++at_;
  if (at_ == begin) fail("expected a name");
  return source_->bytes.substr(begin, at_ - begin);
}

void XmlScanner::skip_space() {
  while (at_ < source_->bytes.size() && is_blank(source_->bytes[at_])) ++at_;
}

void XmlScanner::fail(const std::string& what) const {
  fail_format(*source_, line_of(*source_, at_), "XML: " + what);
}

std::string xml_unescape(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size();) {
    bool replaced = false;
    for (const auto& [entity, c] : kEntities) {
      if (text.substr(i, entity.size()) != entity) continue;
      plain += c;
      i += entity.size();
      replaced = true;
      break;
    }
    if (!replaced) plain += text[i++];
  }
  return plain;
}

std::string xml_escape(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    const auto* entity = std::find_if(std::begin(kEntities), std::end(kEntities),
                                      [c](const auto& e) { return e.second == c; });
    if (entity != std::end(kEntities)) {
      escaped += entity->first;
    } else {
      escaped += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return escaped;
}

}  // namespace lamina::io
