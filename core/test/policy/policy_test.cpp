// The acting model: from file to the same actions; refused when it does not reproduce itself or does not fit.
#include "consac/policy/policy.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "consac/nn/kernels.h"
#include "consac/nn/net_arch.h"

namespace consac {
namespace {

PolicyData SmallPolicy(const Space& observation, const Space& action, std::uint64_t seed) {
  PolicyData data;
  data.observation_space = observation;
  data.action_space = action;
  nn::ActorCriticOptions options;
  options.arch = {{}, {16, 8}, {4}};
  options.observation_size = observation.flat_size();
  const ActionHead head = *ActionHead::Create(Layout::Of(action));
  options.action_size = head.size();
  options.policy_gain = 1.0f;
  data.network = nn::ActorCritic(options);
  const auto network = nn::Network::Create(data.network);
  data.parameters.resize(static_cast<std::size_t>(network->parameter_count()));
  Rng rng(seed, 1);
  network->Initialise(rng, data.parameters);
  data.log_std.assign(static_cast<std::size_t>(head.log_std_size()), -0.5f);
  return data;
}

Space DictSpace() {
  return *Space::Dict({{"rays", *Space::Box(0, 1, {3})}, {"gear", *Space::Discrete(4)}});
}

TEST(Policy, FileAndMemoryGiveTheSameActions) {
  for (const Space& action :
       {*Space::Discrete(3), *Space::Box(-1, 1, {2}), *Space::MultiDiscrete({2, 3}), *Space::MultiBinary(3)}) {
    PolicyData data = SmallPolicy(DictSpace(), action, 3);
    RunningMoments moments(data.observation_space.flat_size());
    moments.mean[0] = 0.3;
    moments.variance[1] = 4;
    data.normaliser = ObservationNormaliser::Of(moments, 1e-8, 10);
    auto original = Policy::Create(data, 4);
    ASSERT_TRUE(original.ok()) << original.status().message();
    const std::string path =
        (std::filesystem::temp_directory_path() / ("consac_policy_test_" + std::to_string(getpid()) + ".consac"))
            .string();
    ASSERT_TRUE(original->ToFile(7).Save(path).ok());
    auto loaded = Policy::Load(path, 4);
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    const Layout& layout = original->observation_layout();
    std::vector<std::byte> rows(4 * layout.row_bytes), a(4 * original->action_layout().row_bytes), b(a.size());
    Rng sample(5, 5);
    for (int r = 0; r < 4; ++r) SampleRow(layout, sample, rows.data() + static_cast<std::size_t>(r) * layout.row_bytes);
    for (const ActionMode mode : {ActionMode::kDeterministic, ActionMode::kSample}) {
      Rng first(1, 1), second(1, 1);
      original->Act(rows.data(), nullptr, 4, mode, first, a.data());
      loaded->Act(rows.data(), nullptr, 4, mode, second, b.data());
      EXPECT_EQ(a, b);
    }
    std::filesystem::remove(path);
  }
}

// One row alone gives the same bits as the same row among others.
TEST(Policy, ARowDoesNotDependOnItsNeighbours) {
  auto policy = Policy::Create(SmallPolicy(*Space::Box(-1, 1, {5}), *Space::Discrete(3), 3), 64);
  ASSERT_TRUE(policy.ok());
  std::vector<float> rows(64 * 5);
  Rng rng(1, 1);
  for (float& value : rows) value = rng.Normal();
  std::vector<std::int32_t> actions(64);
  policy->Act(reinterpret_cast<std::byte*>(rows.data()), nullptr, 64, ActionMode::kDeterministic, rng,
              reinterpret_cast<std::byte*>(actions.data()));
  const std::vector<float> together(policy->head().begin(), policy->head().end());
  for (int r = 0; r < 64; ++r) {
    policy->Act(reinterpret_cast<std::byte*>(rows.data() + r * 5), nullptr, 1, ActionMode::kDeterministic, rng,
                reinterpret_cast<std::byte*>(actions.data()));
    ASSERT_EQ(std::memcmp(policy->head().data(), together.data() + r * 3, 3 * sizeof(float)), 0) << r;
  }
}

TEST(Policy, AWrongSelfTestIsRefused) {
  auto policy = Policy::Create(SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Discrete(3), 3), 1);
  ModelFile file = policy->ToFile();
  Tensor& answers = file.tensors.find("test/0/out")->second;
  float changed = answers.floats()[4] + 0.01f;
  std::memcpy(answers.bytes.data() + 4 * sizeof(float), &changed, sizeof(changed));
  const auto loaded = Policy::FromBytes(file.Serialise());
  EXPECT_EQ(loaded.status().code(), StatusCode::kDataLoss);
  EXPECT_NE(loaded.status().message().find("self-test"), std::string::npos);
}

// Statistics at the edge of float32: what is saved is finite throughout, as every reader demands.
TEST(Policy, ModelsOfEnormousObservationsHaveFiniteSelfTests) {
  PolicyData data = SmallPolicy(*Space::Box(-3e38, 3e38, {2}), *Space::Discrete(3), 3);
  RunningMoments moments(2);
  moments.mean = {3e38, -3e38};
  moments.variance = {1e77, 1e77};
  data.normaliser = ObservationNormaliser::Of(moments, 1e-8, 10);
  auto policy = Policy::Create(data, 1);
  ASSERT_TRUE(policy.ok()) << policy.status().message();
  ModelFile file = policy->ToFile();
  for (const auto& [name, tensor] : file.tensors) {
    for (const float number : tensor.floats()) ASSERT_TRUE(std::isfinite(number)) << name;
  }
  EXPECT_TRUE(Policy::FromBytes(file.Serialise()).ok());
  const float infinity = std::numeric_limits<float>::infinity();
  std::memcpy(file.tensors.find("test/0/in")->second.bytes.data(), &infinity, sizeof(infinity));
  const Status status = Policy::FromBytes(file.Serialise()).status();
  EXPECT_EQ(status.code(), StatusCode::kDataLoss);
  EXPECT_NE(status.message().find("infinity"), std::string::npos) << status.message();
}

// Another machine has another instruction set; the model must pass its self-test there. Rectifiers and wide bounds
// are the hard case: large terms that nearly cancel.
TEST(Policy, EveryInstructionSetAcceptsWhatAnotherSaved) {
  const Space wide = *Space::Box(-1e6, 1e6, {12});
  for (const bool normalised : {false, true}) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      PolicyData data = SmallPolicy(wide, *Space::Box(-1, 1, {3}), seed);
      for (nn::Block& block : data.network.blocks) {
        if (block.activation == nn::Activation::kTanh) block.activation = nn::Activation::kRelu;
      }
      if (normalised) {
        RunningMoments moments(12);
        Rng rng(seed, 2);
        for (double& mean : moments.mean) mean = 1e4 * rng.Normal();
        for (double& variance : moments.variance) variance = 1e6;
        data.normaliser = ObservationNormaliser::Of(moments, 1e-8, 10);
      }
      for (const std::string_view saver : nn::InstructionSets()) {
        ASSERT_TRUE(nn::UseInstructionSet(saver));
        const auto policy = Policy::Create(data, 1);
        const auto bytes = policy->ToFile(seed).Serialise();
        for (const std::string_view reader : nn::InstructionSets()) {
          ASSERT_TRUE(nn::UseInstructionSet(reader));
          const auto loaded = Policy::FromBytes(bytes);
          EXPECT_TRUE(loaded.ok()) << saver << " to " << reader << ": " << loaded.status().message();
        }
      }
    }
  }
  ASSERT_TRUE(nn::UseInstructionSet(nn::InstructionSets().front()));
}

