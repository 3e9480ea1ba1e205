// `policy`: which networks it makes of which observations, that they learn from images and survive the model file, and
// what is refused in one line.
#include "algo/policy_kind.h"

#include <cstring>

#include "learn/test/algo/training_harness.h"

namespace consac::learn {
namespace {

/// The smallest image of the nature CNN, bright on the left or on the right: which is the action that pays. Episodes of
/// ten steps. Grey, channels last or first.
class BrightSide final : public VectorEnv {
 public:
  static constexpr std::size_t kSide = 36, kPixels = kSide * kSide;

  explicit BrightSide(std::int32_t copies, bool channels_first = false)
      : sides_(static_cast<std::size_t>(copies)), steps_(sides_.size()) {
    const std::vector<std::int64_t> shape = {channels_first ? 1 : 36, 36, channels_first ? 36 : 1};
    spec_.id = "bright-side";
    spec_.behaviours.push_back(
        BehaviourSpec::Of("default", *Space::Box(0, 255, shape, DType::kU8), *Space::Discrete(2), copies));
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override {
    rng_ = Rng(seed, 5);
    for (std::size_t i = 0; i < sides_.size(); ++i) Draw(batches[0].next_observations, i);
  }
  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      batch.rewards[i] = reinterpret_cast<const std::int32_t*>(batch.actions)[i] == sides_[i] ? 1.0f : 0.0f;
      batch.terminated[i] = ++steps_[i] % 10 == 0 ? 1 : 0;
      batch.truncated[i] = 0;
      Draw(batch.next_observations, i);
      std::memcpy(batch.final_observations + i * kPixels, batch.next_observations + i * kPixels, kPixels);
    }
  }
  void Visit(Archive& archive) override {
    archive("rng", rng_);
    archive("sides", sides_);
    archive("steps", steps_);
  }

