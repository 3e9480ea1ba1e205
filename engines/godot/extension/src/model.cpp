#include "model.h"

#include <algorithm>

#include "describe.h"
#include "files.h"

namespace consac::godot {
namespace {

constexpr std::int64_t kMostRowsAtOnce = 256;  // more are done in turns, so that activations stay small

const Status kNothingLoaded{StatusCode::kFailedPrecondition, "no model is loaded; call load() first"};

}  // namespace

ClassTable ModelTable() {
  ClassTable table;
  table.name = "ConsacModel";
  table.make = []() -> Instance* { return new Model; };
  table.methods = {
      Bind<Model, &Model::LastError>("last_error"),
      Bind<Model, &Model::Load>("load", {"path"}),
      Bind<Model, &Model::LoadBytes>("load_bytes", {"bytes"}),
      Bind<Model, &Model::Loaded>("loaded"),
      Bind<Model, &Model::Describe>("describe"),
      Bind<Model, &Model::Fits>("fits", {"behaviour"}),
      Bind<Model, &Model::Predict>("predict", {"observations"}),
      Bind<Model, &Model::PredictWith>("predict_with", {"observations", "bytes", "masks", "sample"}),
      Bind<Model, &Model::BeginEpisode>("begin_episode", {"row"}),
      Bind<Model, &Model::SetSeed>("set_seed", {"seed"}),
  };
  return table;
}

Status Model::Take(std::span<const std::byte> bytes) {
  Result<Policy> policy = Policy::FromBytes(bytes, 1);
  if (!policy.ok()) return policy.status();
  policy_.emplace(*std::move(policy));
  observation_.emplace(policy_->observation_layout(), policy_->observation_layout().leaves);
  action_.emplace(policy_->action_layout(), policy_->action_layout().leaves);
  room_ = 0;
  begins_.clear();
  return MakeRoom(1);
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
  table.Set("observations", Variant::Of(DescribeEntries(policy_->observation_layout())));
  table.Set("actions", Variant::Of(DescribeEntries(policy_->action_layout())));
  table.Set("training", Variant::Of(std::string_view(policy_->data().training_json)));
  return table;
}

Status Model::Fits(const Dictionary& behaviour) {
  if (!policy_.has_value()) return kNothingLoaded;
  Result<host::Offering> offering = ReadOffering(behaviour);
  if (!offering.ok()) return offering.status();
  host::TickWorldOptions options;
  options.offerings.push_back(*std::move(offering));
  const Result<std::unique_ptr<host::TickWorld>> world = host::TickWorld::Create(std::move(options));
  if (!world.ok()) return world.status();
  return policy_->Fits((*world)->spec().behaviours[0]);
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

void Model::BeginEpisode(std::int64_t row) {
  for (std::size_t i = 0; i < begins_.size(); ++i)
    begins_[i] = row < 0 || static_cast<std::int64_t>(i) == row ? 1 : begins_[i];
}

void Model::SetSeed(std::int64_t seed) {
  rng_ = Rng(static_cast<std::uint64_t>(seed));
}

}  // namespace consac::godot
