// What the plugin costs the game's thread in a tick: acting by a model for many agents, and learning inside. Measured
// through a Consac Trainer in the shim; the shim's own share (events, arrays) is in the column of whole ticks.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "ConsacAgentComponent.h"
#include "ConsacBlueprintLibrary.h"
#include "ConsacTrainer.h"
#include "Shim/Runtime.h"
#include "UObject/UObjectGlobals.h"
#undef check
#undef verify
#undef ensure
#undef PI
#include "consac/nn/net_arch.h"
#include "consac/nn/network.h"
#include "consac/policy/policy.h"

namespace {

constexpr int kNumbers = 8;  // an agent sees

class ABenchActor final : public AActor {
  SHIM_CLASS(ABenchActor, AActor)
};

/// The file of a model with two layers of 64.
std::string WriteModel() {
  consac::PolicyData data;
  data.observation_space = *consac::Space::Box(-1, 1, {kNumbers});
  data.action_space = *consac::Space::Discrete(4);
  consac::nn::ActorCriticOptions options;
  options.arch = {{}, {64, 64}, {64, 64}};
  options.observation_size = kNumbers;
  options.action_size = 4;
  data.network = consac::nn::ActorCritic(options);
  const auto network = consac::nn::Network::Create(data.network);
  data.parameters.resize(static_cast<std::size_t>(network->parameter_count()));
  consac::Rng rng(1, 1);
  network->Initialise(rng, data.parameters);
  const std::string path = (std::filesystem::temp_directory_path() / "consac_engine_bench.consac").string();
  (void)consac::Policy::Create(std::move(data), 1)->ToFile(1).Save(path);
  return path;
}

std::vector<float> SineTable() {
  std::vector<float> table(6283);
  for (std::size_t k = 0; k < table.size(); ++k) table[k] = std::sin(0.001f * static_cast<float>(k));
  return table;
}

void AddAgents(Shim::Game& game, int count) {
  for (int k = 0; k < count; ++k) {
    game.SpawnWith<ABenchActor>([&game](ABenchActor& actor) {
      UConsacAgentComponent* agent = game.AddComponent<UConsacAgentComponent>(actor);
      // As the pins of a graph: names that were made once.
      static const FName kSeen = TEXT("seen"), kDone = TEXT("done");
      FConsacEntry seen, done;
      seen.Name = kSeen;
      seen.Space = UConsacBlueprintLibrary::MakeBoxSpace(kNumbers, -1.0f, 1.0f);
      done.Name = kDone;
      done.Space = UConsacBlueprintLibrary::MakeDiscreteSpace(4);
      agent->Observations.Add(seen);
      agent->Actions.Add(done);
      agent->MaxEpisodeSteps = 100;
      agent->OnObserve.ShimBind(nullptr, [](UConsacAgentComponent* which) {
        // What a game sees is its own affair: numbers from a table, in an array that is made at once.
        static const std::vector<float> kTable = SineTable();
        static std::size_t phase = 0;
        ++phase;
        TArray<float> numbers;
        numbers.Reserve(kNumbers);
        for (std::size_t n = 0; n < kNumbers; ++n) numbers.Add(kTable[(phase + 1000 * n) % kTable.size()]);
        which->SetObservationNumbers(kSeen, numbers);
      });
      agent->OnAction.ShimBind(nullptr, [](UConsacAgentComponent* which) {
        which->AddReward(which->GetActionChoice(kDone) == 1 ? 1.0f : 0.0f);
      });
    });
  }
}

double Milliseconds(std::chrono::steady_clock::time_point since) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - since).count();
}

/// What the medians should stay below, in ms.
struct Targets {
  double poll, tick;
};

void PrintRow(const char* what, int agents, std::vector<double> polls, std::vector<double> ticks, Targets targets) {
  std::sort(polls.begin(), polls.end());
  std::sort(ticks.begin(), ticks.end());
  const auto at = [](const std::vector<double>& values, double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  std::printf("| %-34s | %6d | %9.4f | %9.4f | %11.2f | %9.4f | %9.4f | %11.2f |\n", what, agents, at(polls, 0.5),
              at(polls, 0.99), targets.poll, at(ticks, 0.5), at(ticks, 0.99), targets.tick);
}

void Measure(const char* what, EConsacMode mode, int agents, const std::string& model, Targets targets) {
  Shim::Game game;
  AddAgents(game, agents);
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = mode;
  trainer->LogSeconds = 0.0f;
  trainer->TotalSteps = 100000000;
  FConsacBehaviourModel row;
  row.Path = FString(Shim::Wide(model).c_str());
  trainer->Models.Add(row);
  for (int k = 0; k < 100; ++k) game.Tick();
  std::vector<double> polls, ticks;
  for (int k = 0; k < 3000; ++k) {
    const auto begun = std::chrono::steady_clock::now();
    trainer->Tick(0.01f);
    ticks.push_back(Milliseconds(begun));
    polls.push_back(static_cast<double>(trainer->GetTrainerProgress().PollMilliseconds));
    // A game draws and moves in between; the learner works meanwhile.
    if (mode == EConsacMode::Train) std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  PrintRow(what, agents, polls, ticks, targets);
}

}  // namespace

int main() {
  const std::string model = WriteModel();
  std::printf(
      "| what, ms of the game's thread      | agents | Poll, 50%% | Poll, 99%% | Poll wanted | tick, 50%% | tick, 99%% "
      "| "
      "tick wanted |\n");
  std::printf("|---|---|---|---|---|---|---|---|\n");
  for (const int agents : {1, 100, 1000})
    Measure("acts by a 64x64 model", EConsacMode::Act, agents, model, {0.15, 0.3});
  for (const int agents : {1, 16})
    Measure("learns inside, agents go on (ppo2)", EConsacMode::Train, agents, model, {0.1, 0.3});
  std::filesystem::remove(model);
  return 0;
}