 private:
  void Draw(std::byte* images, std::size_t i) {
    sides_[i] = static_cast<std::int32_t>(rng_.Below(2));
    for (std::size_t p = 0; p < kPixels; ++p) {
      const bool bright = (p % kSide >= kSide / 2) == (sides_[i] == 1);
      images[i * kPixels + p] = static_cast<std::byte>(rng_.Below(100) + (bright ? 155 : 0));
    }
  }
  EnvSpec spec_;
  Rng rng_;
  std::vector<std::int32_t> sides_;
  std::vector<std::int64_t> steps_;
};

Result<std::unique_ptr<Learner>> LearnerOf(const char* algorithm, const BehaviourSpec& behaviour,
                                           const Settings& settings, const char* preset = nullptr) {
  const Algorithm* row = *FindAlgorithm(algorithm);
  HyperparameterSet values(row->hyperparameters);
  if (preset != nullptr) values.UseDefaultsOf(*ParseGeneration(preset));
  for (const auto& [name, text] : settings) EXPECT_TRUE(values.Set(name, text).ok()) << name;
  LearnerOptions options;
  options.behaviour = behaviour;
  return row->create(options, values);
}

/// "slice convolution dense": the kinds of the network's blocks with the widths of dense ones.
std::string BlocksOf(const char* algorithm, const BehaviourSpec& behaviour, const Settings& settings,
                     const char* preset = nullptr) {
  const auto learner = LearnerOf(algorithm, behaviour, settings, preset);
  if (!learner.ok()) return learner.status().message();
  std::string blocks;
  for (const nn::Block& block : (*learner)->Snapshot().network.blocks) {
    blocks += (blocks.empty() ? "" : " ") + block.op;
    if (block.op == "dense") blocks += ":" + std::to_string(block.out_size);
  }
  return blocks;
}

BehaviourSpec Seeing(const Space& space) {
  return BehaviourSpec::Of("eye", space, *Space::Discrete(3), 1);
}
const Space kImage = *Space::Box(0, 255, {36, 40, 3}, DType::kU8);
const Space kSmallImage = *Space::Box(0, 255, {35, 40, 3}, DType::kU8);
const std::string kCnn = "slice convolution convolution convolution dense:512";

TEST(PolicyKinds, AnImageGoesThroughTheNatureCnnAndNothingElse) {
  for (const char* policy : {"auto", "CnnPolicy"}) {
    for (const char* algorithm : {"ppo", "ppo2", "a2c"}) {
      EXPECT_EQ(BlocksOf(algorithm, Seeing(kImage), {{"policy", policy}, {"n_steps", "8"}}), kCnn + " dense:3 dense:1");
    }
    const Settings dqn = {{"policy", policy}, {"buffer_size", "100"}};
    EXPECT_EQ(BlocksOf("dqn", Seeing(kImage), dqn), kCnn + " dense:3");
    EXPECT_EQ(BlocksOf("dqn", Seeing(kImage), dqn, "sb2"), kCnn + " dense:3 dense:64 dense:64 dense:1 duelling")
        << "the value's tower of Stable Baselines 2";
  }
  EXPECT_EQ(BlocksOf("a2c", Seeing(kImage), {{"net_arch", "[8]"}}), kCnn + " dense:8 dense:3 dense:1");
  EXPECT_EQ(BlocksOf("dqn", Seeing(kImage), {{"net_arch", "[8]"}, {"buffer_size", "100"}}), kCnn + " dense:8 dense:3");
}

TEST(PolicyKinds, MlpPolicyAndSmallImagesAreDense) {
  for (const Settings& settings : {Settings{{"policy", "MlpPolicy"}}, Settings{}}) {
    const BehaviourSpec eye = Seeing(settings.empty() ? kSmallImage : kImage);
    EXPECT_EQ(BlocksOf("a2c", eye, settings), "slice dense:64 dense:64 dense:3 dense:64 dense:64 dense:1");
  }
  EXPECT_EQ(BlocksOf("dqn", Seeing(*Space::Box(-1, 1, {4})), {{"buffer_size", "100"}}), "dense:64 dense:64 dense:3");
}

// Stable Baselines3's MultiInputPolicy: 256 features of each image, everything else beside them, then hidden layers.
TEST(PolicyKinds, ImagesBesideOtherThingsAreJoined) {
  const Space both = *Space::Dict({{"camera", kImage}, {"speed", *Space::Box(-1, 1, {2})}});
  const std::string joined = "slice convolution convolution convolution dense:256 slice concatenation";
  for (const char* policy : {"auto", "MultiInputPolicy"}) {
    EXPECT_EQ(BlocksOf("dqn", Seeing(both), {{"policy", policy}, {"buffer_size", "100"}}),
              joined + " dense:64 dense:64 dense:3");
  }
  EXPECT_EQ(BlocksOf("a2c", Seeing(both), {}), joined + " dense:64 dense:64 dense:3 dense:64 dense:64 dense:1");
}

TEST(PolicyKinds, LayerNormStandsBeforeTheActivation) {
  for (const Settings& settings : {Settings{{"layer_norm", "true"}}, Settings{{"policy", "LnMlpPolicy"}}}) {
    const auto learner = LearnerOf("dqn", Seeing(*Space::Box(-1, 1, {4})), settings);
    ASSERT_TRUE(learner.ok()) << learner.status().message();
    const std::vector<nn::Block> blocks = (*learner)->Snapshot().network.blocks;
    ASSERT_EQ(blocks.size(), 5u);
    EXPECT_EQ(blocks[1].op, "layer_norm");
    EXPECT_EQ(blocks[0].activation, nn::Activation::kLinear);
    EXPECT_EQ(blocks[1].activation, nn::Activation::kRelu);
    EXPECT_EQ(blocks[1].attributes.Number("epsilon"), 1e-12) << "TensorFlow's";
  }
  EXPECT_EQ(BlocksOf("dqn", Seeing(kImage), {{"policy", "LnCnnPolicy"}, {"buffer_size", "100"}}, "sb2"),
            kCnn + " dense:3 dense:64 layer_norm dense:64 layer_norm dense:1 duelling");
}

TEST(PolicyKinds, NormalisedImagesAreNotDividedOnceMore) {
  const auto learner = LearnerOf("a2c", Seeing(kImage), {{"norm_obs", "true"}});
  ASSERT_TRUE(learner.ok()) << learner.status().message();
  const PolicyData model = (*learner)->Snapshot();
  EXPECT_EQ(model.network.blocks[0].op, "slice");
  EXPECT_FALSE(model.network.blocks[0].attributes.contains("divide_by"));
  EXPECT_TRUE(Policy::Create(model, 1).ok());
}

TEST(PolicyKinds, WhatACnnCannotReadIsOneLine) {
  for (const char* algorithm : {"ppo", "a2c", "dqn"}) {
    const std::string small = BlocksOf(algorithm, Seeing(kSmallImage), {{"policy", "CnnPolicy"}});
    EXPECT_NE(small.find("35"), std::string::npos) << small;
    EXPECT_NE(small.find("needs 36 pixels a side"), std::string::npos) << small;
    const std::string none = BlocksOf(algorithm, Seeing(*Space::Box(-1, 1, {4})), {{"policy", "CnnPolicy"}});
    EXPECT_NE(none.find("'eye' observes none"), std::string::npos) << none;
  }
}

// A rollout of images keeps them in the world's own type alone.
TEST(PolicyKinds, ARolloutOfImagesTakesTheirBytesAndLittleElse) {
  const auto bytes = [](const char* normalise) {
    const auto learner = LearnerOf("a2c", Seeing(kImage), {{"norm_obs", normalise}, {"n_steps", "1000"}});
    std::size_t rollout = 0;
    StateWriter writer;
    writer("learner", **learner);
    for (const auto& [name, field] : writer.fields()) {
      if (name.find("slab_features") != std::string::npos) rollout += field.bytes.size();
    }
    return rollout;
  };
  EXPECT_EQ(bytes("false"), 0u);
  EXPECT_EQ(bytes("true"), 1000u * 36 * 40 * 3 * sizeof(float));
}

const Settings kPpoOnImages = {{"n_steps", "64"}, {"batch_size", "64"}, {"n_epochs", "4"}, {"gamma", "0.4"}};
const Settings kA2cOnImages = {{"n_steps", "8"}, {"gamma", "0.4"}, {"learning_rate", "1e-3"}};
const Settings kDqnOnImages = {
    {"buffer_size", "1000"},   {"learning_starts", "64"},       {"gamma", "0.4"},
    {"learning_rate", "1e-3"}, {"exploration_fraction", "0.3"}, {"target_update_interval", "50"}};

Setting OnImages(const char* algorithm) {
  const bool dqn = std::string_view(algorithm) == "dqn", ppo = std::string_view(algorithm) == "ppo";
  return {algorithm, dqn ? kDqnOnImages : ppo ? kPpoOnImages : kA2cOnImages, 1024};
}

/// Trains, then judges the model as the file has it.
double RewardAfter(const Setting& setting, bool channels_first) {
  BrightSide env(4, channels_first);
  const std::unique_ptr<Learner> learner = Make(env, setting);
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  while (learner->steps() < setting.steps) Step(env, *learner, first.batch().slots);
  Result<Policy> made = Policy::Create(learner->Snapshot(), 4);
  EXPECT_TRUE(made.ok()) << made.status().message();
  Result<Policy> policy = Policy::FromBytes(made->ToFile().Serialise(), 4);
  EXPECT_TRUE(policy.ok()) << policy.status().message();
  BatchBuffer buffer(env.spec().behaviours[0]);
  Rng rng(3, 3);
  env.Reset(9, {&buffer.batch(), 1});
  double sum = 0;
  for (int i = 0; i < 50; ++i) {
    buffer.Advance();
    Batch& batch = buffer.batch();
    policy->Act(batch.observations, nullptr, 4, ActionMode::kDeterministic, rng, batch.actions);
    env.Step({&batch, 1});
    for (std::int64_t r = 0; r < 4; ++r) sum += static_cast<double>(batch.rewards[r]);
  }
  return sum / 200;
}

TEST(Images, EveryAlgorithmLearnsFromThem) {
  for (const char* algorithm : {"ppo", "a2c", "dqn"})
    EXPECT_GE(RewardAfter(OnImages(algorithm), false), 0.95) << algorithm;
  EXPECT_GE(RewardAfter(OnImages("dqn"), true), 0.95) << "channels first";
}

TEST(Images, OneSeedIsOneResultForAnyNumberOfThreads) {
  for (const char* algorithm : {"a2c", "dqn"}) {
    std::vector<std::uint64_t> hashes;
    for (int threads : {1, 3}) {
      Setting setting = OnImages(algorithm);
      if (std::string_view(algorithm) == "dqn")
        setting.values.emplace_back("batch_size", "600");
      else
        setting.values.emplace_back("n_steps", "150");
      setting.executor = Threads(threads);
      BrightSide env(4);
      const std::unique_ptr<Learner> learner = Make(env, setting);
      BatchBuffer first(env.spec().behaviours[0]);
      Begin(env, *learner, first);
      while (learner->updates() < 2) Step(env, *learner, first.batch().slots);
      hashes.push_back(HashState(*learner));
    }
    EXPECT_EQ(hashes[0], hashes[1]) << algorithm;
  }
}

TEST(Images, ARestoredLearnerGoesOnToTheSameBits) {
  for (const char* algorithm : {"a2c", "dqn"}) {
    BrightSide env(4), other_env(4);
    const Setting setting = OnImages(algorithm);
    const std::unique_ptr<Learner> learner = Make(env, setting), other = Make(other_env, setting);
    BatchBuffer first(env.spec().behaviours[0]);
    Begin(env, *learner, first);
    for (int i = 0; i < 29; ++i) Step(env, *learner, first.batch().slots);  // within a rollout
    StateWriter writer;
    writer("learner", *learner);
    writer("env", env);
    StateReader reader(writer.fields());
    reader("learner", *other);
    reader("env", other_env);
    ASSERT_TRUE(reader.status().ok()) << reader.status().message();
    for (int i = 0; i < 20; ++i) {
      Step(env, *learner, first.batch().slots);
      Step(other_env, *other, first.batch().slots);
    }
    EXPECT_EQ(HashState(*learner), HashState(*other)) << algorithm;
  }
}

}  // namespace
}  // namespace consac::learn
