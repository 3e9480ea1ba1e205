#include "cli/flags.h"

#include "consac/base/text.h"

namespace consac::cli {
namespace {

// Of the largest limit nobody needs to hear who has not gone beyond it.
bool IsBeyond(const std::string& text, std::int64_t high) {
  double number = 0.0;
  return ParseHumanNumber(text, &number) && number > static_cast<double>(high);
}

std::string Expected(const std::string& text, const std::string& kind, const std::string& low, const std::string& high,
                     bool bounded) {
  return Quote(text) + " cannot be used; expected " + kind +
         (bounded ? " from " + low + " to " + high : " of at least " + low);
}

}  // namespace

CLI::Option* AddNumber(CLI::App& app, const std::string& name, double* value, double low, double high,
                       const std::string& help) {
  const auto read = [name, value, low, high](const std::string& text) {
    if (ParseHumanNumber(text, value) && *value >= low && *value <= high) return;
    throw CLI::ValidationError(name, Expected(text, "a number", NumberText(low), NumberText(high), true));
  };
  return app.add_option_function<std::string>(name, read, help)->type_name("NUMBER");
}

CLI::Option* AddWhole(CLI::App& app, const std::string& name, std::int64_t* value, std::int64_t low, std::int64_t high,
                      const std::string& help) {
  const auto read = [name, value, low, high](const std::string& text) {
    if (ParseHumanNumber(text, value) && *value >= low && *value <= high) return;
    throw CLI::ValidationError(name, Expected(text, "a whole number", std::to_string(low), std::to_string(high),
                                              high < kMostWhole || IsBeyond(text, high)));
  };
  return app.add_option_function<std::string>(name, read, help)->type_name("NUMBER");
}

CLI::Option* AddToken(CLI::App& app, std::string* value, const std::string& help) {
  return app.add_option("--token", *value, help + "; better in the environment than on a command line")
      ->envname("CONSAC_TOKEN");
}

}  // namespace consac::cli
