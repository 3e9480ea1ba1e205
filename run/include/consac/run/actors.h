#pragma once
// The models that act for a world's behaviours: which files they are, and what they do at each step. For evaluation,
// for engines that ask for a model, for whoever watches one; learning has a loop of its own.

#include <span>
#include <string>
#include <vector>

#include "consac/base/status.h"
#include "consac/env/begins.h"
#include "consac/env/buffer.h"
#include "consac/env/gathered.h"
#include "consac/policy/policy.h"

namespace consac::run {

/// The file, in a run's folder, of the model for a behaviour: "model.consac" where it is the only one, else
/// "BEHAVIOUR.consac".
std::string ModelFileName(const EnvSpec& spec, const BehaviourSpec& behaviour);

/// The files of the models given as a path of one, as a run's name or as a folder: all that lie there, sorted.
/// kNotFound names what was looked for.
Result<std::vector<std::string>> FindModels(const std::string& model, const std::string& directory);
/// The same of what holds one model; several are an error that names them.
Result<std::string> FindModel(const std::string& model, const std::string& directory);

/// One model for each behaviour of a world, and the rows of its agents. Not thread-safe.
class Actors {
 public:
  /// Reads, of `files`, the model of each behaviour of `spec`: the one file there is, where one behaviour is all, else
  /// the file of its name (ModelFileName). A behaviour without model and a model that does not fit are errors.
  static Result<Actors> Load(std::span<const std::string> files, const EnvSpec& spec);

  /// The same of models that are in memory, one for each behaviour of `spec`, in its order.
  static Result<Actors> Of(std::vector<PolicyData> models, const EnvSpec& spec);

  /// Number of behaviours.
  std::size_t size() const { return actors_.size(); }
  /// One batch per behaviour, with all its slots: what the world is reset and stepped with. Valid for this object's
  /// life, and until the next Act.
  std::span<Batch> batches() { return batches_; }
  /// The world was reset: every episode begins, whatever a model remembers.
  void Begin();
  /// What came last becomes what is acted upon, and every agent of behaviour `b` that is there (`present` as in
  /// VectorEnv) chooses its action. Never allocates. `rng` is drawn from only in kSample.
  void Act(std::size_t b, std::span<const std::uint8_t> present, ActionMode mode, Rng& rng);
  /// The slots of behaviour `b` that take the present step: those that the latest Act was for.
  std::span<const std::int32_t> acting(std::size_t b) const { return actors_[b].acting.slots(); }
  /// The model of behaviour `b`.
  const Policy& policy(std::size_t b) const { return actors_[b].policy; }
  /// Its file; "" where it was in memory.
  const std::string& file(std::size_t b) const { return actors_[b].file; }

 private:
  Status Add(std::string file, Result<Policy> policy, const BehaviourSpec& behaviour);

  struct Actor {
    std::string file;
    Policy policy;
    BatchBuffer whole;  // every slot
    GatheredRows acting;
    EpisodeBegins episodes;
  };

  std::vector<Actor> actors_;
  std::vector<Batch> batches_;
};

}  // namespace consac::run
