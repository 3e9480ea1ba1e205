// Model files that are small and ask for much: nested, of many blocks, of many outputs.
#include <gtest/gtest.h>

#include "consac/base/hooks.h"
#include "consac/policy/policy.h"

#if !defined(_WIN32)
#include <pthread.h>
#endif

namespace consac {
namespace {

std::string NestedLists(int depth) {
  return std::string(static_cast<std::size_t>(depth), '[') + std::string(static_cast<std::size_t>(depth), ']');
}

Status LoadedFrom(const std::string& spec) {
  ModelFile file;
  file.spec_json = spec;
  const Result<ModelFile> written = ModelFile::Parse(file.Serialise());
  return written.ok() ? Policy::FromFile(*written).status() : written.status();
}

void* LoadNested(void*) {
  for (const char* member : {"training", "requires", "interface", "graph", "selftest"}) {
    for (const int depth : {64, 6000, 120000}) {
      const Status status =
          LoadedFrom(R"({"kind":"policy",")" + std::string(member) + "\":" + NestedLists(depth) + "}");
      EXPECT_EQ(status.code(), StatusCode::kDataLoss) << member << " " << depth;
      EXPECT_NE(status.message().find("nested"), std::string::npos) << status.message();
    }
  }
  return nullptr;
}

TEST(HostileModel, NestedSpecificationsAreRefusedOnASmallStack) {
#if defined(_WIN32)
  LoadNested(nullptr);
#else
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  ASSERT_EQ(pthread_attr_setstacksize(&attributes, 512 << 10), 0);
  pthread_t thread;
  ASSERT_EQ(pthread_create(&thread, &attributes, LoadNested, nullptr), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
#endif
}

/// A chain of so many small layers.
nn::NetworkSpec Chain(std::size_t blocks) {
  nn::NetworkSpec spec;
  spec.inputs = {{"x", 1}};
  for (std::size_t i = 0; i < blocks; ++i) {
    spec.blocks.push_back({.inputs = {i == 0 ? "x" : "v" + std::to_string(i - 1)},
                           .output = "v" + std::to_string(i),
                           .name = "layer" + std::to_string(i),
                           .in_size = 1,
                           .out_size = 1});
  }
  spec.outputs = {"v" + std::to_string(blocks - 1)};
  return spec;
}

double SecondsOfChain(std::size_t blocks) {
  const nn::NetworkSpec spec = Chain(blocks);
  const double start = Now();
  const Result<nn::Network> network = nn::Network::Create(spec);
  EXPECT_TRUE(network.ok());
  if (network.ok()) nn::Evaluator(*network, 1);
  return Now() - start;
}

TEST(HostileModel, ManyBlocksTakeLinearTime) {
  double best = 1e9;
  for (int tries = 0; tries < 5 && best >= 9.0; ++tries)
    best = std::min(best, SecondsOfChain(20000) / SecondsOfChain(5000));
  EXPECT_LT(best, 9.0) << "four times the blocks; a search through all for each takes sixteen times";
}

TEST(HostileModel, ManyOutputsAreRefused) {
  nn::NetworkSpec spec = Chain(100);
  for (std::size_t i = 0; i < 63; ++i) spec.outputs.push_back("v" + std::to_string(i));
  EXPECT_TRUE(nn::Network::Create(spec).ok());
  spec.outputs.push_back("v63");
  EXPECT_EQ(nn::Network::Create(spec).status().code(), StatusCode::kInvalidArgument);
}

/// A model of one layer between one number and `width`, and another back.
Status LoadedWithLayerOf(std::int64_t width) {
  PolicyData data;
  data.observation_space = *Space::Box(-1, 1, {1});
  data.action_space = *Space::Discrete(2);
  data.network.inputs = {{"obs", 1}};
  data.network.blocks = {{.inputs = {"obs"}, .output = "wide", .name = "wide", .in_size = 1, .out_size = width},
                         {.inputs = {"wide"}, .output = "pi", .name = "pi", .in_size = width, .out_size = 2}};
  data.network.outputs = {"pi"};
  data.parameters.assign(static_cast<std::size_t>(4 * width + 2), 0.0f);
  const Result<Policy> policy = Policy::Create(std::move(data), 1);
  if (!policy.ok()) return policy.status();
  return Policy::FromBytes(policy->ToFile().Serialise(), 1000).status();
}

// A few bytes a feature in the file, 256 in memory.
TEST(HostileModel, ActivationsHaveABudget) {
  EXPECT_TRUE(LoadedWithLayerOf((1 << 20) - 2).ok()) << LoadedWithLayerOf((1 << 20) - 2).message();
  const Status status = LoadedWithLayerOf(1 << 20);
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(status.message().find("up to 'pi' put out 1048578 features"), std::string::npos) << status.message();
}

TEST(HostileModel, SpacesHaveOneBudget) {
  const std::string box = R"({"type":"box","shape":[16777216],"dtype":"U8","low":0,"high":255})";
  const Status status = LoadedFrom(R"({"kind":"policy","requires":[],"interface":{"behaviour":"b","observation":)" +
                                   box + R"(,"action":)" + box + "}}");
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted) << status.message();
}

}  // namespace
}  // namespace consac
