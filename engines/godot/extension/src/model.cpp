#include "model.h"

#include <algorithm>

#include "consac/base/text.h"
#include "describe.h"
#include "files.h"
#include "reader.h"

namespace consac::godot {
namespace {

constexpr std::int64_t kMostRowsAtOnce = 256;  // more are done in turns, so that activations stay small

const Status kNothingLoaded{StatusCode::kFailedPrecondition, "no model is loaded; call load() first"};

}  // namespace

ClassTable ModelTable() {
  ClassTable table;
  table.name = "ConsacModel";
  table.brief = "A trained model that a script asks itself.";
  table.help = "For games without [ConsacSync]: load a model, ask it with [method predict_named].";
  table.make = []() -> Instance* { return new Model; };
  table.methods = {
      Bind<Model, &Model::LastError>("last_error", {},
                                     "Why the latest call that can fail did; \"\" where it went well."),
      Bind<Model, &Model::Load>("load", {"path"},
                                "Reads a model from any path of the engine; it tests itself. What is wrong, or \"\"."),
      Bind<Model, &Model::LoadBytes>("load_bytes", {"bytes"}, "The same from a file's bytes."),
      Bind<Model, &Model::Loaded>("loaded", {}, "Whether one is loaded."),
      Bind<Model, &Model::Describe>(
          "describe", {},
          "[code]{behaviour, observations = [entries], actions = [entries], training}[/code]; the entries "
          "in the order of rows."),
      Bind<Model, &Model::Fits>(
          "fits", {"behaviour"},
          "What differs between the model and a behaviour as [method ConsacWorld.create] takes it, or \"\"."),
      Bind<Model, &Model::Arrange>(
          "arrange", {"behaviour"},
          "Like [method fits]; where it fits, rows hold the entries in the order of this description from "
          "now on."),
      Bind<Model, &Model::PredictNamed>(
          "predict_named", {"observations"},
          "The same by names: [code]{place = PackedFloat32Array([...]), height = 3.0}[/code] in, "
          "[code]{steer = PackedFloat32Array([...])}[/code] out; of several rows one after the other. No "
          "order can be mistaken."),
      Bind<Model, &Model::Predict>(
          "predict", {"observations"},
          "The best actions for any number of rows. A row holds the numbers of all entries in the order of "
          "[method describe], which is the alphabet's unless [method arrange] has set another."),
      Bind<Model, &Model::PredictWith>(
          "predict_with", {"observations", "bytes", "masks", "sample"},
          "The same as [method predict] for models that see pictures too, with masks of legal choices (or "
          "none), the best action or one drawn."),
      Bind<Model, &Model::BeginEpisode>(
          "begin_episode", {"row"},
          "For models that remember: the agent of this row begins an episode; below 0: all do."),
      Bind<Model, &Model::SetSeed>("set_seed", {"seed"}, "What the draws begin from."),
  };
  return table;
}

Status Model::Take(std::span<const std::byte> bytes) {
  Result<Policy> policy = Policy::FromBytes(bytes, 1);
  if (!policy.ok()) return policy.status();
  policy_.emplace(*std::move(policy));
  Order(policy_->observation_layout().leaves, policy_->action_layout().leaves);
  room_ = 0;
  begins_.clear();
  return MakeRoom(1);
}

void Model::Order(const std::vector<Leaf>& seen, const std::vector<Leaf>& done) {
  seen_leaves_ = seen;
  done_leaves_ = done;
  const auto names = [](const std::vector<Leaf>& leaves, const char* alone) {
    std::vector<std::string> all;
    for (const Leaf& leaf : leaves) all.push_back(leaf.name.empty() ? alone : leaf.name);
    return all;
  };
  seen_names_ = names(seen, "observation");
  done_names_ = names(done, "action");
  observation_.emplace(policy_->observation_layout(), seen_leaves_);
  action_.emplace(policy_->action_layout(), done_leaves_);
}

Status Model::MakeRoom(std::int64_t rows) {
  if (rows <= room_) return Status::Ok();
  CONSAC_RETURN_IF_ERROR(policy_->MakeRoom(rows));
  room_ = rows;
  seen_.assign(static_cast<std::size_t>(rows) * policy_->observation_layout().row_bytes, std::byte{0});
  done_.assign(static_cast<std::size_t>(rows) * policy_->action_layout().row_bytes, std::byte{0});
  masks_.assign(static_cast<std::size_t>(rows * policy_->action_layout().mask_bytes), 1);
  observation_->Clear(rows, seen_.data());
  return Status::Ok();
}

Status Model::Load(const std::string& path) {
  const Result<std::vector<std::byte>> bytes = ReadEngineFile(path);
  if (!bytes.ok()) return bytes.status();
  const Status status = Take(*bytes);
  if (status.ok()) return status;
  return {status.code(), path + ": " + status.message()};
}

Status Model::LoadBytes(const Bytes& bytes) {
  return Take(std::as_bytes(bytes.span()));
}

bool Model::Loaded() {
  return policy_.has_value();
}

Result<Dictionary> Model::Describe() {
  if (!policy_.has_value()) return kNothingLoaded;
  Dictionary table;
  table.Set("behaviour", Variant::Of(std::string_view(policy_->data().behaviour)));
  table.Set("observations", Variant::Of(DescribeEntries(seen_leaves_)));
  table.Set("actions", Variant::Of(DescribeEntries(done_leaves_)));
  table.Set("training", Variant::Of(std::string_view(policy_->data().training_json)));
  return table;
}

Status Model::Fits(const Dictionary& behaviour) {
  return WorldOf(behaviour).status();
}

Status Model::Arrange(const Dictionary& behaviour) {
  const Result<std::unique_ptr<host::TickWorld>> world = WorldOf(behaviour);
  if (!world.ok()) return world.status();
  std::vector<Leaf> seen, done;
  for (std::size_t i = 0; i < policy_->observation_layout().leaves.size(); ++i)
    seen.push_back((*world)->ObservationLeaf(0, i));
  for (std::size_t i = 0; i < policy_->action_layout().leaves.size(); ++i) done.push_back((*world)->ActionLeaf(0, i));
  Order(seen, done);
  const Result<host::Offering> offering = ReadOffering(behaviour);
  if (!offering.ok()) return offering.status();
  for (std::size_t i = 0; i < seen.size(); ++i) seen_names_[i] = offering->observations[i].name;
  for (std::size_t i = 0; i < done.size(); ++i) done_names_[i] = offering->actions[i].name;
  return Status::Ok();
}

// A world of this behaviour, which the model fits.
Result<std::unique_ptr<host::TickWorld>> Model::WorldOf(const Dictionary& behaviour) const {
  if (!policy_.has_value()) return kNothingLoaded;
  Result<host::Offering> offering = ReadOffering(behaviour);
  if (!offering.ok()) return offering.status();
  host::TickWorldOptions options;
  options.offerings.push_back(*std::move(offering));
  Result<std::unique_ptr<host::TickWorld>> world = host::TickWorld::Create(std::move(options));
  if (!world.ok()) return world.status();
  CONSAC_RETURN_IF_ERROR(policy_->Fits((*world)->spec().behaviours[0]));
  return world;
}

Result<Floats> Model::Predict(const Floats& numbers) {
  return PredictWith(numbers, Bytes(), Bytes(), false);
}

Result<std::int64_t> Model::CountRows(std::size_t numbers, std::size_t bytes) const {
  const std::size_t of_numbers = observation_->numbers(), of_bytes = observation_->bytes();
  const std::size_t rows = of_numbers > 0 ? numbers / of_numbers : (of_bytes > 0 ? bytes / of_bytes : 0);
  if (rows * of_numbers == numbers && rows * of_bytes == bytes) return static_cast<std::int64_t>(rows);
  return Status{StatusCode::kInvalidArgument, std::to_string(numbers) + " numbers and " + std::to_string(bytes) +
                                                  " bytes are no whole rows; a row has " + std::to_string(of_numbers) +
                                                  " numbers and " + std::to_string(of_bytes) + " bytes"};
}

Result<Floats> Model::PredictWith(const Floats& numbers, const Bytes& bytes, const Bytes& masks, bool sample) {
  if (!policy_.has_value()) return kNothingLoaded;
  std::span<const float> in = numbers.span();
  std::span<const std::uint8_t> in_bytes = bytes.span(), in_masks = masks.span();
  const Result<std::int64_t> rows = CountRows(in.size(), in_bytes.size());
  if (!rows.ok()) return rows.status();
  if (!in_masks.empty() && in_masks.size() != static_cast<std::size_t>(*rows) * action_->masks()) {
    return Status{StatusCode::kInvalidArgument, std::to_string(in_masks.size()) + " mask bytes; expected none or " +
                                                    std::to_string(action_->masks()) + " for each of " +
                                                    std::to_string(*rows) + " rows"};
  }
  CONSAC_RETURN_IF_ERROR(MakeRoom(policy_->recurrent() ? *rows : std::min(*rows, kMostRowsAtOnce)));
  if (begins_.size() < static_cast<std::size_t>(*rows)) begins_.resize(static_cast<std::size_t>(*rows), 1);
  const auto take = [](auto* span, std::size_t count) {
    const auto front = span->first(std::min(count, span->size()));
    *span = span->subspan(front.size());
    return front;
  };
  Floats actions = Floats::OfSize(static_cast<std::size_t>(*rows) * action_->numbers());
  std::span<float> out = actions.writable();
  for (std::int64_t done = 0; done < *rows;) {
    const std::int64_t now = std::min(*rows - done, room_);
    const auto n = static_cast<std::size_t>(now);
    CONSAC_RETURN_IF_ERROR(observation_->Write(take(&in, n * observation_->numbers()), now, seen_.data()));
    if (observation_->bytes() > 0)
      observation_->WriteBytes(take(&in_bytes, n * observation_->bytes()), now, seen_.data());
    const bool masked = !in_masks.empty();
    if (masked) action_->WriteMasks(take(&in_masks, n * action_->masks()), now, masks_.data());
    const ActRows acting{.observations = seen_.data(),
                         .masks = masked ? masks_.data() : nullptr,
                         .rows = now,
                         .begins = begins_.data() + done};
    policy_->Act(acting, sample ? ActionMode::kSample : ActionMode::kDeterministic, rng_, done_.data());
    action_->Read(done_.data(), now, take(&out, n * action_->numbers()));
    done += now;
  }
  std::fill_n(begins_.begin(), static_cast<std::size_t>(*rows), std::uint8_t{0});
  return actions;
}

Result<Dictionary> Model::PredictNamed(const Dictionary& observations) {
  if (!policy_.has_value()) return kNothingLoaded;
  Reader reader(observations, "observations: ");
  std::vector<std::vector<double>> numbers(seen_leaves_.size());
  std::vector<Bytes> bytes(seen_leaves_.size());
  std::size_t rows = 0;
  for (std::size_t i = 0; i < seen_leaves_.size(); ++i) {
    const Leaf& leaf = seen_leaves_[i];
    const bool is_bytes = leaf.dtype == DType::kU8 && leaf.space.kind() == SpaceKind::kBox;
    if (!reader.Has(seen_names_[i]))
      return Status{StatusCode::kInvalidArgument, "observations: there is no " + Quote(seen_names_[i]) + "; give it"};
    if (is_bytes) {
      reader.Take(seen_names_[i], &bytes[i]);
    } else {
      reader.Take(seen_names_[i], &numbers[i]);
    }
    const auto width = static_cast<std::size_t>(leaf.count);
    const std::size_t given = is_bytes ? bytes[i].span().size() : numbers[i].size();
    rows = i == 0 ? given / width : rows;
    if (given != rows * width) {
      CONSAC_RETURN_IF_ERROR(reader.Finish());
      return Status{StatusCode::kInvalidArgument,
                    "observations: " + Quote(seen_names_[i]) + " has " + std::to_string(given) + " numbers; expected " +
                        std::to_string(width) + " for each of " + std::to_string(rows) + " rows"};
    }
  }
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  Floats in = Floats::OfSize(rows * observation_->numbers());
  Bytes pictures = Bytes::OfSize(rows * observation_->bytes());
  const std::span<float> to_numbers = in.writable();
  const std::span<std::uint8_t> to_bytes = pictures.writable();
  std::size_t number = 0, byte = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t i = 0; i < seen_leaves_.size(); ++i) {
      const auto width = static_cast<std::size_t>(seen_leaves_[i].count);
      for (std::size_t k = row * width; k < (row + 1) * width; ++k) {
        if (!numbers[i].empty()) {
          to_numbers[number++] = static_cast<float>(numbers[i][k]);
        } else {
          to_bytes[byte++] = bytes[i].span()[k];
        }
      }
    }
  }
  const Result<Floats> chosen = PredictWith(in, pictures, Bytes(), false);
  if (!chosen.ok()) return chosen.status();
  Dictionary actions;
  std::size_t first = 0;
  for (std::size_t i = 0; i < done_leaves_.size(); ++i) {
    const auto width = static_cast<std::size_t>(done_leaves_[i].count);
    Floats own = Floats::OfSize(rows * width);
    for (std::size_t row = 0; row < rows; ++row) {
      const auto from = chosen->span().subspan(row * action_->numbers() + first, width);
      std::copy(from.begin(), from.end(), own.writable().begin() + static_cast<std::ptrdiff_t>(row * width));
    }
    actions.Set(done_names_[i], Variant::Of(own));
    first += width;
  }
  return actions;
}

void Model::BeginEpisode(std::int64_t row) {
  for (std::size_t i = 0; i < begins_.size(); ++i)
    begins_[i] = row < 0 || static_cast<std::int64_t>(i) == row ? 1 : begins_[i];
}

void Model::SetSeed(std::int64_t seed) {
  rng_ = Rng(static_cast<std::uint64_t>(seed));
}

}  // namespace consac::godot
