// Models that act.
#include "model.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "rows.h"

using consac::ActionMode;
using consac::ActRows;
using consac::Layout;
using consac::Policy;
using consac::Status;
using consac::StatusCode;
using consac::c::Given;
using consac::c::Make;

consac_model::consac_model(Policy loaded)
    : policy(std::move(loaded)), choices(consac::MaskedChoices(policy.action_layout())) {
  const auto head = consac::ActionHead::Create(policy.action_layout(), policy.data().heads);
  explores = head.ok() && head->exploration_size() > 0;
}

namespace consac::c {
namespace {

constexpr std::int64_t kMostRowsAtOnce = 256;                // more are done in turns, so that activations stay small
constexpr std::int64_t kMostAgents = std::int64_t{1} << 20;  // that a model remembers

/// Whether its rows are agents that stay, at least where it draws.
bool HasAgents(const consac_model& model) {
  return model.policy.recurrent() || model.explores;
}

const Layout& LayoutOf(const consac_model& model, consac_rows rows) {
  return rows == CONSAC_ACTION ? model.policy.action_layout() : model.policy.observation_layout();
}

Result<const Leaf*> FindLeaf(const consac_model* model, consac_rows rows, size_t index) {
  CONSAC_RETURN_IF_ERROR(Given(model, "model"));
  CONSAC_RETURN_IF_ERROR(SeenOrDone(rows));
  const std::vector<Leaf>& leaves = LayoutOf(*model, rows).leaves;
  if (index < leaves.size()) return &leaves[index];
  return Status{StatusCode::kInvalidArgument,
                "there is no leaf " + std::to_string(index) + "; there are " + std::to_string(leaves.size())};
}

/// `agents`: rows are agents that stay, so that all of them need room.
Status Reserve(consac_model* model, std::int64_t rows, bool agents) {
  if (rows < 0 || (agents && rows > kMostAgents)) {
    return {StatusCode::kInvalidArgument,
            "room for " + std::to_string(rows) + " rows; give 0 to " + std::to_string(kMostAgents)};
  }
  if (!agents) rows = std::min(rows, kMostRowsAtOnce);
  if (rows <= model->room) return Status::Ok();
  CONSAC_RETURN_IF_ERROR(model->policy.MakeRoom(rows));
  model->room = rows;
  return Status::Ok();
}

/// Every number of a row is one.
bool Finite(const Layout& layout, const std::byte* row) {
  if (layout.plain_floats) {
    bool finite = true;
    for (std::size_t i = 0; i < layout.row_bytes; i += sizeof(float)) {
      float value;
      std::memcpy(&value, row + i, sizeof(value));
      finite = finite && std::isfinite(value);
    }
    return finite;
  }
  for (const Leaf& leaf : layout.leaves) {
    if (leaf.dtype != DType::kF32 && leaf.dtype != DType::kF64) continue;
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      if (!std::isfinite(ReadElement(leaf, row, i))) return false;
    }
  }
  return true;
}

/// What acting cannot find out by itself, so that it cannot fail.
Status CheckRows(const consac_model& model, const ActRows& call) {
  const Layout& seen = model.policy.observation_layout();
  const auto mask_bytes = static_cast<std::size_t>(model.policy.action_layout().mask_bytes);
  for (std::int64_t row = 0; row < call.rows; ++row) {
    const auto r = static_cast<std::size_t>(row);
    if (!Finite(seen, call.observations + r * seen.row_bytes)) {
      return {StatusCode::kNonFinite,
              "row " + std::to_string(row) + " of the observations has a NaN or an infinity; give numbers"};
    }
    if (call.masks != nullptr) {
      const std::int64_t choice = ChoiceWithNothingLegal(model.choices, call.masks + r * mask_bytes);
      if (choice >= 0) {
        return {StatusCode::kInvalidArgument, "row " + std::to_string(row) +
                                                  " of the masks has nothing legal in choice " +
                                                  std::to_string(choice) + "; leave something"};
      }
    }
    if (call.slots != nullptr && (call.slots[r] < 0 || call.slots[r] >= model.room)) {
      return {StatusCode::kInvalidArgument, "row " + std::to_string(row) + " is agent " +
                                                std::to_string(call.slots[r]) + "; there is room for " +
                                                std::to_string(model.room) + ", see consac_model_reserve"};
    }
  }
  return Status::Ok();
}

Status Act(consac_model* model, ActRows call, bool sample, std::byte* actions) {
  if (call.rows == 0) return Status::Ok();
  CONSAC_RETURN_IF_ERROR(Given(call.observations, "observations"));
  CONSAC_RETURN_IF_ERROR(Given(actions, "actions"));
  const bool agents = model->policy.recurrent() || (sample && model->explores);
  if (!agents) call.slots = nullptr, call.begins = nullptr;
  CONSAC_RETURN_IF_ERROR(Reserve(model, call.rows, agents));
  CONSAC_RETURN_IF_ERROR(CheckRows(*model, call));
  const std::size_t seen = model->policy.observation_layout().row_bytes;
  const std::size_t done = model->policy.action_layout().row_bytes;
  const auto masked = static_cast<std::size_t>(model->policy.action_layout().mask_bytes);
  for (std::int64_t first = 0; first < call.rows;) {
    const std::int64_t rows = agents ? call.rows : std::min(call.rows - first, model->room);
    const auto f = static_cast<std::size_t>(first);
    const ActRows turn{.observations = call.observations + f * seen,
                       .masks = call.masks != nullptr && masked > 0 ? call.masks + f * masked : nullptr,
                       .rows = rows,
                       .slots = call.slots,
                       .begins = call.begins};
    model->policy.Act(turn, sample ? ActionMode::kSample : ActionMode::kDeterministic, model->rng, actions + f * done);
    first += rows;
  }
  return Status::Ok();
}

/// How many rows a buffer holds.
Result<std::int64_t> CountRows(const char* what, std::size_t size, std::size_t row_bytes) {
  if (size % row_bytes == 0) return static_cast<std::int64_t>(size / row_bytes);
  return Status{StatusCode::kInvalidArgument, std::string(what) + " has " + std::to_string(size) +
                                                  " bytes, which is no whole number of rows of " +
                                                  std::to_string(row_bytes)};
}

}  // namespace

