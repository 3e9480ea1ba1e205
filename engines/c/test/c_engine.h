#pragma once
// For tests: a built-in world in the ticks of an engine that knows consac.h alone, and a model to act by.

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "consac.h"
#include "consac/env/buffer.h"
#include "consac/policy/policy.h"
#include "worlds/registry.h"

namespace consac::testing {

/// Fails with the sentence of what failed.
inline ::testing::AssertionResult IsOk(consac_status status) {
  if (status == CONSAC_OK) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << consac_status_name(status) << ": " << consac_last_error();
}
/// A code and a part of its sentence.
inline ::testing::AssertionResult FailsWith(consac_status status, consac_status code, const std::string& part) {
  if (status == code && std::string(consac_last_error()).find(part) != std::string::npos)
    return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << consac_status_name(status) << ": " << consac_last_error();
}

struct FreeModel {
  void operator()(consac_model* model) const { consac_model_free(model); }
};
using OwnedModel = std::unique_ptr<consac_model, FreeModel>;
struct FreeWorld {
  void operator()(consac_world* world) const { consac_world_free(world); }
};
using OwnedWorld = std::unique_ptr<consac_world, FreeWorld>;

/// A handle from a policy's file.
inline OwnedModel Handle(const Policy& policy) {
  const std::vector<std::byte> bytes = policy.ToFile().Serialise();
  consac_model* model = nullptr;
  EXPECT_TRUE(IsOk(consac_model_load_bytes(bytes.data(), bytes.size(), &model)));
  return OwnedModel(model);
}

/// A file's bytes.
inline std::vector<char> BytesOf(const consac_model* model) {
  std::size_t size = 0;
  EXPECT_TRUE(IsOk(consac_model_bytes(model, nullptr, &size)));
  std::vector<char> bytes(size);
  EXPECT_TRUE(IsOk(consac_model_bytes(model, bytes.data(), &size)));
  return bytes;
}

/// Adds what a leaf of a built-in world is.
inline void AddLeaf(consac_world* world, consac_rows rows, const std::string& name, const Space& space) {
  if (space.kind() == SpaceKind::kDiscrete) {
    ASSERT_TRUE(IsOk(consac_world_add_discrete(world, 0, rows, name.c_str(), space.n(), space.start())));
    return;
  }
  ASSERT_EQ(space.kind(), SpaceKind::kBox);
  consac_box box{};
  box.size = sizeof(box);
  box.type = static_cast<consac_type>(space.dtype());
  box.shape = space.shape().data();
  box.dimensions = space.shape().size();
  box.low = space.low().data();
  box.high = space.high().data();
  ASSERT_TRUE(IsOk(consac_world_add_box(world, 0, rows, name.c_str(), &box)));
}

/// Copies of a built-in world, one agent each.
class CEngine {
 public:
  CEngine(const char* name, std::int32_t copies)
      : inner_((*worlds::FindWorld(name))->create(copies)), rows_(inner_->spec().behaviours[0]) {
    const BehaviourSpec& behaviour = inner_->spec().behaviours[0];
    consac_world* made = nullptr;
    EXPECT_TRUE(IsOk(consac_world_new(name, &made)));
    world_.reset(made);
    EXPECT_TRUE(IsOk(consac_world_add_behaviour(made, "default", behaviour.slots, nullptr)));
    if (behaviour.observation_space.kind() == SpaceKind::kDict) {
      for (const auto& [part, space] : behaviour.observation_space.children())
        AddLeaf(made, CONSAC_OBSERVATION, part, space);
    } else {
      AddLeaf(made, CONSAC_OBSERVATION, "seen", behaviour.observation_space);
    }
    AddLeaf(made, CONSAC_ACTION, "done", behaviour.action_space);
  }
  consac_world* world() { return world_.get(); }
  const VectorEnv& inner() const { return *inner_; }

  /// One tick; the cue that was carried out, or what failed.
  consac_status Tick(double wait_s, consac_cue* cue) {
    const consac_status status = consac_world_poll(world(), wait_s, cue);
    if (status != CONSAC_OK || *cue == CONSAC_WAIT) return status;
    return *cue == CONSAC_RESET ? Begin() : Step();
  }
  void RunToTheEnd() {
    consac_cue cue = CONSAC_WAIT;
    for (int tick = 0; tick < 10'000'000 && consac_world_finished(world()) == 0; ++tick)
      ASSERT_TRUE(IsOk(Tick(0.01, &cue)));
    ASSERT_EQ(consac_world_finished(world()), 1);
  }

 private:
  consac_status Begin() {
    std::uint64_t seed = 0;
    EXPECT_EQ(consac_agent_seed(world(), 0, &seed), 1);
    inner_->Reset(seed, {&rows_.batch(), 1});
    return Offer();
  }
  consac_status Step() {
    Batch& batch = rows_.batch();
    const BehaviourSpec& behaviour = inner_->spec().behaviours[0];
    const auto agents = static_cast<std::size_t>(behaviour.slots);
    const std::size_t seen = behaviour.observation_layout.row_bytes, done = behaviour.action_layout.row_bytes;
    std::memcpy(batch.actions, consac_agent_action(world(), 0), agents * done);
    inner_->Step({&batch, 1});
    std::vector<std::uint8_t> ends(agents), ending(agents);
    for (std::size_t a = 0; a < agents; ++a)
      ends[a] = batch.terminated[a] != 0 ? CONSAC_TERMINATED : batch.truncated[a] != 0 ? CONSAC_TRUNCATED : 0;
    EXPECT_TRUE(IsOk(consac_world_add_rewards(world(), 0, batch.rewards, agents)));
    EXPECT_TRUE(IsOk(consac_world_end_episodes(world(), 0, ends.data(), agents)));
    EXPECT_TRUE(IsOk(consac_world_endings(world(), 0, ending.data(), agents)));
    for (std::size_t a = 0; a < agents; ++a) {
      if (ending[a] == 0) continue;
      std::memcpy(consac_agent_final_observation(world(), static_cast<consac_agent>(a)),
                  batch.final_observations + a * seen, seen);
    }
    return Offer();
  }
  consac_status Offer() {
    const BehaviourSpec& behaviour = inner_->spec().behaviours[0];
    std::memcpy(consac_agent_observation(world(), 0), rows_.batch().next_observations,
                static_cast<std::size_t>(behaviour.slots) * behaviour.observation_layout.row_bytes);
    return consac_world_offer(world());
  }

  std::unique_ptr<VectorEnv> inner_;
  BatchBuffer rows_;
  OwnedWorld world_;
};

}  // namespace consac::testing
