// consac inspect: what is inside a model or checkpoint.
#include <nlohmann/json.hpp>

#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/json.h"
#include "consac/policy/policy.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

struct InspectFlags {
  std::string model, directory = "runs";
  bool json = false;
};

std::string ShapeOf(const Tensor& tensor) {
  std::string out;
  for (const std::int64_t size : tensor.shape) out += (out.empty() ? "" : " x ") + std::to_string(size);
  return out;
}

void PrintPolicy(const Policy& policy) {
  const PolicyData& data = policy.data();
  Print(
      "behaviour    {}\nobservation  {}\naction       {}\nnormaliser   {}\nparameters   {}\nself-test    reproduced\n",
      data.behaviour, data.observation_space.ToString(), data.action_space.ToString(),
      data.normaliser.active() ? "running mean and deviation" : "none", data.parameters.size() + data.log_std.size());
  Print("network\n");
  for (const nn::Block& block : data.network.blocks) {
    std::string inputs;
    for (const std::string& input : block.inputs) inputs += (inputs.empty() ? "" : ", ") + input;
    Print("  {:<12} {} {} -> {} {} (reads {})\n", block.name, block.op, block.in_size, block.out_size,
          nn::NameOf(block.activation), inputs);
  }
  const Result<nlohmann::json> training = ReadJson<nlohmann::json>(data.training_json);
  PrintLines("training     " + (training.ok() ? JsonText(*training, 2) : training.status().message()));
}

void PrintTensors(const ModelFile& file) {
  Print("tensors\n");
  for (const auto& [name, tensor] : file.tensors)
    Print("  {:<40} {:<5} {}\n", name, NameOf(tensor.dtype), ShapeOf(tensor));
}

int Inspect(const InspectFlags& flags) {
  const Result<std::string> path = run::FindModel(flags.model, flags.directory);
  if (!path.ok()) return Fail("inspect", path.status());
  const Result<ModelFile> file = ModelFile::Load(*path);
  if (!file.ok()) return Fail("inspect", file.status());
  const Result<nlohmann::json> read = ReadJson<nlohmann::json>(file->spec_json);
  if (!read.ok())
    return Fail("inspect", {StatusCode::kDataLoss, "'" + *path + "': its specification is " + read.status().message()});
  const nlohmann::json& spec = *read;
  const bool says_kind = spec.is_object() && spec.contains("kind") && spec["kind"].is_string();
  const std::string kind = says_kind ? spec["kind"].get<std::string>() : "?";
  std::optional<Policy> policy;
  if (kind == "policy") {
    Result<Policy> loaded = Policy::FromFile(*file);
    if (!loaded.ok()) return Fail("inspect", {loaded.status().code(), "'" + *path + "': " + loaded.status().message()});
    policy = std::move(*loaded);
  }
  if (flags.json) {
    nlohmann::json tensors = nlohmann::json::object();
    for (const auto& [name, tensor] : file->tensors)
      tensors[name] = {{"dtype", NameOf(tensor.dtype)}, {"shape", tensor.shape}};
    PrintLines(AsciiJsonText(nlohmann::json({{"path", *path}, {"spec", spec}, {"tensors", tensors}}), 2));
    return 0;
  }
  Print("file         {}\nkind         {}\n", *path, kind);
  if (policy.has_value()) {
    PrintPolicy(*policy);
  } else {
    PrintLines("content      " + JsonText(spec, 2));
  }
  PrintTensors(*file);
  return 0;
}

}  // namespace

Action AddInspect(CLI::App& app) {
  const auto flags = std::make_shared<InspectFlags>();
  app.add_option("model", flags->model, "a .consac file or a run's name")->required();
  app.add_option("--dir", flags->directory, "folder of the runs");
  app.add_flag("--json", flags->json, "as JSON");
  return [flags] { return Inspect(*flags); };
}

}  // namespace consac::cli
