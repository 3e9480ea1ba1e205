#include "algo/parameter_rows.h"

namespace consac::learn {
namespace {

const char* SourceText(ParameterSource source, Generation generation, const SourceNames& names) {
  switch (source) {
    case ParameterSource::kBoth:
      return generation == Generation::kStableBaselines2 ? names.sb2 : names.sb3;
    case ParameterSource::kSb2:
      return names.sb2;
    case ParameterSource::kSb3:
      return names.sb3;
    case ParameterSource::kVecNormalize:
      return "Stable Baselines, VecNormalize";
    case ParameterSource::kConsac:
      break;
  }
  return "CONSAC; the two generations differ here";
}

}  // namespace

// What may be "none" in one generation alone stays as it is where the other's defaults are asked for.
Hyperparameter TableRow(const ParameterText& row, Generation generation, const SourceNames& names) {
  const bool sb2 = generation == Generation::kStableBaselines2;
  const char* alias = std::strcmp(row.sb2_name, row.sb3_name) == 0 ? "" : sb2 ? row.sb3_name : row.sb2_name;
  const char* own = sb2 ? row.sb2_default : row.sb3_default;
  const bool absent = std::strcmp(own, "none") == 0;
  const char* choices = absent && row.choices[0] == '\0' ? "none" : row.choices;
  const bool may_be_absent = std::strcmp(choices, "none") == 0;
  const auto usable = [&](const char* text) { return std::strcmp(text, "none") == 0 && !may_be_absent ? own : text; };
  return {sb2 ? row.sb2_name : row.sb3_name,
          alias,
          row.type,
          own,
          usable(row.sb2_default),
          usable(row.sb3_default),
          row.low,
          row.high,
          choices,
          row.meaning,
          SourceText(row.source, generation, names)};
}

Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, std::int64_t* out) {
  *out = values.Integer(name);
  return Status::Ok();
}

Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, double* out) {
  *out = values.Absent(name) ? 0.0 : values.Real(name);
  return Status::Ok();
}

Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, float* out) {
  *out = values.Absent(name) ? 0.0f : static_cast<float>(values.Real(name));
  return Status::Ok();
}

Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, bool* out) {
  *out = values.Boolean(name);
  return Status::Ok();
}

Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, Schedule* out) {
  *out = values.AsSchedule(name);
  return Status::Ok();
}

Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, std::optional<nn::NetArch>* out) {
  out->reset();
  if (values.Text(name) == "auto") return Status::Ok();
  Result<nn::NetArch> arch = nn::ParseNetArch(values.Text(name));
  if (arch.ok()) *out = std::move(*arch);
  return arch.status();
}

Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, nn::Activation* out) {
  const Result<nn::Activation> activation = nn::ParseActivation(values.Text(name));
  if (activation.ok()) *out = *activation;
  return activation.status();
}

}  // namespace consac::learn