Status GiveModel(Result<Policy> policy, consac_model** model) {
  if (!policy.ok()) return policy.status();
  *model = new consac_model(*std::move(policy));
  return Status::Ok();
}

}  // namespace consac::c

extern "C" {

consac_status consac_model_load(const char* path, consac_model** model) {
  if (model != nullptr) *model = nullptr;
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "where the model goes"));
    CONSAC_RETURN_IF_ERROR(Given(path, "path"));
    return consac::c::GiveModel(Policy::Load(path), model);
  });
}

consac_status consac_model_load_bytes(const void* bytes, size_t size, consac_model** model) {
  if (model != nullptr) *model = nullptr;
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "where the model goes"));
    CONSAC_RETURN_IF_ERROR(Given(bytes, "bytes"));
    return consac::c::GiveModel(Policy::FromBytes({static_cast<const std::byte*>(bytes), size}), model);
  });
}

void consac_model_free(consac_model* model) {
  delete model;
}

consac_status consac_model_save(const consac_model* model, const char* path) {
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "model"));
    CONSAC_RETURN_IF_ERROR(Given(path, "path"));
    return model->policy.ToFile().Save(path);
  });
}

consac_status consac_model_bytes(const consac_model* model, void* bytes, size_t* size) {
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "model"));
    CONSAC_RETURN_IF_ERROR(Given(size, "size"));
    const std::vector<std::byte> file = model->policy.ToFile().Serialise();
    const std::size_t room = std::exchange(*size, file.size());
    if (bytes == nullptr) return Status::Ok();
    if (room < file.size()) {
      return {StatusCode::kResourceExhausted,
              "the model has " + std::to_string(file.size()) + " bytes; there is room for " + std::to_string(room)};
    }
    std::memcpy(bytes, file.data(), file.size());
    return Status::Ok();
  });
}

const char* consac_model_behaviour(const consac_model* model) {
  return model != nullptr ? model->policy.data().behaviour.c_str() : nullptr;
}

