// Wrong calls: NULL, numbers out of range, the wrong moment. Each is an error with a sentence, and changes nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engines/c/test/c_engine.h"
#include "engines/host/test/in_process.h"

namespace consac::testing {
namespace {

TEST(CMisuse, NullIsAnErrorEverywhere) {
  consac_leaf leaf{};
  leaf.size = sizeof(leaf);
  consac_progress progress{};
  progress.size = sizeof(progress);
  consac_box box{};
  box.size = sizeof(box);
  consac_goals goals{};
  goals.size = sizeof(goals);
  consac_agent agent = 0;
  consac_cue cue = 0;
  std::size_t size = 0;
  std::uint64_t seed = 0;
  double low = 0.0, high = 0.0;
  float reward = 0.0f;
  std::uint8_t byte = 0;
  consac_model* model = nullptr;
  const std::int64_t two = 2;
  const consac_status failures[] = {
      consac_model_load(nullptr, &model),
      consac_model_load("x", nullptr),
      consac_model_load_bytes(nullptr, 8, &model),
      consac_model_load_bytes("x", 1, nullptr),
      consac_model_save(nullptr, "x"),
      consac_model_bytes(nullptr, nullptr, &size),
      consac_model_leaf(nullptr, CONSAC_ACTION, 0, &leaf),
      consac_model_bounds(nullptr, CONSAC_ACTION, 0, 0, &low, &high),
      consac_model_reserve(nullptr, 1),
      consac_model_seed(nullptr, 1),
      consac_model_act(nullptr, &low, 4, &low, 4),
      consac_model_act_rows(nullptr, nullptr),
      consac_world_new("x", nullptr),
      consac_world_add_behaviour(nullptr, "x", 1, nullptr),
      consac_world_add_numbers(nullptr, 0, CONSAC_ACTION, "x", 1, 0.0, 1.0),
      consac_world_add_box(nullptr, 0, CONSAC_ACTION, "x", &box),
      consac_world_add_discrete(nullptr, 0, CONSAC_ACTION, "x", 2, 0),
      consac_world_add_multi_discrete(nullptr, 0, CONSAC_ACTION, "x", &two, 1),
      consac_world_add_multi_binary(nullptr, 0, CONSAC_ACTION, "x", 2),
      consac_world_mask_actions(nullptr, 0),
      consac_world_set_time_limit(nullptr, 1),
      consac_world_set_agents_leave(nullptr),
      consac_world_set_goals(nullptr, 0, &goals),
      consac_world_first_agent(nullptr, 0, &agent),
      consac_world_row_bytes(nullptr, 0, CONSAC_ACTION, &size),
      consac_world_leaf(nullptr, 0, CONSAC_ACTION, 0, &leaf),
      consac_world_join(nullptr, 0, &agent),
      consac_world_leave(nullptr, 0),
      consac_world_serve(nullptr, nullptr),
      consac_world_train(nullptr, nullptr),
      consac_world_act(nullptr, nullptr, 0, nullptr),
      consac_world_by_hand(nullptr, 0),
      consac_world_stop(nullptr),
      consac_world_poll(nullptr, 0.0, &cue),
      consac_world_offer(nullptr),
      consac_agent_add_reward(nullptr, 0, 1.0f),
      consac_agent_end_episode(nullptr, 0, 1),
      consac_world_add_rewards(nullptr, 0, &reward, 1),
      consac_world_end_episodes(nullptr, 0, &byte, 1),
      consac_world_endings(nullptr, 0, &byte, 1),
      consac_world_resets(nullptr, 0, &byte, 1),
      consac_world_progress(nullptr, &progress),
      consac_world_pause(nullptr, 1),
      consac_world_refuse(nullptr, "x"),
      consac_world_model(nullptr, 0, &model),
      consac_world_save_model(nullptr, 0, "x"),
      consac_world_record(nullptr, 0),
      consac_world_save_recording(nullptr, 0, "x"),
  };
  for (const consac_status status : failures) EXPECT_EQ(status, CONSAC_INVALID_ARGUMENT);
  EXPECT_STRNE(consac_last_error(), "");
  EXPECT_EQ(consac_model_behaviour(nullptr), nullptr);
  EXPECT_EQ(consac_model_training(nullptr), nullptr);
  EXPECT_EQ(consac_model_remembers(nullptr), 0);
  EXPECT_EQ(consac_model_row_bytes(nullptr, CONSAC_ACTION), 0u);
  EXPECT_EQ(consac_model_leaf_count(nullptr, CONSAC_ACTION), 0u);
  EXPECT_EQ(consac_agent_observation(nullptr, 0), nullptr);
  EXPECT_EQ(consac_agent_final_observation(nullptr, 0), nullptr);
  EXPECT_EQ(consac_agent_action(nullptr, 0), nullptr);
  EXPECT_EQ(consac_agent_mask(nullptr, 0), nullptr);
  EXPECT_EQ(consac_agent_is_ending(nullptr, 0), 0);
  EXPECT_EQ(consac_agent_resets(nullptr, 0), 0);
  EXPECT_EQ(consac_agent_seed(nullptr, 0, &seed), 0);
  EXPECT_EQ(consac_world_finished(nullptr), 0);
  EXPECT_EQ(consac_world_port(nullptr), 0);
  EXPECT_EQ(consac_world_learned(nullptr, 0), 0);
  EXPECT_EQ(consac_world_recorded_steps(nullptr, 0), 0);
  consac_model_free(nullptr);
  consac_world_free(nullptr);
}

OwnedWorld Empty() {
  consac_world* world = nullptr;
  EXPECT_TRUE(IsOk(consac_world_new("misuse-v0", &world)));
  return OwnedWorld(world);
}

TEST(CMisuse, ADescriptionThatIsWrongSaysWhere) {
  const OwnedWorld owned = Empty();
  consac_world* world = owned.get();
  EXPECT_TRUE(FailsWith(consac_world_by_hand(world, 0), CONSAC_INVALID_ARGUMENT, "no behaviour"));
  EXPECT_TRUE(FailsWith(consac_world_add_numbers(world, 0, CONSAC_ACTION, "x", 1, 0.0, 1.0), CONSAC_INVALID_ARGUMENT,
                        "no behaviour 0"));
  EXPECT_TRUE(FailsWith(consac_world_add_behaviour(world, "x", 0, nullptr), CONSAC_INVALID_ARGUMENT, "0 agents"));
  ASSERT_TRUE(IsOk(consac_world_add_behaviour(world, "x", 1, nullptr)));
  const auto numbers = [&](consac_rows rows, std::int64_t count, double low, double high) {
    return consac_world_add_numbers(world, 0, rows, "n", count, low, high);
  };
  EXPECT_TRUE(FailsWith(numbers(CONSAC_MASK, 1, 0.0, 1.0), CONSAC_INVALID_ARGUMENT, "rows is 2"));
  EXPECT_TRUE(FailsWith(numbers(CONSAC_ACTION, 0, 0.0, 1.0), CONSAC_INVALID_ARGUMENT, "a side of 0"));
  EXPECT_TRUE(FailsWith(numbers(CONSAC_ACTION, std::numeric_limits<std::int64_t>::max(), 0.0, 1.0),
                        CONSAC_INVALID_ARGUMENT, "a side of"));
  EXPECT_TRUE(FailsWith(numbers(CONSAC_ACTION, 1, 1.0, 0.0), CONSAC_INVALID_ARGUMENT, "entry 'n'"));
  EXPECT_TRUE(FailsWith(numbers(CONSAC_ACTION, 1, std::nan(""), 0.0), CONSAC_INVALID_ARGUMENT, "entry 'n'"));
  EXPECT_TRUE(FailsWith(consac_world_add_discrete(world, 0, CONSAC_ACTION, "d", 0, 0), CONSAC_INVALID_ARGUMENT, "'d'"));
  EXPECT_TRUE(FailsWith(consac_world_add_multi_discrete(world, 0, CONSAC_ACTION, "m", nullptr, 3),
                        CONSAC_INVALID_ARGUMENT, "choices is NULL"));
  const std::int64_t one = 1;
  EXPECT_TRUE(FailsWith(
      consac_world_add_multi_discrete(world, 0, CONSAC_ACTION, "m", &one, std::numeric_limits<std::size_t>::max()),
      CONSAC_INVALID_ARGUMENT, "choices"));
  consac_box box{};
  EXPECT_TRUE(FailsWith(consac_world_add_box(world, 0, CONSAC_ACTION, "b", &box), CONSAC_INVALID_ARGUMENT, "box.size"));
  box.size = sizeof(box);
  box.dimensions = 2;
  EXPECT_TRUE(FailsWith(consac_world_add_box(world, 0, CONSAC_ACTION, "b", &box), CONSAC_INVALID_ARGUMENT,
                        "box.shape is NULL"));
  box.type = 11;
  EXPECT_TRUE(FailsWith(consac_world_add_box(world, 0, CONSAC_ACTION, "b", &box), CONSAC_INVALID_ARGUMENT, "box.type"));
  EXPECT_TRUE(FailsWith(consac_world_by_hand(world, 0), CONSAC_INVALID_ARGUMENT, "has no entry"));

  ASSERT_TRUE(IsOk(numbers(CONSAC_OBSERVATION, 2, -1.0, 1.0)));
  EXPECT_TRUE(FailsWith(numbers(CONSAC_OBSERVATION, 2, -1.0, 1.0), CONSAC_ALREADY_EXISTS, "'n'"));
  ASSERT_TRUE(IsOk(numbers(CONSAC_ACTION, 2, -1.0, 1.0)));
  ASSERT_TRUE(IsOk(consac_world_by_hand(world, 0)));
  EXPECT_TRUE(FailsWith(consac_world_mask_actions(world, 0), CONSAC_FAILED_PRECONDITION, "already"));
  EXPECT_TRUE(FailsWith(numbers(CONSAC_ACTION, 2, -1.0, 1.0), CONSAC_FAILED_PRECONDITION, "already"));
}

TEST(CMisuse, AWorldThatIsTooLargeIsRefused) {
  const OwnedWorld world = Empty();
  ASSERT_TRUE(IsOk(consac_world_add_behaviour(world.get(), "x", std::numeric_limits<std::int32_t>::max(), nullptr)));
  ASSERT_TRUE(IsOk(consac_world_add_numbers(world.get(), 0, CONSAC_OBSERVATION, "n", 1000, -1.0, 1.0)));
  ASSERT_TRUE(IsOk(consac_world_add_numbers(world.get(), 0, CONSAC_ACTION, "n", 1, -1.0, 1.0)));
  EXPECT_TRUE(FailsWith(consac_world_by_hand(world.get(), 0), CONSAC_RESOURCE_EXHAUSTED, "MiB"));
}

TEST(CMisuse, TheWrongMomentIsAnError) {
  CEngine engine("cartpole-v1", 2);
  consac_world* world = engine.world();
  consac_cue cue = CONSAC_ACT;
  consac_model* model = nullptr;
  EXPECT_TRUE(FailsWith(consac_world_poll(world, 0.0, &cue), CONSAC_FAILED_PRECONDITION, "nobody drives"));
  EXPECT_EQ(cue, CONSAC_WAIT);
  EXPECT_TRUE(FailsWith(consac_world_offer(world), CONSAC_FAILED_PRECONDITION, "nobody drives"));
  EXPECT_TRUE(FailsWith(consac_world_model(world, 0, &model), CONSAC_FAILED_PRECONDITION, "nobody drives"));
  ASSERT_TRUE(IsOk(consac_world_by_hand(world, 0)));
  EXPECT_TRUE(FailsWith(consac_world_offer(world), CONSAC_FAILED_PRECONDITION, "asked the agents"));
  EXPECT_TRUE(FailsWith(consac_world_model(world, 0, &model), CONSAC_FAILED_PRECONDITION, "no model"));
  EXPECT_TRUE(FailsWith(consac_world_poll(world, 0.0, nullptr), CONSAC_INVALID_ARGUMENT, "cue is NULL"));
  EXPECT_TRUE(FailsWith(consac_world_leave(world, 0), CONSAC_FAILED_PRECONDITION, "stay"));
  ASSERT_TRUE(IsOk(consac_world_poll(world, std::nan(""), &cue)));
  EXPECT_EQ(consac_agent_observation(world, 2), nullptr);
  EXPECT_EQ(consac_agent_action(world, -1), nullptr);
  EXPECT_EQ(consac_agent_is_ending(world, 99), 0);
  EXPECT_TRUE(FailsWith(consac_agent_add_reward(world, 2, 1.0f), CONSAC_INVALID_ARGUMENT, "no agent 2"));
  EXPECT_TRUE(FailsWith(consac_agent_end_episode(world, 0, 3), CONSAC_INVALID_ARGUMENT, "3 is no end"));
  const float rewards[3] = {};
  const std::uint8_t ends[2] = {0, 9};
  EXPECT_TRUE(FailsWith(consac_world_add_rewards(world, 0, rewards, 3), CONSAC_INVALID_ARGUMENT, "3 rewards; give 2"));
  EXPECT_TRUE(FailsWith(consac_world_end_episodes(world, 0, ends, 2), CONSAC_INVALID_ARGUMENT, "9 is no end"));
  EXPECT_TRUE(FailsWith(consac_world_end_episodes(world, 1, ends, 2), CONSAC_INVALID_ARGUMENT, "no behaviour 1"));
  EXPECT_TRUE(FailsWith(consac_world_save_recording(world, 0, "x"), CONSAC_FAILED_PRECONDITION, "taken down"));
}

TEST(CMisuse, ATrainingThatCannotBeginSaysWhy) {
  CEngine engine("cartpole-v1", 2);
  consac_training training{};
  training.size = sizeof(training);
  const auto train = [&] { return consac_world_train(engine.world(), &training); };
  training.algorithm = "ppo3";
  EXPECT_TRUE(FailsWith(train(), CONSAC_NOT_FOUND, "ppo3"));
  training.algorithm = nullptr;
  training.hyperparameters = "n_steps";
  EXPECT_TRUE(FailsWith(train(), CONSAC_INVALID_ARGUMENT, "'n_steps' is no NAME=VALUE"));
  training.hyperparameters = "n_stepps=3";
  EXPECT_TRUE(FailsWith(train(), CONSAC_INVALID_ARGUMENT, "n_steps"));
  training.hyperparameters = nullptr;
  training.total_steps = -1;
  EXPECT_TRUE(FailsWith(train(), CONSAC_INVALID_ARGUMENT, "-1"));
  training.total_steps = 0;
  training.start_from_count = std::numeric_limits<std::size_t>::max();
  EXPECT_TRUE(FailsWith(train(), CONSAC_INVALID_ARGUMENT, "models for 1 behaviours"));
  training.start_from_count = 1;
  EXPECT_TRUE(FailsWith(train(), CONSAC_INVALID_ARGUMENT, "models is NULL"));
  EXPECT_TRUE(FailsWith(consac_world_act(engine.world(), nullptr, 2, nullptr), CONSAC_INVALID_ARGUMENT, "2 models"));
  consac_serving serving{};
  serving.size = sizeof(serving);
  serving.port = 70000;
  EXPECT_TRUE(FailsWith(consac_world_serve(engine.world(), &serving), CONSAC_INVALID_ARGUMENT, "70000"));
  serving.port = 0;
  serving.host = "0.0.0.0";
  EXPECT_TRUE(FailsWith(consac_world_serve(engine.world(), &serving), CONSAC_INVALID_ARGUMENT, "token"));
}

TEST(CMisuse, APortThatIsTakenIsTold) {
  CEngine first("cartpole-v1", 1), second("cartpole-v1", 1);
  consac_serving serving{};
  serving.size = sizeof(serving);
  ASSERT_TRUE(IsOk(consac_world_serve(first.world(), &serving)));
  serving.port = consac_world_port(first.world());
  ASSERT_GT(serving.port, 0);
  EXPECT_TRUE(FailsWith(consac_world_serve(second.world(), &serving), CONSAC_ALREADY_EXISTS, ""));
  ASSERT_TRUE(IsOk(consac_world_stop(first.world())));
  EXPECT_EQ(consac_world_port(first.world()), 0);
  EXPECT_TRUE(IsOk(consac_world_serve(second.world(), &serving)));
}

// A world copies the models that it acts by or begins with, a model that a world gave is the caller's.
TEST(CMisuse, HandlesAreFreedInAnyOrder) {
  auto engine = std::make_unique<CEngine>("cartpole-v1", 2);
  ASSERT_TRUE(IsOk(consac_world_train(engine->world(), nullptr)));
  consac_model* learned = nullptr;
  ASSERT_TRUE(IsOk(consac_world_model(engine->world(), 0, &learned)));
  OwnedModel model(learned);
  consac_cue cue = CONSAC_WAIT;
  for (int tick = 0; tick < 300; ++tick) ASSERT_TRUE(IsOk(engine->Tick(0.0, &cue)));
  engine.reset();  // in the midst of learning

  CEngine other("cartpole-v1", 2);
  const consac_model* models[] = {model.get()};
  ASSERT_TRUE(IsOk(consac_world_act(other.world(), models, 1, nullptr)));
  model.reset();
  for (int tick = 0; tick < 20; ++tick) ASSERT_TRUE(IsOk(other.Tick(0.0, &cue)));
}

TEST(CMisuse, AModelOfAnotherWorldIsRefused) {
  host::TrainOptions options;
  options.total_steps = 64;
  const OwnedModel model = Handle(*Policy::Create(InProcess("road-v0", 1, options, 0)->Snapshot(), 1));
  CEngine engine("cartpole-v1", 1);
  const consac_model* models[] = {model.get()};
  EXPECT_TRUE(FailsWith(consac_world_act(engine.world(), models, 1, nullptr), CONSAC_INVALID_ARGUMENT,
                        "use a model trained for this world"));
}

}  // namespace
}  // namespace consac::testing
