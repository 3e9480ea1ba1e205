// Worlds by the C interface: what they teach and how they act is bit for bit what it is in process.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "engines/c/test/c_engine.h"
#include "engines/host/test/in_process.h"
#include "tests/allocation_counter.h"
#include "tests/files.h"
#include "tests/support.h"

namespace consac::testing {
namespace {

struct Lesson {
  const char *algorithm, *world, *hyperparameters;
  std::int64_t steps;
};
class CTraining : public ::testing::TestWithParam<Lesson> {};
INSTANTIATE_TEST_SUITE_P(
    Each, CTraining,
    ::testing::Values(Lesson{"ppo2", "cartpole-v1", " n_steps = 64;\nbatch_size=32 ; ", 2048},
                      Lesson{"dqn", "cartpole-v1", "buffer_size=2000; net_arch=[16]; batch_size=32", 1500},
                      Lesson{"sac", "pendulum-v1", "buffer_size=2000; net_arch=[16]; batch_size=32", 600}),
    [](const auto& tested) { return std::string(tested.param.algorithm); });

host::TrainOptions OptionsOf(const Lesson& lesson) {
  host::TrainOptions options;
  options.algorithm = lesson.algorithm;
  options.total_steps = lesson.steps;
  options.seed = 3;
  options.hyperparameters = {{"batch_size", "32"}};
  if (std::string_view(lesson.algorithm) == "ppo2") {
    options.hyperparameters.emplace_back("n_steps", "64");
  } else {
    options.hyperparameters.emplace_back("buffer_size", "2000");
    options.hyperparameters.emplace_back("net_arch", "[16]");
  }
  return options;
}

consac_training TrainingOf(const Lesson& lesson) {
  consac_training training{};
  training.size = sizeof(training);
  training.algorithm = lesson.algorithm;
  training.hyperparameters = lesson.hyperparameters;
  training.total_steps = lesson.steps;
  training.seed = 3;
  return training;
}

OwnedModel ModelOf(consac_world* world) {
  consac_model* model = nullptr;
  EXPECT_TRUE(IsOk(consac_world_model(world, 0, &model)));
  return OwnedModel(model);
}

TEST_P(CTraining, LearnsWhatIsLearnedInProcess) {
  CEngine engine(GetParam().world, 2);
  const consac_training training = TrainingOf(GetParam());
  ASSERT_TRUE(IsOk(consac_world_train(engine.world(), &training)));
  EXPECT_EQ(consac_world_learned(engine.world(), 0), 0);
  engine.RunToTheEnd();
  EXPECT_EQ(consac_world_learned(engine.world(), 0), 1);
  consac_progress progress{};
  progress.size = sizeof(progress);
  ASSERT_TRUE(IsOk(consac_world_progress(engine.world(), &progress)));
  EXPECT_EQ(progress.steps, GetParam().steps);
  EXPECT_STREQ(progress.state, "trained; acting by the model");

  const auto alone = InProcess(GetParam().world, 2, OptionsOf(GetParam()), 3);
  const ScratchFolder folder("c_training");
  const std::string path = folder.path() + "/learned.consac";
  ASSERT_TRUE(IsOk(consac_world_save_model(engine.world(), 0, path.c_str())));
  EXPECT_EQ(Policy::Load(path)->data().parameters, alone->Snapshot().parameters);
  EXPECT_EQ(progress.updates, alone->updates());

  // The agents go on by it, and another world's act by it, as it does alone.
  const OwnedModel model = ModelOf(engine.world());
  CEngine other(GetParam().world, 3);
  const consac_model* models[] = {model.get()};
  ASSERT_TRUE(IsOk(consac_world_act(other.world(), models, 1, nullptr)));
  const std::size_t seen = consac_model_row_bytes(model.get(), CONSAC_OBSERVATION);
  const std::size_t done = consac_model_row_bytes(model.get(), CONSAC_ACTION);
  consac_cue cue = CONSAC_WAIT;
  int acted = 0;
  for (int tick = 0; tick < 40; ++tick) {
    std::vector<char> before(3 * seen), expected(3 * done);
    std::memcpy(before.data(), consac_agent_observation(other.world(), 0), before.size());
    ASSERT_TRUE(IsOk(other.Tick(0.0, &cue)));
    if (cue != CONSAC_ACT) continue;
    ASSERT_TRUE(IsOk(consac_model_act(model.get(), before.data(), before.size(), expected.data(), expected.size())));
    ASSERT_EQ(std::memcmp(consac_agent_action(other.world(), 0), expected.data(), expected.size()), 0);
    ++acted;
  }
  EXPECT_EQ(acted, 39);
}

TEST(CWorld, BeginsWithAModelThatWasLearnedElsewhere) {
  const Lesson lesson{"ppo2", "cartpole-v1", "n_steps=64", 512};
  CEngine first("cartpole-v1", 2);
  consac_training training = TrainingOf(lesson);
  ASSERT_TRUE(IsOk(consac_world_train(first.world(), &training)));
  first.RunToTheEnd();
  const OwnedModel model = ModelOf(first.world());
  CEngine second("cartpole-v1", 2);
  const consac_model* models[] = {model.get()};
  training.start_from = models;
  training.start_from_count = 1;
  ASSERT_TRUE(IsOk(consac_world_train(second.world(), &training)));
  const OwnedModel begun = ModelOf(second.world());
  std::vector<float> seen(4 * 50);
  Rng rng(1);
  for (float& number : seen) number = rng.Normal();
  std::vector<std::int32_t> ours(50), theirs(50);
  ASSERT_TRUE(IsOk(consac_model_act(model.get(), seen.data(), seen.size() * 4, ours.data(), 200)));
  ASSERT_TRUE(IsOk(consac_model_act(begun.get(), seen.data(), seen.size() * 4, theirs.data(), 200)));
  EXPECT_EQ(ours, theirs);
}

TEST(CWorld, ActingAllocatesNothing) {
  CEngine engine("cartpole-v1", 4);
  host::TrainOptions options;
  options.total_steps = 256;
  const OwnedModel model = Handle(*Policy::Create(InProcess("cartpole-v1", 4, options, 0)->Snapshot(), 1));
  const consac_model* models[] = {model.get()};
  ASSERT_TRUE(IsOk(consac_world_act(engine.world(), models, 1, nullptr)));
  consac_world* world = engine.world();
  float seen[4][4] = {};
  std::int32_t done[4] = {};
  ASSERT_TRUE(IsOk(consac_model_reserve(model.get(), 4)));
  consac_cue cue = CONSAC_WAIT;
  std::int64_t before = 0;
  for (int tick = 0; tick < 300; ++tick) {
    if (tick == 20) before = AllocationCount();
    ASSERT_EQ(consac_world_poll(world, 0.0, &cue), CONSAC_OK);
    for (consac_agent a = 0; a < 4; ++a) {
      if (cue == CONSAC_ACT) {
        ASSERT_EQ(consac_agent_add_reward(world, a, 1.0f), CONSAC_OK);
        const std::int32_t end = tick % 10 == a ? CONSAC_TERMINATED : CONSAC_GOES_ON;
        ASSERT_EQ(consac_agent_end_episode(world, a, end), CONSAC_OK);
        if (consac_agent_is_ending(world, a) != 0)
          std::memcpy(consac_agent_final_observation(world, a), seen[a], sizeof(seen[a]));
      }
      std::memcpy(consac_agent_observation(world, a), seen[a], sizeof(seen[a]));
    }
    ASSERT_EQ(consac_world_offer(world), CONSAC_OK);
    ASSERT_EQ(consac_model_act(model.get(), seen, sizeof(seen), done, sizeof(done)), CONSAC_OK);
  }
  EXPECT_EQ(AllocationCount() - before, 0);
}

TEST(CWorld, ATrainingInsideWritesItsLogWhereItIsAskedTo) {
  const ScratchFolder folder("c_log");
  const std::string logs = folder.path() + "/logs";
  CEngine engine("road-v0", 1);
  consac_training training = TrainingOf({"ppo2", "road-v0", "n_steps=64", 128});
  training.log_folder = logs.c_str();
  ASSERT_TRUE(IsOk(consac_world_train(engine.world(), &training)));
  engine.RunToTheEnd();
  const std::string csv = TextOf(logs + "/PPO2_1/progress.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3) << "keys, and two updates: " << csv;
}

/// Two numbers, out of order, and what may be done is masked.
OwnedWorld Masked() {
  consac_world* world = nullptr;
  EXPECT_TRUE(IsOk(consac_world_new("masked-v0", &world)));
  EXPECT_TRUE(IsOk(consac_world_add_behaviour(world, "one", 1, nullptr)));
  std::int32_t second = -1;
  EXPECT_TRUE(IsOk(consac_world_add_behaviour(world, "two", 2, &second)));
  EXPECT_EQ(second, 1);
  for (std::int32_t b = 0; b < 2; ++b) {
    EXPECT_TRUE(IsOk(consac_world_add_numbers(world, b, CONSAC_OBSERVATION, "z", 3, -1.0, INFINITY)));
    EXPECT_TRUE(IsOk(consac_world_add_multi_binary(world, b, CONSAC_OBSERVATION, "a", 5)));
    EXPECT_TRUE(IsOk(consac_world_add_discrete(world, b, CONSAC_ACTION, "move", 3, 10)));
    const std::int64_t choices[] = {2, 4};
    EXPECT_TRUE(IsOk(consac_world_add_multi_discrete(world, b, CONSAC_ACTION, "gear", choices, 2)));
  }
  EXPECT_TRUE(IsOk(consac_world_mask_actions(world, 1)));
  return OwnedWorld(world);
}

TEST(CWorld, SaysWhereEachEntryLies) {
  const OwnedWorld world = Masked();
  consac_leaf leaf{};
  leaf.size = sizeof(leaf);
  ASSERT_TRUE(IsOk(consac_world_leaf(world.get(), 1, CONSAC_OBSERVATION, 0, &leaf)));
  EXPECT_STREQ(leaf.name, "z");
  EXPECT_EQ(leaf.offset, 8u);  // after the five bits of "a"
  EXPECT_EQ(leaf.count, 3);
  ASSERT_TRUE(IsOk(consac_world_leaf(world.get(), 1, CONSAC_ACTION, 1, &leaf)));
  EXPECT_STREQ(leaf.name, "gear");
  EXPECT_EQ(leaf.kind, CONSAC_MULTI_DISCRETE);
  EXPECT_EQ(leaf.mask_count, 6);
  std::size_t bytes = 0;
  ASSERT_TRUE(IsOk(consac_world_row_bytes(world.get(), 1, CONSAC_MASK, &bytes)));
  EXPECT_EQ(bytes, 9u);
  ASSERT_TRUE(IsOk(consac_world_row_bytes(world.get(), 0, CONSAC_MASK, &bytes)));
  EXPECT_EQ(bytes, 0u);
  consac_agent agent = -1;
  ASSERT_TRUE(IsOk(consac_world_first_agent(world.get(), 1, &agent)));
  EXPECT_EQ(agent, 1);
  EXPECT_EQ(consac_agent_mask(world.get(), 0), nullptr);
  ASSERT_TRUE(IsOk(consac_world_row_bytes(world.get(), 1, CONSAC_OBSERVATION, &bytes)));
  EXPECT_EQ(static_cast<char*>(consac_agent_observation(world.get(), 2)) -
                static_cast<char*>(consac_agent_observation(world.get(), 1)),
            static_cast<std::ptrdiff_t>(bytes));
}

TEST(CWorld, AgentsComeAndGo) {
  const OwnedWorld owned = Masked();
  consac_world* world = owned.get();
  ASSERT_TRUE(IsOk(consac_world_set_agents_leave(world)));
  ASSERT_TRUE(IsOk(consac_world_by_hand(world, 7)));
  consac_cue cue = CONSAC_WAIT;
  consac_agent agent = -1;
  ASSERT_TRUE(IsOk(consac_world_poll(world, 0.0, &cue)));
  ASSERT_TRUE(IsOk(consac_world_join(world, 1, &agent)));
  EXPECT_EQ(agent, 1);
  EXPECT_EQ(consac_agent_resets(world, agent), 1);
  ASSERT_TRUE(IsOk(consac_world_offer(world)));
  ASSERT_TRUE(IsOk(consac_world_poll(world, 0.0, &cue)));
  ASSERT_EQ(cue, CONSAC_ACT);
  ASSERT_TRUE(IsOk(consac_world_leave(world, agent)));
  ASSERT_TRUE(IsOk(consac_world_offer(world)));
  ASSERT_TRUE(IsOk(consac_world_join(world, 1, &agent)));
  ASSERT_TRUE(IsOk(consac_world_join(world, 1, &agent)));
  EXPECT_TRUE(FailsWith(consac_world_join(world, 1, &agent), CONSAC_RESOURCE_EXHAUSTED, "'two' has room for 2"));
}

TEST(CWorld, TakesDownWhatIsPlayedByHand) {
  const ScratchFolder folder("c_recording");
  CEngine engine("road-v0", 1);
  ASSERT_TRUE(IsOk(consac_world_by_hand(engine.world(), 0)));
  ASSERT_TRUE(IsOk(consac_world_record(engine.world(), 0)));
  consac_cue cue = CONSAC_WAIT;
  for (int tick = 0; tick < 21; ++tick) ASSERT_TRUE(IsOk(engine.Tick(0.0, &cue)));
  const std::int64_t steps = consac_world_recorded_steps(engine.world(), 0);
  EXPECT_GE(steps, 20);
  ASSERT_TRUE(IsOk(consac_world_save_recording(engine.world(), 0, (folder.path() + "/played").c_str())));
  EXPECT_TRUE(ModelFile::Load(folder.path() + "/played").ok());
}

TEST(CWorld, PaysByGoalsThatTheEngineHasAPriceFor) {
  consac_world* world = nullptr;
  ASSERT_TRUE(IsOk(consac_world_new(nullptr, &world)));
  const OwnedWorld owned(world);
  ASSERT_TRUE(IsOk(consac_world_add_behaviour(world, "default", 1, nullptr)));
  for (const char* name : {"achieved_goal", "desired_goal"})
    ASSERT_TRUE(IsOk(consac_world_add_numbers(world, 0, CONSAC_OBSERVATION, name, 1, -1.0, 1.0)));
  ASSERT_TRUE(IsOk(consac_world_add_numbers(world, 0, CONSAC_ACTION, "push", 1, -1.0, 1.0)));
  int asked = 0;
  consac_goals goals{};
  goals.size = sizeof(goals);
  goals.reward = CONSAC_GOALS_FUNCTION;
  EXPECT_TRUE(FailsWith(consac_world_set_goals(world, 0, &goals), CONSAC_INVALID_ARGUMENT, "goals.price is NULL"));
  goals.user = &asked;
  goals.price = [](void* user, const void* observations, std::int64_t rows, float* rewards) {
    float seen[2];
    ++*static_cast<int*>(user);
    for (std::int64_t r = 0; r < rows; ++r) {
      std::memcpy(seen, static_cast<const char*>(observations) + r * 8, sizeof(seen));
      rewards[r] = seen[0] - seen[1];
    }
  };
  ASSERT_TRUE(IsOk(consac_world_set_goals(world, 0, &goals)));
  ASSERT_TRUE(IsOk(consac_world_by_hand(world, 0)));
  consac_cue cue = CONSAC_WAIT;
  const float seen[2] = {0.75f, 0.25f};
  for (int tick = 0; tick < 3; ++tick) {
    ASSERT_TRUE(IsOk(consac_world_poll(world, 0.0, &cue)));
    if (tick == 2) {
      ASSERT_TRUE(IsOk(consac_agent_end_episode(world, 0, CONSAC_TRUNCATED)));
      std::memcpy(consac_agent_final_observation(world, 0), seen, sizeof(seen));
    }
    std::memcpy(consac_agent_observation(world, 0), seen, sizeof(seen));
    ASSERT_TRUE(IsOk(consac_world_offer(world)));
  }
  consac_progress progress{};
  progress.size = sizeof(progress);
  ASSERT_TRUE(IsOk(consac_world_progress(world, &progress)));
  EXPECT_EQ(progress.mean_episode_reward, 1.0);
  EXPECT_GE(asked, 2);
}

TEST(CWorld, HandlesOfDifferentThreadsDoNotMeet) {
  std::vector<char> files[2];
  std::vector<std::thread> threads;
  for (std::vector<char>& file : files) {
    threads.emplace_back([&file] {
      CEngine engine("cartpole-v1", 2);
      const consac_training training = TrainingOf({"ppo2", "cartpole-v1", "n_steps=64", 512});
      ASSERT_TRUE(IsOk(consac_world_train(engine.world(), &training)));
      engine.RunToTheEnd();
      EXPECT_STREQ(consac_last_error(), "") << "what fails elsewhere is not told here";
      file = BytesOf(ModelOf(engine.world()).get());
    });
  }
  EXPECT_NE(consac_model_load("no such file", nullptr), CONSAC_OK);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(files[0], files[1]);
  EXPECT_FALSE(files[0].empty());
}

}  // namespace
}  // namespace consac::testing
