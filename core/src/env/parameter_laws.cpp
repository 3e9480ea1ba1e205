#include "consac/env/parameter_laws.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "consac/base/text.h"

namespace consac {
namespace {

/// The words of a text, blanks apart.
std::vector<std::string_view> WordsOf(std::string_view text) {
  std::vector<std::string_view> words;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    if (text.empty()) return words;
    const std::size_t end = std::min(text.find(' '), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
}

std::string_view WithoutBlanksAround(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

Status WrongLaw(std::string_view name, std::string_view law) {
  return {StatusCode::kInvalidArgument,
          "parameter " + Quote(name) + ": " + Quote(law) +
              " cannot be used; expected a number, 'uniform LOW HIGH', 'log_uniform LOW HIGH' or 'ramp FROM TO STEPS'"};
}

struct KnownLaw {
  std::string_view word;
  ParameterLaw::Kind kind;
  std::size_t numbers;
};
constexpr KnownLaw kKnownLaws[] = {{"fixed", ParameterLaw::Kind::kFixed, 1},
                                   {"uniform", ParameterLaw::Kind::kUniform, 2},
                                   {"log_uniform", ParameterLaw::Kind::kLogUniform, 2},
                                   {"ramp", ParameterLaw::Kind::kRamp, 3}};

Result<ParameterLaw> ParseLaw(std::string_view name, std::string_view text) {
  std::vector<std::string_view> words = WordsOf(text);
  if (words.size() == 1) words.insert(words.begin(), kKnownLaws[0].word);
  const auto known = std::find_if(std::begin(kKnownLaws), std::end(kKnownLaws), [&](const KnownLaw& row) {
    return words.size() == row.numbers + 1 && row.word == words[0];
  });
  if (known == std::end(kKnownLaws)) return WrongLaw(name, text);
  double numbers[3] = {};
  for (std::size_t i = 0; i < known->numbers; ++i) {
    if (!ParseHumanNumber(words[i + 1], &numbers[i]) || !std::isfinite(numbers[i])) return WrongLaw(name, text);
  }
  using Kind = ParameterLaw::Kind;
  const ParameterLaw law{known->kind, std::string(name), numbers[0], known->numbers == 1 ? numbers[0] : numbers[1],
                         numbers[2]};
  const bool drawn = law.kind == Kind::kUniform || law.kind == Kind::kLogUniform;
  const bool wrong = (drawn && law.low > law.high) || (law.kind == Kind::kLogUniform && law.low <= 0.0) ||
                     (law.kind == Kind::kRamp && law.steps < 1.0);
  return wrong ? Result<ParameterLaw>(WrongLaw(name, text)) : Result<ParameterLaw>(law);
}

}  // namespace

Result<std::vector<ParameterLaw>> ParseParameterLaws(std::string_view text) {
  std::vector<ParameterLaw> laws;
  if (WithoutBlanksAround(text).empty()) return laws;
  while (true) {
    const std::size_t end = std::min(text.find(','), text.size());
    const std::string_view one = WithoutBlanksAround(text.substr(0, end));
    const std::size_t equals = one.find('=');
    if (equals == std::string_view::npos || equals == 0) {
      return Status{StatusCode::kInvalidArgument,
                    Quote(one) + " cannot be used; expected name=value, several with commas between"};
    }
    Result<ParameterLaw> law =
        ParseLaw(WithoutBlanksAround(one.substr(0, equals)), WithoutBlanksAround(one.substr(equals + 1)));
    if (!law.ok()) return law.status();
    for (const ParameterLaw& other : laws) {
      if (other.name == law->name)
        return Status{StatusCode::kInvalidArgument, "parameter " + Quote(law->name) + " is given twice"};
    }
    laws.push_back(std::move(*law));
    if (end == text.size()) return laws;
    text.remove_prefix(end + 1);
  }
}

Status CheckParameterLaws(std::span<const ParameterLaw> laws, std::span<const ParameterSpec> parameters) {
  for (const ParameterLaw& law : laws) {
    const Result<std::size_t> found = FindParameter(parameters, law.name);
    if (!found.ok()) return found.status();
    for (const double value : {law.low, law.high}) CONSAC_RETURN_IF_ERROR(CheckValue(parameters[*found], value));
  }
  return Status::Ok();
}

ParameterChooser::ParameterChooser(std::vector<ParameterLaw> laws, std::span<const ParameterSpec> parameters,
                                   std::uint64_t seed, std::uint32_t index)
    : laws_(std::move(laws)),
      values_(parameters.size(), std::numeric_limits<double>::quiet_NaN()),
      rng_(seed, StreamId("environment_parameters"), index) {
  for (const ParameterLaw& law : laws_) {
    const Result<std::size_t> place = FindParameter(parameters, law.name);
    places_.push_back(place.ok() ? *place : 0);
    fixed_ = fixed_ && law.kind == ParameterLaw::Kind::kFixed;
  }
}

double ParameterChooser::ChooseBy(const ParameterLaw& law, std::int64_t steps) {
  using Kind = ParameterLaw::Kind;
  const double part = law.kind == Kind::kRamp ? std::min(1.0, static_cast<double>(steps) / law.steps) : 0.0;
  switch (law.kind) {
    case Kind::kUniform:
      return std::min(rng_.Between(law.low, law.high), law.high);
    case Kind::kLogUniform:
      return std::clamp(std::exp(rng_.Between(std::log(law.low), std::log(law.high))), law.low, law.high);
    case Kind::kRamp:
      return law.low * (1.0 - part) + law.high * part;
    case Kind::kFixed:
      break;
  }
  return law.low;
}

std::span<const double> ParameterChooser::Choose(std::int64_t steps) {
  for (std::size_t i = 0; i < laws_.size(); ++i) values_[places_[i]] = ChooseBy(laws_[i], steps);
  return values_;
}

}  // namespace consac
