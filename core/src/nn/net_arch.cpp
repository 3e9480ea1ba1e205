#include "consac/nn/net_arch.h"

#include "consac/base/text.h"
#include "consac/nn/action_networks.h"

namespace consac::nn {
namespace {

constexpr std::int64_t kWidestArch = 1 << 20;

/// Reads the grammar from left to right; the first fault is kept.
class ArchReader {
 public:
  explicit ArchReader(std::string_view text) : text_(text) {}

  Result<NetArch> Read() {
    NetArch arch;
    arch.pi.clear();
    arch.vf.clear();
    if (Take('[')) {
      ReadList(arch);
    } else {
      ReadTowers(arch);
    }
    if (ok() && !AtEnd()) Fault("expected the end");
    if (!ok()) return status_;
    return arch;
  }

 private:
  bool ok() const { return status_.ok(); }
  void SkipSpace() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n')) ++at_;
  }
  bool AtEnd() {
    SkipSpace();
    return at_ == text_.size();
  }
  bool Take(char wanted) {
    if (AtEnd() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }
  bool Peek(char wanted) { return !AtEnd() && text_[at_] == wanted; }
  void Fault(std::string_view message) {
    if (!ok()) return;
    SkipSpace();
    const std::string where = at_ < text_.size() ? "at " + Quote(text_.substr(at_), 20) : std::string("at its end");
    status_ = Status(StatusCode::kInvalidArgument, "net_arch " + Quote(text_) + ": " + std::string(message) + " " +
                                                       where + "; write for example [64, dict(pi=[64], vf=[64, 64])]");
  }

  void ReadList(NetArch& arch) {
    while (ok() && !Take(']')) {
      if (!AtEnd() && text_[at_] >= '0' && text_[at_] <= '9') {
        arch.shared.push_back(ReadWidth());
        if (!Peek(']') && !Take(',')) Fault("expected ',' or ']'");
        continue;
      }
      ReadTowers(arch);
      Take(',');
      if (!Take(']')) Fault("expected ']' (nothing may follow the separate towers)");
      return;
    }
  }

  /// dict(pi=[..], vf=[..]) or {pi: [..], 'vf': [..]}. The critic's widths are also called qf.
  void ReadTowers(NetArch& arch) {
    char end = '}';
    if (!Take('{')) {
      end = ')';
      SkipSpace();
      const std::size_t begin = at_;
      if (Word() != "dict" || !Take('(')) {
        at_ = begin;
        return Fault("expected a width, dict(...) or {...}");
      }
    }
    bool seen[2] = {false, false};
    while (ok() && !Take(end)) {
      const std::string_view key = Key();
      if (key != "pi" && key != "vf" && key != "qf") return Fault("expected pi, vf or qf, got " + Quote(key));
      bool& again = seen[key == "pi" ? 0 : 1];
      if (again) return Fault(std::string(key) + " stands there twice");
      again = true;
      if (!Take('=') && !Take(':')) return Fault("expected '=' or ':'");
      ReadWidths(key == "pi" ? arch.pi : arch.vf);
      if (ok() && !Peek(end) && !Take(',')) Fault("expected ',' or the end of the towers");
    }
  }

  void ReadWidths(std::vector<std::int64_t>& widths) {
    if (!Take('[')) return Fault("expected '['");
    while (ok() && !Take(']')) {
      widths.push_back(ReadWidth());
      if (ok() && !Peek(']') && !Take(',')) Fault("expected ',' or ']'");
    }
  }

  std::int64_t ReadWidth() {
    SkipSpace();
    std::size_t end = at_;
    while (end < text_.size() && text_[end] >= '0' && text_[end] <= '9') ++end;
    std::int64_t width = 0;
    if (end == at_ || !ParseNumber(text_.substr(at_, end - at_), &width) || width < 1 || width > kWidestArch) {
      Fault("expected a width from 1 to " + std::to_string(kWidestArch));
      return 1;
    }
    at_ = end;
    return width;
  }

  std::string_view Word() {
    SkipSpace();
    const std::size_t begin = at_;
    while (at_ < text_.size() && ((text_[at_] >= 'a' && text_[at_] <= 'z') || text_[at_] == '_')) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  std::string_view Key() {
    for (const char quote : {'\'', '"'}) {
      if (!Take(quote)) continue;
      const std::string_view word = Word();
      if (!Take(quote)) Fault("expected the closing quote");
      return word;
    }
    return Word();
  }

  std::string_view text_;
  std::size_t at_ = 0;
  Status status_;
};

std::string WidthsText(const std::vector<std::int64_t>& widths) {
  std::string text = "[";
  for (std::size_t i = 0; i < widths.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(widths[i]);
  return text + "]";
}

/// Appends layers named prefix/0, prefix/1, ...; returns the name of the last value.
Port AddTower(NetworkSpec& spec, const std::vector<std::int64_t>& widths, std::string_view prefix, Port from,
              const Block& like) {
  for (std::size_t i = 0; i < widths.size(); ++i) {
    Block block = like;
    block.name = std::string(prefix) + "/" + std::to_string(i);
    block.inputs = {from.name};
    block.output = block.name;
    block.in_size = from.size;
    block.out_size = widths[i];
    from = {block.output, block.out_size};
    spec.blocks.push_back(std::move(block));
  }
  return from;
}

/// A linear layer to `output`.
void AddLinear(NetworkSpec& spec, const Port& output, const Port& from, Init init, float gain) {
  Block head;
  head.name = output.name + "/head";
  head.inputs = {from.name};
  head.output = output.name;
  head.in_size = from.size;
  head.out_size = output.size;
  head.init = init;
  head.gain = gain;
  spec.blocks.push_back(std::move(head));
}

void AddHead(NetworkSpec& spec, const Port& output, const Port& from, Init init, float gain) {
  AddLinear(spec, output, from, init, gain);
  spec.outputs.push_back(output.name);
}

void AddActorCritic(NetworkSpec& spec, const Port& features, const ActorCriticOptions& options) {
  const Init init = options.orthogonal_init ? Init::kOrthogonal : Init::kUniformFanIn;
  Block hidden;
  hidden.activation = options.activation;
  hidden.init = init;
  hidden.gain = options.orthogonal_init ? options.hidden_gain : 1.0f;
  const Port shared = AddTower(spec, options.arch.shared, "shared", features, hidden);
  const Port pi = AddTower(spec, options.arch.pi, "pi", shared, hidden);
  AddHead(spec, {"pi", options.action_size}, pi, init, options.orthogonal_init ? options.policy_gain : 1.0f);
  if (options.with_features) AppendFeatures(spec, pi.name);
  const Port vf = AddTower(spec, options.arch.vf, "vf", shared, hidden);
  AddHead(spec, {"vf", 1}, vf, init, options.orthogonal_init ? options.value_gain : 1.0f);
}

/// A tower whose layers are normalised before their activation where that is asked for.
Port AddValueTower(NetworkSpec& spec, const QNetworkOptions& options, const std::vector<std::int64_t>& widths,
                   std::string_view prefix, Port from, const Block& hidden) {
  if (!options.layer_norm) return AddTower(spec, widths, prefix, from, hidden);
  Block linear = hidden;
  linear.activation = Activation::kLinear;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    linear.name = linear.output = std::string(prefix) + "/" + std::to_string(i);
    linear.inputs = {from.name};
    linear.in_size = from.size;
    linear.out_size = widths[i];
    spec.blocks.push_back(linear);
    Block norm{.op = "layer_norm", .inputs = {linear.output}, .output = linear.output + "/norm", .name = ""};
    norm.name = norm.output;
    norm.activation = hidden.activation;
    norm.attributes.SetNumber("epsilon", options.layer_norm_epsilon);
    from = {norm.output, widths[i]};
    spec.blocks.push_back(std::move(norm));
  }
  return from;
}

void AddQNetwork(NetworkSpec& spec, const Port& features, const QNetworkOptions& options) {
  Block hidden;
  hidden.activation = options.activation;
  hidden.init = options.init;
  const Port q{"q", options.action_count};
  if (!options.duelling) {
    AddHead(spec, q, AddValueTower(spec, options, options.layers, "q", features, hidden), options.init, 1.0f);
    return;
  }
  const Port advantage{"advantage", options.action_count}, value{"value", 1};
  const std::vector<std::int64_t>& value_layers =
      options.value_layers.has_value() ? *options.value_layers : options.layers;
  AddLinear(spec, advantage, AddValueTower(spec, options, options.layers, "advantage", features, hidden), options.init,
            1.0f);
  AddLinear(spec, value, AddValueTower(spec, options, value_layers, "value", features, hidden), options.init, 1.0f);
  spec.blocks.push_back({.op = "duelling", .inputs = {value.name, advantage.name}, .output = q.name, .name = q.name});
  spec.outputs.push_back(q.name);
}

}  // namespace

Result<NetArch> ParseNetArch(std::string_view text) {
  return ArchReader(text).Read();
}

std::string ToString(const NetArch& arch) {
  if (arch.pi.empty() && arch.vf.empty()) return WidthsText(arch.shared);
  std::string text = WidthsText(arch.shared);
  text.pop_back();
  if (!arch.shared.empty()) text += ", ";
  return text + "dict(pi=" + WidthsText(arch.pi) + ", vf=" + WidthsText(arch.vf) + ")]";
}

NetworkSpec ActorCritic(const ActorCriticOptions& options) {
  NetworkSpec spec;
  spec.inputs.push_back({"obs", options.observation_size});
  AddActorCritic(spec, spec.inputs[0], options);
  return spec;
}

Result<NetworkSpec> ActorCritic(const Layout& observation, const ActorCriticOptions& options,
                                const FeatureOptions& features) {
  NetworkSpec spec;
  const Result<Port> port = AddFeatures(observation, features, &spec);
  if (!port.ok()) return port.status();
  AddActorCritic(spec, *port, options);
  return spec;
}

NetworkSpec QNetwork(const QNetworkOptions& options) {
  NetworkSpec spec;
  spec.inputs.push_back({"obs", options.observation_size});
  AddQNetwork(spec, spec.inputs[0], options);
  return spec;
}

Result<NetworkSpec> QNetwork(const Layout& observation, const QNetworkOptions& options,
                             const FeatureOptions& features) {
  NetworkSpec spec;
  const Result<Port> port = AddFeatures(observation, features, &spec);
  if (!port.ok()) return port.status();
  AddQNetwork(spec, *port, options);
  return spec;
}

}  // namespace consac::nn
