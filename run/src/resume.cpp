#include "resume.h"

#include "config_fields.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/learn/algo/learner.h"
#include "consac/run/run_directory.h"
#include "link.h"

namespace consac::run {
namespace {

Status MustStay(std::string_view name, const std::string& began, const std::string& asked) {
  return {StatusCode::kInvalidArgument, "the run began with " + std::string(name) + " = " + Quote(began) +
                                            " and cannot go on with " + Quote(asked) +
                                            "; leave it out, or start another run"};
}

Status MergeField(const Field& field, const RunConfig& asked, RunConfig* config) {
  const std::string given = FieldText(field, asked), began = FieldText(field, *config);
  const bool asked_for = WasGiven(field, asked) || given != FieldText(field, RunConfig{});
  if (given == began || !asked_for) return Status::Ok();
  const bool moved_engine = field.name == std::string_view("world") && IsUrl(given) && IsUrl(began);
  if (field.on_resume == OnResume::kMustStay && !moved_engine) return MustStay(field.name, began, given);
  return SetField(field, given, config);
}

Status CheckHyperparameters(const RunConfig& asked, const RunConfig& config) {
  const Result<learn::HyperparameterSet> began = HyperparametersOf(config);
  if (!began.ok()) return began.status();
  learn::HyperparameterSet given = *began;
  for (const auto& [name, text] : asked.hyperparameters) {
    CONSAC_RETURN_IF_ERROR(given.Set(name, text));
    if (given.Text(name) != began->Text(name)) return MustStay(name, began->Text(name), text);
  }
  return Status::Ok();
}

}  // namespace

Result<RunConfig> ConfigOfRun(const std::string& directory, const std::string& name) {
  CONSAC_RETURN_IF_ERROR(FinishOverwriting(directory, name));
  CONSAC_RETURN_IF_ERROR(CheckRunName(directory, name, ExistingRun::kResume));
  RunConfig config;
  CONSAC_RETURN_IF_ERROR(ReadYamlFile(directory + "/" + name + "/config.yaml", &config));
  return config;
}

Result<RunConfig> ResumedConfig(const RunConfig& asked) {
  if (asked.name.empty())
    return Status{StatusCode::kInvalidArgument, "--resume needs --name NAME, the run to go on with"};
  Result<RunConfig> began = ConfigOfRun(asked.directory, asked.name);
  if (!began.ok()) return began.status();
  RunConfig& config = *began;
  for (const Field& field : Fields()) CONSAC_RETURN_IF_ERROR(MergeField(field, asked, &config));
  CONSAC_RETURN_IF_ERROR(CheckHyperparameters(asked, config));
  config.name = asked.name;
  config.directory = asked.directory;
  config.forever = asked.forever;
  config.quiet = asked.quiet;
  config.token = asked.token;
  config.given = asked.given;
  config.resume = true;
  return began;
}

}  // namespace consac::run
