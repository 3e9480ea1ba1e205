#include "yaml_tree.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <sstream>

#include "consac/base/text.h"

namespace consac::run {
namespace {

/// Leaves yaml-cpp's parser at the first thing that is not wanted; never crosses ParseYaml.
struct Unwanted {
  int line;
  std::string what;
};

/// Builds the tree from the parser's events.
class TreeBuilder final : public YAML::EventHandler {
 public:
  YamlNode root;

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    RefuseAnchor(mark, anchor);
    Add(mark, YamlNode::Kind::kNull, "");
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    throw Unwanted{Line(mark), "references (*name) are not used here"};
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    RefuseAnchor(mark, anchor);
    RefuseTag(mark, tag);
    const bool null = tag == "?" && (value.empty() || value == "~" || value == "null");
    Add(mark, null ? YamlNode::Kind::kNull : YamlNode::Kind::kScalar, value);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    RefuseAnchor(mark, anchor);
    RefuseTag(mark, tag);
    Open(mark, YamlNode::Kind::kSequence);
  }
  void OnSequenceEnd() override { Close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    RefuseAnchor(mark, anchor);
    RefuseTag(mark, tag);
    Open(mark, YamlNode::Kind::kMap);
  }
  void OnMapEnd() override { Close(); }

 private:
  struct Level {
    YamlNode node;
    bool has_key = false;  // of a map: `key` waits for its value
    std::string key;
    int key_line = 1;
  };

  static int Line(const YAML::Mark& mark) { return mark.line + 1; }
  static void RefuseAnchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor != 0) throw Unwanted{Line(mark), "anchors (&name) are not used here"};
  }
  static void RefuseTag(const YAML::Mark& mark, const std::string& tag) {
    if (!tag.empty() && tag != "?" && tag != "!")
      throw Unwanted{Line(mark), "tags (" + Quote(tag) + ") are not used here"};
  }

  void Count(const YAML::Mark& mark) {
    if (++nodes_ > kMaxYamlNodes) throw Unwanted{Line(mark), "more than " + std::to_string(kMaxYamlNodes) + " values"};
  }

  void Open(const YAML::Mark& mark, YamlNode::Kind kind) {
    Count(mark);
    if (levels_.size() >= kMaxYamlDepth)
      throw Unwanted{Line(mark), "nested deeper than " + std::to_string(kMaxYamlDepth)};
    if (InKeyPosition()) throw Unwanted{Line(mark), "a key must be a name"};
    Level level;
    level.node.kind = kind;
    level.node.line = Line(mark);
    levels_.push_back(std::move(level));
  }

  void Close() {
    YamlNode node = std::move(levels_.back().node);
    levels_.pop_back();
    Place(std::move(node));
  }

  void Add(const YAML::Mark& mark, YamlNode::Kind kind, const std::string& text) {
    Count(mark);
    if (InKeyPosition()) {
      SetKey(mark, kind, text);
      return;
    }
    YamlNode node;
    node.kind = kind;
    node.line = Line(mark);
    node.text = text;
    Place(std::move(node));
  }

  bool InKeyPosition() const {
    return !levels_.empty() && levels_.back().node.kind == YamlNode::Kind::kMap && !levels_.back().has_key;
  }

  void SetKey(const YAML::Mark& mark, YamlNode::Kind kind, const std::string& text) {
    Level& level = levels_.back();
    if (kind != YamlNode::Kind::kScalar) throw Unwanted{Line(mark), "a key must be a name"};
    for (const YamlNode& sibling : level.node.children) {
      if (sibling.key == text) {
        throw Unwanted{Line(mark),
                       "key " + Quote(text) + " stands twice; first on line " + std::to_string(sibling.line)};
      }
    }
    level.key = text;
    level.key_line = Line(mark);
    level.has_key = true;
  }

  void Place(YamlNode node) {
    if (levels_.empty()) {
      root = std::move(node);
      return;
    }
    Level& level = levels_.back();
    if (level.node.kind == YamlNode::Kind::kMap) {
      node.key = std::move(level.key);
      node.line = level.key_line;
    }
    level.has_key = false;
    level.node.children.push_back(std::move(node));
  }

  std::vector<Level> levels_;
  int nodes_ = 0;
};

Status At(std::string_view origin, int line, const std::string& what) {
  return {StatusCode::kInvalidArgument, std::string(origin) + ":" + std::to_string(line) + ": " + what};
}

}  // namespace

Result<YamlNode> ParseYaml(std::string_view text, std::string_view origin) {
  if (text.size() > kMaxYamlBytes) {
    return At(origin, 1,
              std::to_string(text.size()) + " bytes of YAML; at most " + std::to_string(kMaxYamlBytes) + " are read");
  }
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    TreeBuilder builder, second;
    (void)parser.HandleNextDocument(builder);
    if (parser.HandleNextDocument(second))
      return At(origin, second.root.line, "a second document; one file is one configuration");
    return std::move(builder.root);
  } catch (const Unwanted& unwanted) {
    return At(origin, unwanted.line, unwanted.what);
  } catch (const YAML::Exception& error) {
    return At(origin, error.mark.line + 1, "no YAML: " + error.msg);
  } catch (const std::exception& error) {
    return At(origin, 1, std::string("no YAML: ") + error.what());
  }
}

std::string FlowText(const YamlNode& node) {
  switch (node.kind) {
    case YamlNode::Kind::kNull:
      return "none";
    case YamlNode::Kind::kScalar:
      return node.text;
    case YamlNode::Kind::kSequence:
    case YamlNode::Kind::kMap:
      break;
  }
  const bool map = node.kind == YamlNode::Kind::kMap;
  std::string out = map ? "{" : "[";
  for (const YamlNode& child : node.children) {
    if (out.size() > 1) out += ", ";
    if (map) out += child.key + ": ";
    out += FlowText(child);
  }
  return out + (map ? "}" : "]");
}

}  // namespace consac::run
