#include "consac/nn/net_arch.h"

#include <cctype>

#include "consac/base/text.h"

namespace consac::nn {
namespace {

constexpr std::int64_t kWidestLayer = 1 << 16;

/// A reader of the net_arch grammar; the first failure stays and later reads do nothing.
class ArchReader {
 public:
  explicit ArchReader(std::string_view text) : text_(text) {}

  Result<NetArch> Read() {
    NetArch arch;
    arch.pi.clear();
    arch.vf.clear();
    if (Peek() == '[') {
      ReadList(arch);
    } else {
      ReadTowers(arch);
    }
    if (status_.ok() && Peek() != '\0') Fail("the end");
    if (!status_.ok()) return status_;
    return arch;
  }

 private:
  void Fail(std::string_view expected) {
    if (!status_.ok()) return;
    status_ = {StatusCode::kInvalidArgument,
               "net_arch " + Quote(text_) + ": expected " + std::string(expected) + " at character " +
                   std::to_string(at_ + 1) + "; write [64, 64] or [128, dict(pi=[64], vf=[64, 64])]"};
  }

  char Peek() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }

  bool Take(char c) {
    if (Peek() != c) return false;
    ++at_;
    return true;
  }

  void Need(char c) {
    if (!Take(c)) Fail(std::string("'") + c + "'");
  }

  std::string_view Word() {
    Peek();
    const std::size_t begin = at_;
    while (at_ < text_.size() && std::isalnum(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  void ReadWidth(std::vector<std::int64_t>& widths) {
    const std::size_t begin = at_;
    std::int64_t width = 0;
    if (!ParseNumber(Word(), &width) || width < 1 || width > kWidestLayer) {
      at_ = begin;
      Fail("a layer width from 1 to 65536");
      return;
    }
    widths.push_back(width);
  }

  void ReadWidths(std::vector<std::int64_t>& widths) {
    Need('[');
    while (status_.ok() && Peek() != ']') {
      ReadWidth(widths);
      if (!Take(',')) break;
    }
    Need(']');
  }

  // [<int>*, dict?]
  void ReadList(NetArch& arch) {
    Need('[');
    while (status_.ok() && Peek() != ']') {
      if (std::isdigit(static_cast<unsigned char>(Peek())) != 0) {
        ReadWidth(arch.shared);
      } else {
        ReadTowers(arch);
        Take(',');
        break;
      }
      if (!Take(',')) break;
    }
    Need(']');
  }

  // dict(pi=[...], vf=[...]) or {pi: [...], 'vf': [...]}
  void ReadTowers(NetArch& arch) {
    const bool braces = Take('{');
    if (!braces) {
      if (Word() != "dict") return Fail("a layer width, dict(...) or {...}");
      Need('(');
    }
    const char close = braces ? '}' : ')';
    while (status_.ok() && Peek() != close) {
      const char quote = Peek() == '\'' || Peek() == '"' ? Peek() : '\0';
      if (quote != '\0') Take(quote);
      const std::string_view key = Word();
      if (quote != '\0') Need(quote);
      if (key != "pi" && key != "vf") return Fail("pi or vf");
      if (!Take('=')) Need(':');
      ReadWidths(key == "pi" ? arch.pi : arch.vf);
      if (!Take(',')) break;
    }
    Need(close);
  }

  std::string_view text_;
  std::size_t at_ = 0;
  Status status_;
};

std::string WidthList(const std::vector<std::int64_t>& widths) {
  std::string out;
  for (const std::int64_t width : widths) out += (out.empty() ? "" : ", ") + std::to_string(width);
  return out;
}

/// Appends a chain of hidden layers and returns the name and width of the last value.
Port AppendHidden(const ActorCriticOptions& options, std::string_view tower, const std::vector<std::int64_t>& widths,
                  Port from, NetworkSpec& spec) {
  for (std::size_t i = 0; i < widths.size(); ++i) {
    Block block;
    block.name = std::string(tower) + "/" + std::to_string(i);
    block.input = from.name;
    block.output = block.name;
    block.in_size = from.size;
    block.out_size = widths[i];
    block.activation = options.activation;
    block.init = options.orthogonal_init ? Init::kOrthogonal : Init::kUniformFanIn;
    block.gain = options.hidden_gain;
    from = {block.output, block.out_size};
    spec.blocks.push_back(std::move(block));
  }
  return from;
}

void AppendHead(const ActorCriticOptions& options, std::string_view tower, std::int64_t size, float gain,
                const Port& from, NetworkSpec& spec) {
  Block block;
  block.name = std::string(tower) + "/head";
  block.input = from.name;
  block.output = std::string(tower);
  block.in_size = from.size;
  block.out_size = size;
  block.init = options.orthogonal_init ? Init::kOrthogonal : Init::kUniformFanIn;
  block.gain = gain;
  spec.blocks.push_back(std::move(block));
}

}  // namespace

Result<NetArch> ParseNetArch(std::string_view text) { return ArchReader(text).Read(); }

std::string ToString(const NetArch& arch) {
  const std::string shared = WidthList(arch.shared);
  if (arch.pi.empty() && arch.vf.empty()) return "[" + shared + "]";
  return "[" + shared + (shared.empty() ? "" : ", ") + "dict(pi=[" + WidthList(arch.pi) + "], vf=[" +
         WidthList(arch.vf) + "])]";
}

NetworkSpec ActorCritic(const ActorCriticOptions& options) {
  NetworkSpec spec;
  spec.inputs = {{"obs", options.observation_size}};
  const Port trunk = AppendHidden(options, "shared", options.arch.shared, spec.inputs[0], spec);
  const Port actor = AppendHidden(options, "pi", options.arch.pi, trunk, spec);
  AppendHead(options, "pi", options.action_size, options.policy_gain, actor, spec);
  const Port critic = AppendHidden(options, "vf", options.arch.vf, trunk, spec);
  AppendHead(options, "vf", 1, options.value_gain, critic, spec);
  spec.outputs = {"pi", "vf"};
  return spec;
}

}  // namespace consac::nn