TEST(Policy, AMissingTensorAndAnUnknownFeatureAreNamed) {
  auto policy = Policy::Create(SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Discrete(3), 3), 1);
  ModelFile file = policy->ToFile();
  file.tensors.erase(file.tensors.find("pi/0/w"));
  EXPECT_NE(Policy::FromFile(file).status().message().find("'pi/0/w'"), std::string::npos);
  file = policy->ToFile();
  const std::size_t at = file.spec_json.find("\"categorical\"");
  file.spec_json.replace(file.spec_json.rfind("\"dense\""), 7, "\"lstm9\"");
  EXPECT_FALSE(Policy::FromFile(file).ok());
  EXPECT_NE(at, std::string::npos);
}

TEST(Policy, AnotherInterfaceIsNamedByItsPath) {
  auto policy = Policy::Create(SmallPolicy(DictSpace(), *Space::Discrete(3), 3), 1);
  const Space other = *Space::Dict({{"rays", *Space::Box(0, 1, {3})}, {"gear", *Space::Discrete(5)}});
  const Status status = policy->Fits(BehaviourSpec::Of("default", other, *Space::Discrete(3), 1));
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("'gear'"), std::string::npos);
  EXPECT_NE(status.message().find("Discrete(5)"), std::string::npos);
  EXPECT_TRUE(policy->Fits(BehaviourSpec::Of("default", DictSpace(), *Space::Discrete(3), 1)).ok());
}

TEST(Policy, WhatDoesNotFitTogetherIsRefused) {
  PolicyData data = SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Discrete(3), 3);
  data.parameters.pop_back();
  EXPECT_FALSE(Policy::Create(data, 1).ok());
  data = SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Discrete(3), 3);
  data.parameters[0] = std::nanf("");
  EXPECT_EQ(Policy::Create(data, 1).status().code(), StatusCode::kNonFinite);
  data = SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Discrete(3), 3);
  data.action_space = *Space::Discrete(4);
  EXPECT_FALSE(Policy::Create(data, 1).ok());
  data = SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Box(-1, 1, {2}), 3);
  data.log_std[1] = std::nanf("");
  EXPECT_EQ(Policy::Create(data, 1).status().code(), StatusCode::kNonFinite);
  data = SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Discrete(3), 3);
  data.normaliser = ObservationNormaliser::Of(RunningMoments(2), 1e-8, -1);
  EXPECT_EQ(Policy::Create(data, 1).status().code(), StatusCode::kInvalidArgument);
}

