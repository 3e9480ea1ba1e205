#include "consac/base/json.h"

#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "consac/base/text.h"

namespace consac {
namespace {

using SaxJson = nlohmann::json;

Status Refused(std::string what) {
  return {StatusCode::kDataLoss, std::move(what)};
}

/// Counts what a text is made of. Each event returns whether to go on.
class JsonWatch final : public nlohmann::json_sax<SaxJson> {
 public:
  explicit JsonWatch(const JsonLimits& limits) : limits_(limits) {}
  const Status& status() const { return status_; }

  bool null() override { return CountValue(); }
  bool boolean(bool) override { return CountValue(); }
  bool number_integer(number_integer_t) override { return CountValue(); }
  bool number_unsigned(number_unsigned_t) override { return CountValue(); }
  bool number_float(number_float_t, const string_t&) override { return CountValue(); }
  bool string(string_t&) override { return CountValue(); }
  bool binary(binary_t&) override { return CountValue(); }
  bool start_object(std::size_t) override {
    keys_.emplace_back();
    return Enter();
  }
  bool end_object() override {
    keys_.pop_back();
    --depth_;
    return true;
  }
  bool start_array(std::size_t) override { return Enter(); }
  bool end_array() override {
    --depth_;
    return true;
  }
  bool key(string_t& name) override {
    if (keys_.back().insert(name).second) return true;
    status_ = Refused("a JSON object names " + Quote(name) + " twice");
    return false;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception&) override {
    status_ = Refused("no JSON from byte " + std::to_string(position));
    return false;
  }

 private:
  bool CountValue() {
    if (++values_ <= limits_.values) return true;
    status_ = Refused("JSON of more than " + std::to_string(limits_.values) + " values");
    return false;
  }
  bool Enter() {
    if (++depth_ <= limits_.depth) return CountValue();
    status_ = Refused("JSON nested more than " + std::to_string(limits_.depth) + " deep");
    return false;
  }

  const JsonLimits& limits_;
  std::vector<std::set<std::string>> keys_;  // of the objects that are open
  std::size_t values_ = 0;
  int depth_ = 0;
  Status status_;
};

}  // namespace

Status CheckJson(std::string_view text, const JsonLimits& limits) {
  if (text.size() > limits.bytes) {
    return Refused("JSON of " + std::to_string(text.size()) + " bytes; at most " + std::to_string(limits.bytes) +
                   " are taken");
  }
  if (text.find('\0') != std::string_view::npos) return Refused("JSON with a NUL byte");  // nlohmann's end of input
  JsonWatch watch(limits);
  (void)SaxJson::sax_parse(text.begin(), text.end(), &watch);
  return watch.status();
}

}  // namespace consac
