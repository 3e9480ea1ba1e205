#include "xml.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "consac/base/text.h"
#include "consac/twin/urdf.h"
#include "pieces.h"

namespace consac::twin {
namespace {

constexpr std::size_t kMostTags = 1'000'000;
constexpr int kMostDepth = 256;

// Elements within each other: whoever walks the tree may call itself that often. Walks it without doing so.
bool IsTooDeep(const pugi::xml_document& document) {
  int depth = 0;
  pugi::xml_node at = document.first_child();
  while (at) {
    if (at.first_child()) {
      at = at.first_child();
      if (++depth > kMostDepth) return true;
      continue;
    }
    while (at && !at.next_sibling()) {
      at = at.parent();
      --depth;
    }
    at = at.next_sibling();
  }
  return false;
}

class TextWriter final : public pugi::xml_writer {
 public:
  void write(const void* data, std::size_t size) override { text.append(static_cast<const char*>(data), size); }
  std::string text;
};

}  // namespace

XmlReader::XmlReader(std::string_view text) : text_(text) {
  if (text.size() > kMostXmlBytes) {
    status_ = {StatusCode::kResourceExhausted, "it has " + std::to_string(text.size()) + " bytes; at most " +
                                                   std::to_string(kMostXmlBytes) + " are read"};
    return;
  }
  if (static_cast<std::size_t>(std::count(text.begin(), text.end(), '<')) > kMostTags) {
    status_ = {StatusCode::kResourceExhausted, "it has more than " + std::to_string(kMostTags) + " tags"};
    return;
  }
  const pugi::xml_parse_result parsed =
      document_.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    const auto end = text.begin() + std::min<std::ptrdiff_t>(parsed.offset, static_cast<std::ptrdiff_t>(text.size()));
    status_ = {StatusCode::kInvalidArgument, "line " + std::to_string(1 + std::count(text.begin(), end, '\n')) +
                                                 ": this is no XML (" + std::string(parsed.description()) + ")"};
  } else if (IsTooDeep(document_)) {
    status_ = {StatusCode::kResourceExhausted,
               "it has more than " + std::to_string(kMostDepth) + " elements within each other"};
  }
}

Status XmlReader::Wrong(pugi::xml_node at, const std::string& what) const {
  const std::ptrdiff_t offset =
      std::clamp<std::ptrdiff_t>(at.offset_debug(), 0, static_cast<std::ptrdiff_t>(text_.size()));
  const auto line = 1 + std::count(text_.begin(), text_.begin() + offset, '\n');
  return {StatusCode::kInvalidArgument, "line " + std::to_string(line) + ": " + what};
}

void XmlReader::Refuse(pugi::xml_node at, const std::string& what) {
  if (status_.ok()) status_ = Wrong(at, what);
}

std::string XmlReader::Text(pugi::xml_node node, const char* name) {
  std::string text = node.attribute(name).value();
  if (text.empty()) Refuse(node, "<" + std::string(node.name()) + "> has no " + name);
  return text;
}

double XmlReader::Number(pugi::xml_node node, const char* name, double otherwise) {
  double number = otherwise;
  (void)Numbers(node, name, {&number, 1});
  return number;
}

bool XmlReader::Numbers(pugi::xml_node node, const char* name, std::span<double> numbers) {
  const pugi::xml_attribute attribute = node.attribute(name);
  if (!attribute) return false;
  const std::vector<double> list = List(node, name, numbers.size());
  if (list.size() == numbers.size()) {
    std::copy(list.begin(), list.end(), numbers.begin());
  } else {
    Refuse(node, "<" + std::string(node.name()) + " " + name + "=" + Quote(attribute.value()) +
                     ">: " + (numbers.size() == 1 ? "a number is" : std::to_string(numbers.size()) + " numbers are") +
                     " needed");
  }
  return true;
}

std::vector<double> XmlReader::List(pugi::xml_node node, const char* name, std::size_t most) {
  return ListOf(node, name, node.attribute(name).value(), most);
}

std::vector<double> XmlReader::ListOf(pugi::xml_node node, const char* name, std::string_view text, std::size_t most) {
  std::vector<double> list;
  std::string_view rest = text;
  for (std::string_view piece = NextPiece(&rest); !piece.empty(); piece = NextPiece(&rest)) {
    double number = 0.0;
    if (list.size() >= most || !ParseNumber(piece, &number)) {
      const bool commas = piece.find(',') != std::string_view::npos;
      Refuse(node,
             "<" + std::string(node.name()) + " " + name + "=" + Quote(text) + ">: " +
                 (list.size() >= most ? "more numbers than " + std::to_string(most)
                                      : Quote(piece) + " is no number" +
                                            (commas ? "; numbers stand with blanks between, without commas" : "")));
      return list;
    }
    list.push_back(number);
  }
  return list;
}

robot::Vector3 XmlReader::Vector(pugi::xml_node node, const char* name, robot::Vector3 otherwise) {
  std::array<double, 3> numbers = {otherwise.x, otherwise.y, otherwise.z};
  (void)Numbers(node, name, numbers);
  return {numbers[0], numbers[1], numbers[2]};
}

void XmlReader::CheckScale(pugi::xml_node at, robot::Vector3 scale) {
  for (const double factor : {scale.x, scale.y, scale.z}) {
    if (!(std::abs(factor) > 1e-9) || !(std::abs(factor) < 1e9))
      Refuse(at, "the mesh's scale is " + NumbersText(scale) + "; it makes nothing of it");
  }
}

void Set(pugi::xml_node node, const char* name, const std::string& text) {
  node.append_attribute(name).set_value(text.c_str());
}

void Set(pugi::xml_node node, const char* name, double number) {
  Set(node, name, NumbersText(std::span<const double>(&number, 1)));
}

std::string XmlText(const pugi::xml_document& document) {
  TextWriter writer;
  document.save(writer, "  ", pugi::format_default, pugi::encoding_utf8);
  return writer.text;
}

std::string NumbersText(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : " ") + NumberText(number == 0.0 ? 0.0 : number);
  return text;
}

std::string NumbersText(robot::Vector3 v) {
  const double numbers[] = {v.x, v.y, v.z};
  return NumbersText(numbers);
}

}  // namespace consac::twin
