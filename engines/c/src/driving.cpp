// Who drives a world, its ticks, and what comes of them.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "model.h"
#include "world.h"

using consac::Result;
using consac::Status;
using consac::StatusCode;
using consac::c::Ask;
using consac::c::Given;
using consac::c::Of;
using consac::c::Ready;

namespace consac::c {
namespace {

constexpr double kLongestWait = 60.0;     // s that one call holds the engine up
constexpr std::int64_t kSteps = 100'000;  // of a training, where nothing else is said

using Driver = std::unique_ptr<host::Driver>;
using Settings = std::vector<std::pair<std::string, std::string>>;

/// Nobody drives any more: a driver may not end after the next one has begun.
void Stop(consac_world* world) {
  world->driver.reset();
  if (world->agents != nullptr) world->agents->Abandon();
}

/// A new driver, in the place of the one before. `begin` gives it.
template <class Begin>
Status Drive(consac_world* world, const Begin& begin) {
  CONSAC_RETURN_IF_ERROR(Build(world));
  Stop(world);
  Result<Driver> driver = begin(*world->agents);
  if (!driver.ok()) {
    world->agents->Abandon();
    return driver.status();
  }
  world->driver = *std::move(driver);
  return Status::Ok();
}

std::string_view Trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// "a=1; b=2", or a line each.
Status ReadSettings(std::string_view text, Settings* settings) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(";\n"), text.size());
    const std::string_view setting = Trim(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (setting.empty()) continue;
    const std::size_t equals = setting.find('=');
    if (equals == std::string_view::npos) {
      return {StatusCode::kInvalidArgument,
              "training.hyperparameters: '" + std::string(setting) + "' is no NAME=VALUE; part them by ';'"};
    }
    settings->emplace_back(Trim(setting.substr(0, equals)), Trim(setting.substr(equals + 1)));
  }
  return Status::Ok();
}

/// Each model as a file's bytes.
Result<std::vector<std::vector<std::byte>>> FilesOf(const consac_model* const* models, std::size_t count) {
  std::vector<std::vector<std::byte>> files;
  if (count == 0) return files;
  CONSAC_RETURN_IF_ERROR(Given(models, "models"));
  for (std::size_t i = 0; i < count; ++i) {
    CONSAC_RETURN_IF_ERROR(Given(models[i], ("models[" + std::to_string(i) + "]").c_str()));
    files.push_back(models[i]->policy.ToFile().Serialise());
  }
  return files;
}

/// As many models as behaviours, before more than that is read from the caller's memory.
Status CheckModels(const consac_world& world, std::size_t models) {
  const std::size_t behaviours = world.described.offerings.size();
  if (models == behaviours) return Status::Ok();
  return {StatusCode::kInvalidArgument,
          std::to_string(models) + " models for " + std::to_string(behaviours) + " behaviours; give one for each"};
}

Status Driven(const consac_world* world) {
  if (world->driver != nullptr) return Status::Ok();
  return {StatusCode::kFailedPrecondition,
          "nobody drives the world; call consac_world_serve, _train, _act or _by_hand first"};
}

Status DrivenBehaviour(consac_world* world, std::int32_t b) {
  CONSAC_RETURN_IF_ERROR(Ready(world, b));
  return Driven(world);
}

Result<host::ServeOptions> ServeOptionsOf(const consac_serving* given) {
  consac_serving serving;
  CONSAC_RETURN_IF_ERROR(TakeOptions(given, "serving", &serving));
  if (serving.port < 0 || serving.port > 65535)
    return Status{StatusCode::kInvalidArgument,
                  "serving.port is " + std::to_string(serving.port) + "; give 0 to 65535"};
  if (!(serving.deadline_s >= 0.0) || !std::isfinite(serving.deadline_s))
    return Status{StatusCode::kInvalidArgument, "serving.deadline_s is no time; give seconds, or 0 for 60"};
  if (serving.training_length < 0) {
    return Status{StatusCode::kInvalidArgument,
                  "serving.training_length is " + std::to_string(serving.training_length) + "; give 0 or more steps"};
  }
  host::ServeOptions options;
  if (serving.host != nullptr) options.endpoint.host = serving.host;
  options.endpoint.port = serving.port;
  options.server.protocol = serving.text_protocol != 0 ? Protocol::kText1 : Protocol::kAuto;
  options.server.terminator = serving.no_newline != 0 ? text1::Terminator::kNone : text1::Terminator::kNewline;
  options.server.model_name = TextOf(serving.model_name);
  const bool acts_only = serving.training_length == 0 && !options.server.model_name.empty();
  options.server.training_length = serving.training_length > 0 || acts_only ? serving.training_length : kSteps;
  options.server.token = TextOf(serving.token);
  options.server.seed = serving.seed;
  if (serving.deadline_s > 0.0) options.server.deadline_s = serving.deadline_s;
  return options;
}

