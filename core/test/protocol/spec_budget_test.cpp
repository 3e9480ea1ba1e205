// What a SPEC may make a trainer take: memory, time and stack, as docs/faults.md states them ("Budgets").
#include <gtest/gtest.h>

#include <vector>

#include "consac/base/budget.h"
#include "consac/base/hooks.h"
#include "consac/protocol/protocol2.h"

#if !defined(_WIN32)
#include <pthread.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#endif

namespace consac::protocol2 {
namespace {

Status ParsedSpec(const std::string& json) {
  return ParseSpec(std::as_bytes(std::span(json))).status();
}

/// One behaviour whose rows are whatever they have to be, or not.
std::string Behaviour(const std::string& name, const std::string& observation, const std::string& action) {
  return R"({"name":")" + name + R"(","agents":["agent"],"observation":)" + observation + R"(,"action":)" + action +
         R"(,"masks_actions":false,"observation_row":{},"action_row":{}})";
}

std::string SpecWithAll(const std::string& behaviours, int environments = 1) {
  return R"({"id":"x","environments":)" + std::to_string(environments) + R"(,"behaviours":[)" + behaviours + "]}";
}

std::string Behaviours(int count, const std::string& observation, const std::string& action) {
  std::string all;
  for (int i = 0; i < count; ++i) all += (i > 0 ? "," : "") + Behaviour("b" + std::to_string(i), observation, action);
  return all;
}

/// Texts that are small and ask for much.
std::vector<std::string> Greedy() {
  const std::string box = R"({"type":"box","shape":[16777216],"dtype":"U8","low":0,"high":255})";
  const std::string choice = R"({"type":"discrete","n":16777216})", small = R"({"type":"discrete","n":2})";
  const std::string floats = R"({"type":"box","shape":[4],"dtype":"F32","low":0,"high":1})";
  std::string boxes;
  for (int i = 0; i < 200; ++i)
    boxes += (i > 0 ? "," : "") + std::string(R"({"name":")") + std::to_string(1000 + i) + R"(","space":)" + box + "}";
  return {SpecWithAll(Behaviours(1, box, box)), SpecWithAll(Behaviours(100, box, small)),
          SpecWithAll(Behaviours(100, choice, choice)),
          SpecWithAll(Behaviours(1, R"({"type":"dict","spaces":[)" + boxes + "]}", small)),
          SpecWithAll(Behaviours(100, floats, small), 1 << 20)};
}

TEST(MemoryBudget, TakesNothingBeyondWhatIsLeft) {
  MemoryBudget budget(100);
  EXPECT_TRUE(budget.Take("a box", 10, 9).ok());
  EXPECT_EQ(budget.left(), 10u);
  EXPECT_EQ(budget.Take("a box", 11, 1).code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(budget.left(), 10u);
  EXPECT_FALSE(budget.Take("a box", ~std::uint64_t{0}, ~std::uint64_t{0}).ok()) << "without overflow";
  EXPECT_TRUE(budget.Take("nothing", ~std::uint64_t{0}, 0).ok());
  EXPECT_TRUE(budget.Take("a box", 10, 1).ok());
  EXPECT_EQ(budget.left(), 0u);
}

TEST(SpecBudget, IsOneForAllBehaviours) {
  for (const std::string& json : Greedy()) {
    const Status status = ParsedSpec(json);
    EXPECT_EQ(FaultName(status), "MALFORMED") << json.substr(0, 80);
  }
}

/// A SPEC of worlds of four agents with so many parameters; each agent is a group.
std::string SpecWithParameters(int environments, int count) {
  SpecMessage spec;
  spec.env.behaviours.push_back(
      BehaviourSpec::Of("default", *Space::Discrete(2), *Space::Discrete(2), 4 * environments));
  spec.env.behaviours[0].agents = {"a", "b", "c", "d"};
  for (int i = 0; i < count; ++i) spec.env.parameters.push_back({"p" + std::to_string(i), 1.0});
  for (std::size_t agent = 0; agent < 4; ++agent)
    spec.env.groups.push_back({"g" + std::to_string(agent), {{0, agent}}});
  return EncodeSpec(spec);
}

TEST(SpecBudget, CountsWhatAllEnvironmentsHaveOfParametersAndGroups) {
  const auto parse = [](const std::string& json, Agreed agreed) {
    return ParseSpec(std::as_bytes(std::span(json)), agreed).status();
  };
  constexpr Agreed kAll{true, true, true}, kNone{};
  const std::string much = SpecWithParameters(1 << 17, 1000);  // a text of 30 KiB, and 1000 MiB of numbers
  EXPECT_EQ(FaultName(parse(much, kAll)), "MALFORMED");
  EXPECT_NE(parse(much, kAll).message().find("what all environments have of parameters and groups"), std::string::npos)
      << parse(much, kAll).message();
  EXPECT_TRUE(parse(much, kNone).ok()) << "who has not agreed to them holds none: " << parse(much, kNone).message();
  EXPECT_TRUE(parse(SpecWithParameters(1 << 10, 1000), kAll).ok());
  // 57 MiB of parameters, 4 MiB of groups and about 4 MiB of rows: one frame holds any two of them.
  const std::string parameters = SpecWithParameters(1 << 17, 57);
  EXPECT_TRUE(parse(parameters, {.parameters = true}).ok()) << parse(parameters, {.parameters = true}).message();
  EXPECT_TRUE(parse(parameters, {.groups = true}).ok());
  EXPECT_FALSE(parse(parameters, kAll).ok());
}

TEST(SpecBudget, APictureOfACameraFits) {
  SpecMessage spec;
  const Space camera = *Space::Box(0, 255, {1080, 1920, 3}, DType::kU8);
  spec.env.behaviours.push_back(BehaviourSpec::Of("camera", camera, *Space::Discrete(3), 4));
  spec.env.behaviours[0].agents = {"a", "b", "c", "d"};
  EXPECT_TRUE(ParsedSpec(EncodeSpec(spec)).ok()) << ParsedSpec(EncodeSpec(spec)).message();
}

TEST(SpecBudget, ASpacesCopiesShareItsBounds) {
  const Space camera = *Space::Box(0, 255, {1080, 1920, 3}, DType::kU8);
  const Layout layout = Layout::Of(camera);
  EXPECT_EQ(layout.leaves[0].space.low().data(), camera.low().data());
  EXPECT_EQ(camera, *Space::Box(0, 255, {1080, 1920, 3}, DType::kU8));
  EXPECT_NE(camera, *Space::Box(0, 254, {1080, 1920, 3}, DType::kU8));
}

#if defined(__linux__) && !defined(CONSAC_SANITIZED)
/// Bytes of address space that this process has.
std::uint64_t AddressSpace() {
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

TEST(SpecBudget, IsWhatIsReallyTaken) {
  constexpr std::uint64_t kMost = std::uint64_t{256 + 64} << 20;  // the budget, and the JSON's tree
  for (const std::string& json : Greedy()) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const rlim_t limit = AddressSpace() + kMost;
      const rlimit limits{limit, limit};
      if (setrlimit(RLIMIT_AS, &limits) != 0) _exit(2);
      _exit(ParsedSpec(json).ok() ? 3 : 0);  // where memory runs out, it ends by a signal
    }
    int how = 0;
    ASSERT_EQ(waitpid(child, &how, 0), child);
    EXPECT_TRUE(WIFEXITED(how) && WEXITSTATUS(how) == 0) << json.substr(0, 80) << ": " << how;
  }
}
#endif

#if !defined(_WIN32)
/// Runs `body` on a thread with so small a stack.
void OnStackOf(std::size_t bytes, void* (*body)(void*)) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  ASSERT_EQ(pthread_attr_setstacksize(&attributes, bytes), 0);
  pthread_t thread;
  ASSERT_EQ(pthread_create(&thread, &attributes, body, nullptr), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
}

TEST(SpecBudget, TheDeepestJsonNeedsNoMoreThanHalfAMebibyteOfStack) {
  OnStackOf(512 << 10, [](void*) -> void* {
    Space space = *Space::Box(-1, 1, {2});
    for (int i = 0; i < 16; ++i) space = *Space::Tuple({space});
    SpecMessage spec;
    spec.env.behaviours.push_back(BehaviourSpec::Of("deep", space, *Space::Discrete(2), 1));
    EXPECT_TRUE(ParsedSpec(EncodeSpec(spec)).ok());
    std::string path;
    EXPECT_TRUE(CompareBehaviours(BehavioursJson(spec.env), BehavioursJson(spec.env), &path).ok());
    for (const char bracket : {'[', '{'}) {
      const std::string deep(1 << 19, bracket);
      EXPECT_FALSE(ParsedSpec(deep).ok());
      EXPECT_FALSE(ParseConfigure(std::as_bytes(std::span(deep))).ok());
    }
    return nullptr;
  });
}
#endif

TEST(SpecBudget, AMebibyteOfObjectsIsReadInNoTime) {
  std::string objects = R"({"expect":[)";
  while (objects.size() < kLargestJson - 8) objects += "{},";
  objects += "0]}";
  const double start = Now();
  (void)ParseConfigure(std::as_bytes(std::span(objects)));
  EXPECT_FALSE(ParsedSpec(objects).ok());
  EXPECT_LT(Now() - start, 10.0) << "a quadratic reader took 36 s";
}

}  // namespace
}  // namespace consac::protocol2
