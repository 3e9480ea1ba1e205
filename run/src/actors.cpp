#include "consac/run/actors.h"

#include <algorithm>

#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/base/text.h"

namespace consac::run {
namespace {

std::string FileName(const std::string& path) {
  return FromPath(ToPath(path).filename());
}

std::string Behaviours(const EnvSpec& spec) {
  std::vector<std::string_view> names;
  for (const BehaviourSpec& behaviour : spec.behaviours) names.push_back(behaviour.name);
  return std::to_string(names.size()) + (names.size() == 1 ? " behaviour (" : " behaviours (") + Join(names) + ")";
}

/// Which of `files` is for `behaviour`.
Result<std::string> FileOf(std::span<const std::string> files, const EnvSpec& spec, const BehaviourSpec& behaviour) {
  if (files.size() == 1 && spec.behaviours.size() == 1) return files[0];
  for (const std::string& name : {ModelFileName(spec, behaviour), FileNameOf(behaviour.name, ".consac")}) {
    for (const std::string& file : files) {
      if (FileName(file) == name) return file;
    }
  }
  std::string found;
  for (const std::string& file : files) found += (found.empty() ? "'" : ", '") + file + "'";
  return Status{StatusCode::kInvalidArgument, "the world has " + Behaviours(spec) + ", and none of " + found +
                                                  " is the model of " + Quote(behaviour.name) +
                                                  "; name the run, or the folder with a " +
                                                  Quote(FileNameOf(behaviour.name, ".consac"))};
}

}  // namespace

std::string ModelFileName(const EnvSpec& spec, const BehaviourSpec& behaviour) {
  return spec.behaviours.size() == 1 ? "model.consac" : FileNameOf(behaviour.name, ".consac");
}

Result<Actors> Actors::Load(std::span<const std::string> files, const EnvSpec& spec) {
  Actors actors;
  if (files.size() == 1 && spec.behaviours.size() > 1) {
    return Status{StatusCode::kInvalidArgument, "'" + files[0] + "' is one model, and the world has " +
                                                    Behaviours(spec) +
                                                    "; name the run, or the folder that holds a model for each"};
  }
  for (const BehaviourSpec& behaviour : spec.behaviours) {
    const Result<std::string> file = FileOf(files, spec, behaviour);
    if (!file.ok()) return file.status();
    CONSAC_RETURN_IF_ERROR(actors.Add(*file, Policy::Load(*file, behaviour.slots), behaviour));
  }
  return actors;
}

Result<Actors> Actors::Of(std::vector<PolicyData> models, const EnvSpec& spec) {
  Actors actors;
  for (std::size_t b = 0; b < spec.behaviours.size(); ++b) {
    const BehaviourSpec& behaviour = spec.behaviours[b];
    if (b >= models.size() || models[b].behaviour != behaviour.name)
      return Status{StatusCode::kInvalidArgument, "the world has " + Behaviours(spec) + ", and no model of " +
                                                      Quote(behaviour.name) + " is learned here"};
    CONSAC_RETURN_IF_ERROR(actors.Add("", Policy::Create(std::move(models[b]), behaviour.slots), behaviour));
  }
  return actors;
}

Status Actors::Add(std::string file, Result<Policy> policy, const BehaviourSpec& behaviour) {
  if (!policy.ok()) return policy.status();
  const Status fits = policy->Fits(behaviour);
  if (!fits.ok()) return {fits.code(), (file.empty() ? "" : "'" + file + "': ") + fits.message()};
  actors_.push_back({std::move(file), std::move(*policy), BatchBuffer(behaviour), GatheredRows(behaviour),
                     EpisodeBegins(behaviour.slots)});
  batches_.push_back(actors_.back().whole.batch());
  return Status::Ok();
}

void Actors::Begin() {
  for (Actor& actor : actors_) actor.episodes.Restart();
}

void Actors::Act(std::size_t b, std::span<const std::uint8_t> present, ActionMode mode, Rng& rng) {
  Actor& actor = actors_[b];
  actor.whole.Advance();
  batches_[b] = actor.whole.batch();
  actor.acting.ChoosePresent(present);
  Batch part = actor.acting.PartOf(batches_[b]);
  actor.acting.TakeObservations(batches_[b], part);
  const std::span<const std::uint8_t> begins = actor.episodes.Next(batches_[b], part.slots);
  actor.policy.Act({part.observations, part.action_masks, part.rows(), part.slots.data(), begins.data()}, mode, rng,
                   part.actions);
  actor.acting.PutActions(part, batches_[b]);
}

}  // namespace consac::run