const char* consac_model_training(const consac_model* model) {
  return model != nullptr ? model->policy.data().training_json.c_str() : nullptr;
}

int32_t consac_model_remembers(const consac_model* model) {
  return model != nullptr && consac::c::HasAgents(*model) ? 1 : 0;
}

size_t consac_model_row_bytes(const consac_model* model, consac_rows rows) {
  if (model == nullptr) return 0;
  if (rows == CONSAC_MASK) return static_cast<size_t>(model->policy.action_layout().mask_bytes);
  return consac::c::SeenOrDone(rows).ok() ? consac::c::LayoutOf(*model, rows).row_bytes : 0;
}

size_t consac_model_leaf_count(const consac_model* model, consac_rows rows) {
  return model != nullptr && consac::c::SeenOrDone(rows).ok() ? consac::c::LayoutOf(*model, rows).leaves.size() : 0;
}

consac_status consac_model_leaf(const consac_model* model, consac_rows rows, size_t index, consac_leaf* leaf) {
  return Make([&]() -> Status {
    const consac::Result<const consac::Leaf*> found = consac::c::FindLeaf(model, rows, index);
    return found.ok() ? consac::c::DescribeLeaf(**found, (*found)->name.c_str(), leaf) : found.status();
  });
}

consac_status consac_model_bounds(const consac_model* model, consac_rows rows, size_t index, int64_t element,
                                  double* low, double* high) {
  return Make([&]() -> Status {
    const consac::Result<const consac::Leaf*> found = consac::c::FindLeaf(model, rows, index);
    if (!found.ok()) return found.status();
    CONSAC_RETURN_IF_ERROR(Given(low, "low"));
    CONSAC_RETURN_IF_ERROR(Given(high, "high"));
    if (element < 0 || element >= (*found)->count) {
      return {StatusCode::kInvalidArgument,
              "there is no number " + std::to_string(element) + "; the leaf has " + std::to_string((*found)->count)};
    }
    std::tie(*low, *high) = consac::ElementBounds(**found, element);
    return Status::Ok();
  });
}

consac_status consac_model_reserve(consac_model* model, int64_t rows) {
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "model"));
    return consac::c::Reserve(model, rows, consac::c::HasAgents(*model));
  });
}

consac_status consac_model_seed(consac_model* model, uint64_t seed) {
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "model"));
    model->rng = consac::Rng(seed);
    return Status::Ok();
  });
}

consac_status consac_model_act(consac_model* model, const void* observations, size_t observations_size, void* actions,
                               size_t actions_size) {
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "model"));
    const auto seen =
        consac::c::CountRows("observations", observations_size, model->policy.observation_layout().row_bytes);
    if (!seen.ok()) return seen.status();
    const auto done = consac::c::CountRows("actions", actions_size, model->policy.action_layout().row_bytes);
    if (!done.ok()) return done.status();
    if (*seen != *done) {
      return {StatusCode::kInvalidArgument, std::to_string(*seen) + " rows of observations, but " +
                                                std::to_string(*done) + " of actions; give as many"};
    }
    ActRows call;
    call.observations = static_cast<const std::byte*>(observations);
    call.rows = *seen;
    return consac::c::Act(model, call, false, static_cast<std::byte*>(actions));
  });
}

consac_status consac_model_act_rows(consac_model* model, const consac_acting* acting) {
  return Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "model"));
    CONSAC_RETURN_IF_ERROR(Given(acting, "acting"));
    consac_acting taken;
    CONSAC_RETURN_IF_ERROR(consac::c::TakeOptions(acting, "acting", &taken));
    if (taken.rows < 0) {
      return {StatusCode::kInvalidArgument, std::to_string(taken.rows) + " rows; give 0 or more"};
    }
    const ActRows call{.observations = static_cast<const std::byte*>(taken.observations),
                       .masks = taken.masks,
                       .rows = taken.rows,
                       .slots = taken.agents,
                       .begins = taken.begins};
    return consac::c::Act(model, call, taken.sample != 0, static_cast<std::byte*>(taken.actions));
  });
}

}  // extern "C"