PolicyData QPolicy(bool duelling, std::uint64_t seed) {
  PolicyData data;
  data.observation_space = *Space::Box(-1, 1, {3});
  data.action_space = *Space::Discrete(4, 10);
  nn::QNetworkOptions options;
  options.layers = {16};
  options.duelling = duelling;
  options.observation_size = 3;
  options.action_count = 4;
  data.network = nn::QNetwork(options);
  data.heads = {{"", "q_values"}};
  const auto network = nn::Network::Create(data.network);
  data.parameters.resize(static_cast<std::size_t>(network->parameter_count()));
  Rng rng(seed, 1);
  network->Initialise(rng, data.parameters);
  return data;
}

// Of values the best legal one is taken, in either mode and without a draw; the file says which head it is.
TEST(Policy, QValuesTakeTheBestLegalAction) {
  for (const bool duelling : {false, true}) {
    auto original = Policy::Create(QPolicy(duelling, 3), 1);
    ASSERT_TRUE(original.ok()) << original.status().message();
    auto loaded = Policy::FromBytes(original->ToFile(7).Serialise());
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    EXPECT_EQ(loaded->data().heads, (std::vector<HeadSpec>{{"", "q_values"}}));
    EXPECT_EQ(loaded->data().network.blocks.back().inputs, original->data().network.blocks.back().inputs);
    Rng rng(5, 5);
    for (int i = 0; i < 50; ++i) {
      const float row[] = {rng.Normal(), rng.Normal(), rng.Normal()};
      std::uint8_t mask[] = {1, 1, 1, 1};
      std::int32_t best = 0, taken = 0;
      const auto act = [&](Policy& policy, ActionMode mode) {
        Rng unused(1, 1), same(1, 1);
        policy.Act(reinterpret_cast<const std::byte*>(row), mask, 1, mode, unused,
                   reinterpret_cast<std::byte*>(&taken));
        EXPECT_EQ(unused.Uniform(), same.Uniform());
        return taken;
      };
      best = act(*original, ActionMode::kDeterministic);
      for (std::size_t a = 0; a < 4; ++a)
        EXPECT_LE(original->head()[a], original->head()[static_cast<std::size_t>(best - 10)]);
      EXPECT_EQ(act(*loaded, ActionMode::kSample), best);
      mask[best - 10] = 0;
      EXPECT_NE(act(*loaded, ActionMode::kDeterministic), best);
    }
  }
}

TEST(Policy, HeadsThatDoNotFitAreNamed) {
  PolicyData data = QPolicy(false, 3);
  data.heads = {{"", "q_value"}};
  EXPECT_NE(Policy::Create(data, 1).status().message().find("did you mean 'q_values'"), std::string::npos);
  data.heads = {{"", "gaussian"}};
  EXPECT_NE(Policy::Create(data, 1).status().message().find("cannot have the head 'gaussian'"), std::string::npos);
  data.heads = {{"wheel", "q_values"}};
  EXPECT_NE(Policy::Create(data, 1).status().message().find("'wheel'"), std::string::npos);
  data.heads = {{"", "q_values"}, {"", "q_values"}};
  EXPECT_NE(Policy::Create(data, 1).status().message().find("2 heads"), std::string::npos);
}

// A file keeps what a block has, whether this program knows it or not; one without heads has the default ones.
TEST(Policy, AttributesSurviveTheFileAndHeadsMayBeMissing) {
  PolicyData data = SmallPolicy(*Space::Box(-1, 1, {2}), *Space::Discrete(3), 3);
  data.network.blocks[0].attributes.SetJson("of_tomorrow", R"({"deep":[1,2.5,null,"x"]})");
  const auto original = Policy::Create(data, 1);
  ModelFile file = original->ToFile(1);
  const std::string heads = R"("heads":[{"leaf":"","type":"categorical"}],)";
  const std::size_t at = file.spec_json.find(heads);
  ASSERT_NE(at, std::string::npos) << file.spec_json;
  file.spec_json.erase(at, heads.size());
  const auto loaded = Policy::FromBytes(file.Serialise());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->data().network.blocks[0].attributes.json().find("of_tomorrow")->second,
            R"({"deep":[1,2.5,null,"x"]})");
  EXPECT_EQ(loaded->data().heads, original->data().heads);
}

}  // namespace
}  // namespace consac
