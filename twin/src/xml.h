#pragma once
// Reading XML that is not to be trusted, by pugixml: what is too much is refused first, and what is wrong is told with
// its line. Private to twin.

#include <pugixml.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"
#include "consac/robot/transform.h"
#include "consac/twin/model.h"

namespace consac::twin {

/// A parsed text, and the first thing that was wrong with it.
class XmlReader {
 public:
  /// Parses; status() says what is no XML: kInvalidArgument, as what is wrong in it. `text` must outlive this.
  explicit XmlReader(std::string_view text);
  /// The outermost element.
  pugi::xml_node root() const { return document_.document_element(); }
  /// The first error, if any.
  const Status& status() const { return status_; }
  /// "line 12: ...", as an error.
  Status Wrong(pugi::xml_node at, const std::string& what) const;
  /// Keeps that error, if it is the first.
  void Refuse(pugi::xml_node at, const std::string& what);

  /// An attribute's text; refused where it is missing or empty.
  std::string Text(pugi::xml_node node, const char* name);
  /// A number; `otherwise` where there is no such attribute.
  double Number(pugi::xml_node node, const char* name, double otherwise);
  /// Numbers with blanks between; false where there is no such attribute. Refused where there are fewer or more.
  bool Numbers(pugi::xml_node node, const char* name, std::span<double> numbers);
  /// As many numbers as there are, `most` at most.
  std::vector<double> List(pugi::xml_node node, const char* name, std::size_t most);
  /// The same of a text from elsewhere, which `node` is named for.
  std::vector<double> ListOf(pugi::xml_node node, const char* name, std::string_view text, std::size_t most);
  /// Three numbers.
  robot::Vector3 Vector(pugi::xml_node node, const char* name, robot::Vector3 otherwise);
  /// Refuses a mesh's scale that makes nothing of it.
  void CheckScale(pugi::xml_node at, robot::Vector3 scale);

 private:
  pugi::xml_document document_;
  std::string_view text_;
  Status status_;
};

/// ReadUrdf and ReadMjcf of what is parsed already.
Result<Model> ReadUrdf(XmlReader& xml);
Result<Model> ReadMjcf(XmlReader& xml);

/// Writes an attribute.
void Set(pugi::xml_node node, const char* name, const std::string& text);
/// The same of a number, shortest and exact.
void Set(pugi::xml_node node, const char* name, double number);
/// A written document as text.
std::string XmlText(const pugi::xml_document& document);
/// "1 0 0", shortest and exact.
std::string NumbersText(std::span<const double> numbers);
/// The same.
std::string NumbersText(robot::Vector3 v);

}  // namespace consac::twin