Result<host::TrainOptions> TrainOptionsOf(const consac_world& world, const consac_training* given) {
  consac_training training;
  CONSAC_RETURN_IF_ERROR(TakeOptions(given, "training", &training));
  if (training.total_steps < 0) {
    return Status{StatusCode::kInvalidArgument,
                  "training.total_steps is " + std::to_string(training.total_steps) + "; give 1 or more"};
  }
  host::TrainOptions options;
  if (training.algorithm != nullptr) options.algorithm = training.algorithm;
  CONSAC_RETURN_IF_ERROR(ReadSettings(TextOf(training.hyperparameters), &options.hyperparameters));
  options.total_steps = training.total_steps > 0 ? training.total_steps : kSteps;
  options.seed = training.seed;
  if (training.agents_go_on != 0) options.while_learning = host::WhileLearning::kGoOn;
  if (training.start_from_count > 0) CONSAC_RETURN_IF_ERROR(CheckModels(world, training.start_from_count));
  auto files = FilesOf(training.start_from, training.start_from_count);
  if (!files.ok()) return files.status();
  options.start_from = *std::move(files);
  options.log_folder = TextOf(training.log_folder);
  return options;
}

Status DescribeProgress(consac_world* world, consac_progress* into) {
  const host::Progress progress = world->driver != nullptr ? world->driver->progress() : host::Progress();
  const host::Tally tally = world->agents->tally();
  world->state = world->driver != nullptr ? progress.state : "nobody drives the world";
  consac_progress facts{};
  facts.state = world->state.c_str();
  facts.steps = progress.steps;
  facts.total_steps = progress.total_steps;
  facts.updates = progress.updates;
  facts.all_steps = tally.steps;
  facts.episodes = tally.episodes;
  facts.sessions = world->driver != nullptr ? world->driver->ended() : 0;
  facts.mean_episode_reward = tally.mean_episode_reward;
  facts.mean_episode_length = tally.mean_episode_length;
  facts.steps_per_s = progress.agent_steps_per_s;
  facts.poll_s = progress.poll_ms * 1e-3;
  return GiveFacts(facts, "progress", into);
}

}  // namespace
}  // namespace consac::c

extern "C" {

consac_status consac_world_serve(consac_world* world, const consac_serving* serving) {
  return Of(world, [&]() -> Status {
    const auto options = consac::c::ServeOptionsOf(serving);
    if (!options.ok()) return options.status();
    return consac::c::Drive(world,
                            [&](consac::host::TickWorld& agents) { return consac::host::Serve(agents, *options); });
  });
}

consac_status consac_world_train(consac_world* world, const consac_training* training) {
  return Of(world, [&]() -> Status {
    const auto options = consac::c::TrainOptionsOf(*world, training);
    if (!options.ok()) return options.status();
    return consac::c::Drive(world,
                            [&](consac::host::TickWorld& agents) { return consac::host::Train(agents, *options); });
  });
}

consac_status consac_world_act(consac_world* world, const consac_model* const* models, size_t count,
                               const consac_playing* playing) {
  return Of(world, [&]() -> Status {
    consac_playing taken;
    CONSAC_RETURN_IF_ERROR(consac::c::TakeOptions(playing, "playing", &taken));
    CONSAC_RETURN_IF_ERROR(consac::c::CheckModels(*world, count));
    const auto files = consac::c::FilesOf(models, count);
    if (!files.ok()) return files.status();
    consac::host::ActOptions options;
    options.mode = taken.sample != 0 ? consac::ActionMode::kSample : consac::ActionMode::kDeterministic;
    options.seed = taken.seed;
    options.pipelined = taken.pipelined != 0;
    return consac::c::Drive(
        world, [&](consac::host::TickWorld& agents) { return consac::host::Act(agents, *files, options); });
  });
}

consac_status consac_world_by_hand(consac_world* world, uint64_t seed) {
  return Of(world, [&] {
    return consac::c::Drive(world, [&](consac::host::TickWorld& agents) -> Result<consac::c::Driver> {
      CONSAC_RETURN_IF_ERROR(agents.EveryoneJoined());
      return consac::host::ByHand(agents, seed);
    });
  });
}

consac_status consac_world_stop(consac_world* world) {
  return Of(world, [&]() -> Status {
    consac::c::Stop(world);
    return Status::Ok();
  });
}

consac_status consac_world_poll(consac_world* world, double wait_s, consac_cue* cue) {
  if (cue != nullptr) *cue = CONSAC_WAIT;
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(cue, "cue"));
    CONSAC_RETURN_IF_ERROR(consac::c::Driven(world));
    CONSAC_RETURN_IF_ERROR(
        world->driver->Poll(std::isfinite(wait_s) ? std::clamp(wait_s, 0.0, consac::c::kLongestWait) : 0.0));
    *cue = static_cast<consac_cue>(world->agents->cue());
    return Status::Ok();
  });
}

