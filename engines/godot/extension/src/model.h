#pragma once
// ConsacModel: a trained model that scripts ask for actions themselves, without a world. Rows of observations and
// actions hold the numbers of the model's entries in the order that describe() lists, or, after arrange(), in the order
// in which a script lists them. Entries may also go in and out by their names.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "binding/class.h"
#include "consac/host/tick_world.h"
#include "consac/policy/policy.h"
#include "rows.h"

namespace consac::godot {

/// The class's name and methods.
ClassTable ModelTable();

/// An object of it. One thread.
class Model : public Instance {
 public:
  /// Reads a model from any path of the engine, res:// in an exported game too; it tests itself.
  Status Load(const std::string& path);
  /// The same from a file's bytes.
  Status LoadBytes(const Bytes& bytes);
  /// Whether one is loaded.
  bool Loaded();
  /// {behaviour, observations = [entries], actions = [entries], training = JSON text}.
  Result<Dictionary> Describe();
  /// "" when the model fits a behaviour as ConsacWorld.create() takes it, else the first difference.
  Status Fits(const Dictionary& behaviour);
  /// Like Fits; where it fits, rows hold the entries in the order of this description from now on.
  Status Arrange(const Dictionary& behaviour);
  /// The best actions for any number of rows of numbers.
  Result<Floats> Predict(const Floats& numbers);
  /// The same for models that see uint8 entries too; `masks` may be empty; `sample`: draws actions.
  Result<Floats> PredictWith(const Floats& numbers, const Bytes& bytes, const Bytes& masks, bool sample);
  /// By names: each observation entry's numbers (or one number, or bytes), row after row, in; each action entry's out.
  /// An entry that is alone has no name in a model: it is "observation" or "action", unless Arrange has named it.
  Result<Dictionary> PredictNamed(const Dictionary& observations);
  /// For models that remember, for each row of a call by itself: the agent of this row begins an episode; below 0: all
  /// do.
  void BeginEpisode(std::int64_t row);
  /// What the draws begin from.
  void SetSeed(std::int64_t seed);

 private:
  Status Take(std::span<const std::byte> bytes);
  Status MakeRoom(std::int64_t rows);
  Result<std::unique_ptr<host::TickWorld>> WorldOf(const Dictionary& behaviour) const;
  void Order(const std::vector<Leaf>& seen, const std::vector<Leaf>& done);
  Result<std::int64_t> CountRows(std::size_t numbers, std::size_t bytes) const;

  std::optional<Policy> policy_;
  std::vector<Leaf> seen_leaves_, done_leaves_;       // in the order of rows
  std::vector<std::string> seen_names_, done_names_;  // what scripts call them
  std::optional<RowMap> observation_, action_;
  std::int64_t room_ = 0;
  std::vector<std::byte> seen_, done_;
  std::vector<std::uint8_t> masks_;
  std::vector<std::uint8_t> begins_;  // [rows of any call so far]
  Rng rng_{0};
};

}  // namespace consac::godot
