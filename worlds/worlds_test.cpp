// Every row of the table of worlds: legal observations, exact state, one seed one trajectory, golden hashes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>

#include "consac/env/buffer.h"
#include "worlds/registry.h"

namespace consac::worlds {
namespace {

/// Steps with random actions and hashes all that is seen; checks every observation on the way.
std::uint64_t Walk(VectorEnv& env, std::uint64_t seed, int steps) {
  const BehaviourSpec& behaviour = env.spec().behaviours[0];
  BatchBuffer buffer(behaviour);
  Rng rng(seed, 99);
  StateHasher hasher;
  env.Reset(seed, {&buffer.batch(), 1});
  for (int t = 0; t < steps; ++t) {
    buffer.Advance();
    Batch& batch = buffer.batch();
    for (std::int64_t r = 0; r < batch.rows(); ++r)
      SampleRow(behaviour.action_layout, rng,
                batch.actions + static_cast<std::size_t>(r) * behaviour.action_layout.row_bytes);
    env.Step({&batch, 1});
    for (std::int64_t r = 0; r < batch.rows(); ++r) {
      const std::size_t at = static_cast<std::size_t>(r) * behaviour.observation_layout.row_bytes;
      EXPECT_TRUE(CheckRow(behaviour.observation_layout, batch.next_observations + at).ok())
          << CheckRow(behaviour.observation_layout, batch.next_observations + at).message();
      if ((batch.terminated[r] | batch.truncated[r]) != 0) {
        EXPECT_FALSE(batch.terminated[r] != 0 && batch.truncated[r] != 0);
      }
    }
    // Rounded, because libm's last digit differs between machines.
    for (std::int64_t r = 0; r < batch.rows(); ++r) {
      const std::byte* row =
          batch.next_observations + static_cast<std::size_t>(r) * behaviour.observation_layout.row_bytes;
      for (const Leaf& leaf : behaviour.observation_layout.leaves) {
        for (std::int64_t e = 0; e < leaf.count; ++e) {
          auto rounded = static_cast<std::int64_t>(std::nearbyint(1e3 * ReadElement(leaf, row, e)));
          hasher("o", rounded);
        }
      }
    }
    for (std::int64_t r = 0; r < batch.rows(); ++r) {
      auto rounded = static_cast<std::int64_t>(std::nearbyint(1e3 * static_cast<double>(batch.rewards[r])));
      hasher("reward", rounded);
    }
    hasher("terminated", std::span<std::uint8_t>(batch.terminated, static_cast<std::size_t>(batch.rows())));
    hasher("truncated", std::span<std::uint8_t>(batch.truncated, static_cast<std::size_t>(batch.rows())));
  }
  return hasher.hash();
}

class EveryWorld : public ::testing::TestWithParam<const World*> {};
std::vector<const World*> Rows() {
  std::vector<const World*> rows;
  for (const World& world : Worlds()) {
    if (world.argument == nullptr) rows.push_back(&world);
  }
  return rows;
}
INSTANTIATE_TEST_SUITE_P(Table, EveryWorld, ::testing::ValuesIn(Rows()), [](const auto& row) {
  std::string name = row.param->id;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
});

TEST_P(EveryWorld, OneSeedIsOneTrajectory) {
  const auto a = GetParam()->create(3), b = GetParam()->create(3);
  EXPECT_EQ(a->spec().id, GetParam()->id);
  EXPECT_EQ(Walk(*a, 5, 700), Walk(*b, 5, 700));
  EXPECT_NE(Walk(*a, 5, 700), Walk(*b, 6, 700));
}

TEST_P(EveryWorld, RestoredStateGoesOnTheSameWay) {
  const auto env = GetParam()->create(2), other = GetParam()->create(2);
  Walk(*env, 1, 137);
  StateWriter writer;
  env->Visit(writer);
  StateReader reader(writer.fields());
  other->Visit(reader);
  ASSERT_TRUE(reader.status().ok());
  const BehaviourSpec& behaviour = env->spec().behaviours[0];
  BatchBuffer a(behaviour), b(behaviour);
  std::memset(a.batch().actions, 0, 2 * behaviour.action_layout.row_bytes);
  std::memset(b.batch().actions, 0, 2 * behaviour.action_layout.row_bytes);
  for (int t = 0; t < 300; ++t) {
    env->Step({&a.batch(), 1});
    other->Step({&b.batch(), 1});
    ASSERT_EQ(std::memcmp(a.batch().next_observations, b.batch().next_observations,
                          2 * behaviour.observation_layout.row_bytes),
              0);
  }
}

// A world may step several copies by one call; 19 are two such calls and some left over.
TEST_P(EveryWorld, CopiesStepAsEachWouldAlone) {
  constexpr std::int32_t kCopies = 19;
  const auto many = GetParam()->create(kCopies);
  BatchBuffer buffer(many->spec().behaviours[0]);
  Batch& batch = buffer.batch();
  many->Reset(5, {&batch, 1});
  std::vector<std::unique_ptr<VectorEnv>> alone;
  std::vector<BatchBuffer> buffers;
  for (std::int32_t i = 0; i < kCopies; ++i) {
    alone.push_back(GetParam()->create(1));
    buffers.emplace_back(alone.back()->spec().behaviours[0]);
    alone.back()->Reset(5 + static_cast<std::uint64_t>(i), {&buffers.back().batch(), 1});
  }
  const std::size_t seen = many->spec().behaviours[0].observation_layout.row_bytes;
  const std::size_t done = many->spec().behaviours[0].action_layout.row_bytes;
  Rng rng(5, 99);
  int endings = 0;
  for (int t = 0; t < 300; ++t) {
    buffer.Advance();
    for (std::size_t i = 0; i < kCopies; ++i)
      SampleRow(many->spec().behaviours[0].action_layout, rng, batch.actions + i * done);
    many->Step({&batch, 1});
    for (std::size_t i = 0; i < kCopies; ++i) {
      buffers[i].Advance();
      Batch& one = buffers[i].batch();
      std::memcpy(one.actions, batch.actions + i * done, done);
      alone[i]->Step({&one, 1});
      ASSERT_EQ(std::memcmp(batch.next_observations + i * seen, one.next_observations, seen), 0) << i << " at " << t;
      ASSERT_EQ(batch.rewards[i], one.rewards[0]);
      ASSERT_EQ(batch.terminated[i], one.terminated[0]);
      ASSERT_EQ(batch.truncated[i], one.truncated[0]);
      if ((one.terminated[0] | one.truncated[0]) == 0) continue;
      ++endings;
      ASSERT_EQ(std::memcmp(batch.final_observations + i * seen, one.final_observations, seen), 0);
    }
  }
  EXPECT_TRUE(endings > 0 || many->spec().max_episode_steps == 0);
}

TEST_P(EveryWorld, TimeLimitTruncatesAndNeverTerminates) {
  const auto env = GetParam()->create(1);
  if (env->spec().max_episode_steps == 0) {
    EXPECT_STREQ(GetParam()->id, "road-v0");  // the thesis' road has none
    return;
  }
  const BehaviourSpec& behaviour = env->spec().behaviours[0];
  BatchBuffer buffer(behaviour);
  env->Reset(1, {&buffer.batch(), 1});
  std::memset(buffer.batch().actions, 0, behaviour.action_layout.row_bytes);
  for (std::int64_t t = 1, length = 1; t <= 3000; ++t, ++length) {
    env->Step({&buffer.batch(), 1});
    if (buffer.batch().truncated[0] != 0) {
      EXPECT_EQ(length, env->spec().max_episode_steps);
    }
    EXPECT_LE(length, env->spec().max_episode_steps);
    if ((buffer.batch().truncated[0] | buffer.batch().terminated[0]) != 0) length = 0;
  }
}

// Raise a world's version when one of these must change.
TEST(Worlds, GoldenTrajectoryHashes) {
  const std::map<std::string, std::uint64_t> golden = {
      {"road-v0", 18237697503616575722ull},
      {"cartpole-v1", 1125982027830315086ull},
      {"pendulum-v1", 15506403609510171566ull},
      {"point-v0", 10096746987152339022ull},
      {"maze-v0", 7084299119515007020ull},
      {"reach3-v0", 10337454504279838093ull},
      {"pixel-catch-v0", 17767452150960810102ull},
      {"identity-discrete-v0", 17863679545947102647ull},
      {"identity-box-v0", 33844089556532124ull},
      {"identity-multidiscrete-v0", 1428224385367969696ull},
      {"identity-multibinary-v0", 15817734353667198647ull},
      {"bit-flipping-v0", 1274391717905734117ull},
      {"bit-flipping-continuous-v0", 2318704811640287695ull},
      {"point-reach-v0", 855493993101184580ull},
      {"point-reach-dense-v0", 9802781806598876215ull},
      {"yumi-reach-v0", 10060829287963116343ull},
      {"yumi-reach-dense-v0", 11800537310598415010ull},
      {"yumi-reach-joints-v0", 14459065627973936431ull},
      {"yumi-reach-precise-v0", 10060829287963116343ull},  // chance comes within 5 cm of none of these goals
      {"yumi-reach-dual-v0", 17936502855456340386ull},
  };
  for (const World& world : Worlds()) {
    if (world.argument != nullptr) continue;
    const auto env = world.create(2);
    const std::uint64_t hash = Walk(*env, 42, 150);
    const auto expected = golden.find(world.id);
    EXPECT_EQ(hash, expected == golden.end() ? 0 : expected->second) << "{\"" << world.id << "\", " << hash << "ull},";
  }
}

TEST(Worlds, UnknownOnesFindTheirNearest) {
  EXPECT_NE(FindWorld("road-v1").status().message().find("'road-v0'"), std::string::npos);
  EXPECT_NE(FindWorld("cartpole").status().message().find("'cartpole-v1'"), std::string::npos);
}

TEST(Worlds, AnArgumentIsWantedOrNot) {
  EXPECT_NE(FindWorld("road-v0:arm").status().message().find("takes nothing after its name"), std::string::npos);
  EXPECT_NE(FindWorld("twin-reach-v0").status().message().find("twin-reach-v0:TWIN"), std::string::npos);
  EXPECT_NE(FindWorld("twin-reach-v0:").status().message().find("twin-reach-v0:TWIN"), std::string::npos);
  EXPECT_NE(FindWorld("twin-reach-v1:arm").status().message().find("'twin-reach-v0'"), std::string::npos);
  EXPECT_TRUE(FindWorld("twin-reach-v0:arm").ok());
  EXPECT_TRUE(MakeWorld("road-v0", 2).ok());
}

TEST(Worlds, SuggestedSettingsAreReadPerAlgorithm) {
  const World& road = **FindWorld("road-v0");
  EXPECT_FALSE(SuggestedSettings(road, "ppo2").empty());
  EXPECT_TRUE(SuggestedSettings(road, "sac").empty());
  World made = road;
  made.suggested = "ppo2: a=1  b=x ; ppo: c=[1,2]";
  EXPECT_EQ(SuggestedSettings(made, "ppo2"),
            (std::vector<std::pair<std::string, std::string>>{{"a", "1"}, {"b", "x"}}));
  EXPECT_EQ(SuggestedSettings(made, "ppo"), (std::vector<std::pair<std::string, std::string>>{{"c", "[1,2]"}}));
}

}  // namespace
}  // namespace consac::worlds