consac_status consac_world_offer(consac_world* world) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::Driven(world));
    for (const auto& recorder : world->recorders) {
      if (recorder != nullptr && world->agents->cue() != consac::host::Cue::kWait) recorder->Note();
    }
    return world->agents->Offer();
  });
}

consac_status consac_world_progress(consac_world* world, consac_progress* progress) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::Build(world));
    return consac::c::DescribeProgress(world, progress);
  });
}

int32_t consac_world_finished(consac_world* world) {
  return Ask<int32_t>(world, 0, [&](int32_t* finished) {
    *finished = world->driver != nullptr && world->driver->finished() ? 1 : 0;
    return Status::Ok();
  });
}

int32_t consac_world_port(consac_world* world) {
  return Ask<int32_t>(world, 0, [&](int32_t* port) {
    *port = world->driver != nullptr ? world->driver->port() : 0;
    return Status::Ok();
  });
}

consac_status consac_world_pause(consac_world* world, int32_t paused) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::Driven(world));
    world->driver->SetPaused(paused != 0);
    return Status::Ok();
  });
}

consac_status consac_world_refuse(consac_world* world, const char* why) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(why, "why"));
    CONSAC_RETURN_IF_ERROR(consac::c::Driven(world));
    world->driver->Refuse(why);
    return Status::Ok();
  });
}

int32_t consac_world_learned(consac_world* world, int32_t behaviour) {
  return Ask<int32_t>(world, 0, [&](int32_t* learned) -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::DrivenBehaviour(world, behaviour));
    *learned = world->driver->learned(static_cast<std::size_t>(behaviour)) ? 1 : 0;
    return Status::Ok();
  });
}

consac_status consac_world_model(consac_world* world, int32_t behaviour, consac_model** model) {
  if (model != nullptr) *model = nullptr;
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(model, "where the model goes"));
    CONSAC_RETURN_IF_ERROR(consac::c::DrivenBehaviour(world, behaviour));
    const Result<consac::ModelFile> file = world->driver->Model(static_cast<std::size_t>(behaviour));
    if (!file.ok()) return file.status();
    return consac::c::GiveModel(consac::Policy::FromFile(*file), model);
  });
}

consac_status consac_world_save_model(consac_world* world, int32_t behaviour, const char* path) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(path, "path"));
    CONSAC_RETURN_IF_ERROR(consac::c::DrivenBehaviour(world, behaviour));
    return world->driver->SaveModel(static_cast<std::size_t>(behaviour), path);
  });
}

consac_status consac_world_record(consac_world* world, int32_t behaviour) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Ready(world, behaviour));
    const auto b = static_cast<std::size_t>(behaviour);
    world->recorders[b] = std::make_unique<consac::host::Recorder>(*world->agents, b);
    return Status::Ok();
  });
}

int64_t consac_world_recorded_steps(consac_world* world, int32_t behaviour) {
  return Ask<int64_t>(world, 0, [&](int64_t* steps) -> Status {
    CONSAC_RETURN_IF_ERROR(Ready(world, behaviour));
    const auto& recorder = world->recorders[static_cast<std::size_t>(behaviour)];
    *steps = recorder != nullptr ? recorder->steps() : 0;
    return Status::Ok();
  });
}

consac_status consac_world_save_recording(consac_world* world, int32_t behaviour, const char* path) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(path, "path"));
    CONSAC_RETURN_IF_ERROR(Ready(world, behaviour));
    const auto& recorder = world->recorders[static_cast<std::size_t>(behaviour)];
    if (recorder != nullptr) return recorder->Save(path);
    return {StatusCode::kFailedPrecondition, "nothing of this behaviour is taken down; see consac_world_record"};
  });
}

}  // extern "C"
