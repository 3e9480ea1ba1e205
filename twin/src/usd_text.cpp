#include "usd_text.h"

#include <algorithm>
#include <type_traits>

#include "consac/base/names.h"
#include "consac/base/text.h"

namespace consac::twin {
namespace {

constexpr std::size_t kFlushBytes = std::size_t{1} << 16;

bool IsOfName(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

template <class Number>
void AppendNumber(Number number, std::string* out) {
  if constexpr (std::is_floating_point_v<Number>) {
    char text[32];
    out->append(text, FormatNumber(number == Number{0} ? Number{0} : number, text));
  } else {
    out->append(std::to_string(number));
  }
}

}  // namespace

std::string UsdNames::Make(std::string_view wanted) {
  std::string name(wanted);
  for (char& c : name) {
    if (!IsOfName(c)) c = '_';
  }
  if (name.empty() || (name.front() >= '0' && name.front() <= '9')) name = "_" + name;
  std::string out = name;
  for (int n = 2; !used_.insert(out).second; ++n) out = name + "_" + std::to_string(n);
  return out;
}

std::string UsdQuoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : PrintableLine(std::string(text))) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string UsdTuple(std::span<const double> numbers) {
  std::string out = "(";
  for (const double number : numbers) {
    if (out.size() > 1) out += ", ";
    AppendNumber(number, &out);
  }
  return out + ")";
}

std::string UsdTuple(robot::Vector3 v) {
  const double numbers[] = {v.x, v.y, v.z};
  return UsdTuple(numbers);
}

std::string UsdQuaternion(const robot::Quaternion& q) {
  const double numbers[] = {q.w, q.x, q.y, q.z};
  return UsdTuple(numbers);
}

Status UsdFile::Begin(const std::string& path, std::string_view default_prim, std::string_view creator) {
  status_ = file_.Open(path);
  Line("#usda 1.0");
  Line("(");
  ++depth_;
  Line("customLayerData = {");
  Line("    string creator = " + UsdQuoted(creator));
  Line("}");
  Line("defaultPrim = " + UsdQuoted(default_prim));
  Line("kilogramsPerUnit = 1");
  Line("metersPerUnit = 1");
  Line("upAxis = \"Z\"");
  --depth_;
  Line(")");
  return status_;
}

void UsdFile::Indent() {
  text_.append(4 * depth_, ' ');
}

void UsdFile::Line(std::string_view line) {
  Indent();
  text_ += line;
  text_ += '\n';
  if (text_.size() > kFlushBytes) Flush();
}

void UsdFile::Open(std::string_view head, std::string_view name, std::string_view metadata) {
  Line(std::string(head) + " \"" + std::string(name) + (metadata.empty() ? "\"" : "\" ("));
  if (!metadata.empty()) {
    ++depth_;
    while (!metadata.empty()) {
      const std::size_t end = std::min(metadata.find('\n'), metadata.size());
      Line(metadata.substr(0, end));
      metadata.remove_prefix(std::min(end + 1, metadata.size()));
    }
    --depth_;
    Line(")");
  }
  Line("{");
  ++depth_;
}

void UsdFile::Close() {
  --depth_;
  Line("}");
}

template <class Number>
void UsdFile::List(std::string_view declaration, std::span<const Number> numbers, std::size_t width) {
  Indent();
  text_ += declaration;
  text_ += " = [";
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0) text_ += ", ";
    if (width > 1 && i % width == 0) text_ += '(';
    AppendNumber(numbers[i], &text_);
    if (width > 1 && i % width == width - 1) text_ += ')';
    if (text_.size() > kFlushBytes) Flush();
  }
  text_ += "]\n";
}

void UsdFile::Numbers(std::string_view declaration, std::span<const float> numbers, std::size_t width) {
  List(declaration, numbers, width);
}

void UsdFile::Numbers(std::string_view declaration, std::span<const std::uint32_t> numbers) {
  List(declaration, numbers, 1);
}

void UsdFile::Place(const robot::Transform& at, const std::optional<robot::Vector3>& scale) {
  Line("double3 xformOp:translate = " + UsdTuple(at.position));
  Line("quatd xformOp:orient = " + UsdQuaternion(at.rotation));
  if (scale.has_value()) Line("float3 xformOp:scale = " + UsdTuple(*scale));
  Line(std::string("uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"") +
       (scale.has_value() ? ", \"xformOp:scale\"]" : "]"));
}

void UsdFile::Flush() {
  if (status_.ok()) status_ = file_.Write(std::as_bytes(std::span<const char>(text_)));
  text_.clear();
}

Status UsdFile::End() {
  Flush();
  return status_.ok() ? file_.Commit() : status_;
}

}  // namespace consac::twin
