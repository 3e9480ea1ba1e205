#include "consac/run/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "consac/learn/algo/learner.h"
#include "tests/support.h"
#include "yaml_tree.h"

namespace consac::run {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

RunConfig Read(std::string_view text) {
  RunConfig config;
  const Status status = ReadYaml(text, "test.yaml", &config);
  EXPECT_TRUE(status.ok()) << status.message();
  return config;
}

std::string ErrorOf(std::string_view text) {
  RunConfig config;
  const Status status = ReadYaml(text, "test.yaml", &config);
  EXPECT_FALSE(status.ok()) << text;
  EXPECT_EQ(WriteYaml(config), WriteYaml(RunConfig{})) << "a refused text must change nothing: " << text;
  return status.message();
}

std::string SettingError(std::string_view assignment) {
  RunConfig config;
  const Status status = ApplySetting(assignment, &config);
  EXPECT_FALSE(status.ok()) << assignment;
  return status.message();
}

std::string Hyperparameter(const RunConfig& config, std::string_view name) {
  const learn::Algorithm* algorithm = *learn::FindAlgorithm(config.algorithm);
  learn::HyperparameterSet values(algorithm->hyperparameters);
  for (const learn::Hyperparameter& row : values.table())
    EXPECT_TRUE(values.Set(row.name, row.default_value).ok()) << row.name;
  for (const auto& [given, text] : config.hyperparameters) EXPECT_TRUE(values.Set(given, text).ok()) << given;
  return values.Text(name);
}

TEST(Config, ReadsEveryTypeOfField) {
  const RunConfig config = Read(
      "world: tcp://127.0.0.1:5005\n"
      "algorithm: ppo\n"
      "steps: 1_000_000\n"
      "seed: 18\n"
      "envs: 8\n"
      "deadline_s: 2.5e-1\n"
      "table: false\n"
      "answer_done: True\n");
  EXPECT_EQ(config.world, "tcp://127.0.0.1:5005");
  EXPECT_EQ(config.algorithm, "ppo");
  EXPECT_EQ(config.steps, 1000000);
  EXPECT_EQ(config.seed, 18u);
  EXPECT_EQ(config.envs, 8);
  EXPECT_EQ(config.deadline_s, 0.25);
  EXPECT_FALSE(config.table);
  EXPECT_TRUE(config.answer_done);
}

TEST(Config, WholeNumbersMayBeWrittenWithAnExponent) {
  EXPECT_EQ(Read("steps: 1e6").steps, 1000000);
  EXPECT_THAT(ErrorOf("steps: 1.5"), HasSubstr("expected a whole number"));
  EXPECT_THAT(ErrorOf("steps: 1__0"), HasSubstr("expected a whole number"));
  EXPECT_THAT(ErrorOf("steps: _10"), HasSubstr("expected a whole number"));
  EXPECT_THAT(ErrorOf("steps: 0x10"), HasSubstr("expected a whole number"));
  EXPECT_THAT(ErrorOf("steps: 99999999999999999999"), HasSubstr("expected a whole number"));
}

TEST(Config, HyperparametersMayStandBelowTheirNameOrBesideTheFields) {
  const RunConfig nested = Read("hyperparameters:\n  learning_rate: lin_2.5e-4\n  gamma: 0.9\n");
  const RunConfig flat = Read("learning_rate: lin_2.5e-4\ngamma: 0.9\n");
  EXPECT_EQ(WriteYaml(nested), WriteYaml(flat));
  EXPECT_EQ(Hyperparameter(nested, "learning_rate"), "lin_0.00025");
  EXPECT_EQ(Hyperparameter(nested, "gamma"), "0.9");
}

TEST(Config, TheAlgorithmMayStandAfterItsHyperparameters) {
  const RunConfig config = Read("clip_range: 0.1\nhyperparameters: {n_epochs: 3}\nalgorithm: ppo\n");
  EXPECT_EQ(Hyperparameter(config, "clip_range"), "0.1");
  EXPECT_EQ(Hyperparameter(config, "n_epochs"), "3");
}

TEST(Config, TheOtherGenerationsNamesAreAliases) {
  RunConfig config = Read("clip_range: 0.1\n");
  EXPECT_EQ(Hyperparameter(config, "cliprange"), "0.1");
  ASSERT_TRUE(ApplySetting("cliprange=0.3", &config).ok());
  EXPECT_EQ(config.hyperparameters.size(), 1u) << "one parameter has one value, whatever it is called";
  EXPECT_EQ(Hyperparameter(config, "cliprange"), "0.3");
}

TEST(Config, ListsAndMapsReachTheHyperparameterAsWritten) {
  EXPECT_EQ(Hyperparameter(Read("net_arch: [128, {pi: [64], vf: [32, 16]}]\n"), "net_arch"),
            "[128, {pi: [64], vf: [32, 16]}]");
  EXPECT_EQ(Hyperparameter(Read("net_arch: \"[dict(pi=[8], vf=[8])]\"\n"), "net_arch"), "[dict(pi=[8], vf=[8])]");
  EXPECT_EQ(Hyperparameter(Read("target_kl: ~\n"), "target_kl"), "none");
}

TEST(Config, AnUnknownKeyNamesTheNearestOfFieldsAndHyperparameters) {
  EXPECT_EQ(ErrorOf("seed: 1\nstep: 5\n"), "test.yaml:2: unknown key 'step' (did you mean 'steps'?)");
  EXPECT_EQ(ErrorOf("\n\ngama: 0.9\n"), "test.yaml:3: unknown key 'gama' (did you mean 'gamma'?)");
  EXPECT_EQ(ErrorOf("hyperparameters:\n  gamma: 0.9\n  lerning_rate: 1\n"),
            "test.yaml:3: unknown key 'lerning_rate' (did you mean 'learning_rate'?)");
  EXPECT_EQ(ErrorOf("hyperparameter: {gamma: 1}\n"),
            "test.yaml:1: unknown key 'hyperparameter' (did you mean 'hyperparameters'?)");
  EXPECT_THAT(ErrorOf("algorithm: ppo\nnoptepoch: 1\n"), HasSubstr("did you mean 'noptepochs'"));
  EXPECT_THAT(ErrorOf("algorithm: sac\nentropy_target: -1\n"), HasSubstr("did you mean 'target_entropy'"));
  EXPECT_EQ(SettingError("zzzzzzzzzz=4"), "unknown key 'zzzzzzzzzz'; 'consac list hyperparameters ppo2' shows all");
}

TEST(Config, AKeyOfOtherAlgorithmsNamesThem) {
  EXPECT_EQ(
      SettingError("replay_buffer_class=HerReplayBuffer"),
      "algorithm ppo2 has no 'replay_buffer_class'; dqn, sac, td3, ddpg have (--algo NAME, or algorithm: NAME in a "
      "file)");
}

TEST(Config, UnknownWorldsAndAlgorithmsNameTheNearest) {
  EXPECT_EQ(ErrorOf("world: rode-v0\n"), "test.yaml:1: unknown world 'rode-v0' (did you mean 'road-v0'?)");
  EXPECT_EQ(ErrorOf("algorithm: ppo3\n"), "test.yaml:1: unknown algorithm 'ppo3' (did you mean 'ppo2'?)");
  EXPECT_THAT(ErrorOf("world: tcp://host\n"), StartsWith("test.yaml:1: "));
}

TEST(Config, ValuesThatDoNotFitSayWhatWould) {
  EXPECT_EQ(ErrorOf("envs: 0\n"), "test.yaml:1: envs = '0' cannot be used; expected a whole number from 1 to 1000000");
  EXPECT_EQ(ErrorOf("table: yes\n"), "test.yaml:1: table = 'yes' cannot be used; expected true or false");
  EXPECT_EQ(ErrorOf("steps:\n"), "test.yaml:1: steps is nothing; expected a whole number");
  EXPECT_EQ(ErrorOf("steps: [1, 2]\n"), "test.yaml:1: steps is [1, 2]; expected a whole number");
  EXPECT_THAT(ErrorOf("deadline_s: nan\n"), HasSubstr("expected a number"));
  EXPECT_THAT(ErrorOf("seed: -1\n"), HasSubstr("expected a whole number of at least 0"));
  EXPECT_THAT(ErrorOf("eval_every: 1e19\n"), HasSubstr("expected a whole number from 0 to 9000000000000000000"));
  EXPECT_THAT(ErrorOf("norm_obs: yes\n"), HasSubstr("expected true or false"));
  EXPECT_THAT(ErrorOf("gamma: 1.5\n"), AllOf(StartsWith("test.yaml:1: gamma = '1.5'"), HasSubstr("from 0 to 1")));
  EXPECT_THAT(ErrorOf("hyperparameters: 5\n"), HasSubstr("hyperparameters must be"));
  EXPECT_THAT(ErrorOf("- steps\n"), HasSubstr("expected lines of 'key: value'"));
}

TEST(Config, WhatYamlCanDoBeyondPlainValuesIsRefused) {
  EXPECT_EQ(ErrorOf("seed: 1\nseed: 2\n"), "test.yaml:2: key 'seed' stands twice; first on line 1");
  EXPECT_THAT(ErrorOf("net_arch: &a [1]\ngamma: *a\n"), HasSubstr("anchors"));
  EXPECT_THAT(ErrorOf("gamma: !!float 1\n"), HasSubstr("tags"));
  EXPECT_THAT(ErrorOf("seed: 1\n---\nseed: 2\n"), HasSubstr("second document"));
  EXPECT_THAT(ErrorOf("{[1]: 2}\n"), HasSubstr("a key must be a name"));
  EXPECT_THAT(ErrorOf("seed: [1\n"), AllOf(StartsWith("test.yaml:"), HasSubstr("no YAML")));
  EXPECT_THAT(ErrorOf("seed: 1\n\tx: 2\n"), HasSubstr("no YAML"));
}

TEST(Config, SizeAndDepthAreLimited) {
  EXPECT_THAT(ErrorOf(std::string(kMaxYamlBytes + 1, ' ')), HasSubstr("at most"));
  EXPECT_THAT(ErrorOf("net_arch: " + std::string(40, '[') + std::string(40, ']')), HasSubstr("deeper"));
  std::string many = "net_arch: [";
  for (int i = 0; i <= kMaxYamlNodes; ++i) many += "1,";
  EXPECT_THAT(ErrorOf(many + "1]"), HasSubstr("more than"));
}

TEST(Config, AnEmptyTextChangesNothing) {
  for (const char* text : {"", "\n", "# only a comment\n", "---\n", "hyperparameters:\n"}) {
    EXPECT_EQ(WriteYaml(Read(text)), WriteYaml(RunConfig{})) << text;
  }
}

TEST(Config, SettingsAreFieldsOrHyperparameters) {
  RunConfig config;
  ASSERT_TRUE(ApplySetting("envs=4", &config).ok());
  ASSERT_TRUE(ApplySetting("learning_rate=1e-4", &config).ok());
  EXPECT_EQ(config.envs, 4);
  EXPECT_EQ(Hyperparameter(config, "learning_rate"), "1e-04");
  EXPECT_EQ(SettingError("enfs=4"), "unknown key 'enfs' (did you mean 'envs'?)");
  EXPECT_EQ(SettingError("device=cuda"),
            "'device' of Stable Baselines is no hyperparameter here: learning runs on the CPU; leave it out, and give "
            "threads");
  EXPECT_EQ(SettingError("envs"), "setting 'envs' cannot be used; expected key=value");
  EXPECT_THAT(SettingError("=4"), HasSubstr("expected key=value"));
  EXPECT_THAT(SettingError("gamma="), StartsWith("gamma = ''"));
}

TEST(Config, AnotherAlgorithmBeginsWithItsOwnDefaults) {
  RunConfig config = Read("algorithm: ppo2\nn_steps: 64\n");
  ASSERT_TRUE(ApplySetting("algorithm=ppo2", &config).ok());
  EXPECT_EQ(Hyperparameter(config, "n_steps"), "64") << "the same one keeps what was set";
  ASSERT_TRUE(ApplySetting("algorithm=ppo", &config).ok());
  EXPECT_EQ(Hyperparameter(config, "n_steps"), "2048");
  EXPECT_TRUE(config.hyperparameters.empty());
}

TEST(Config, TheHeadingOfHyperparametersIsNoKey) {
  for (const std::string& error :
       {SettingError("hyperparameters=gamma"), ErrorOf("hyperparameters:\n  hyperparameters: 1\n")}) {
    EXPECT_THAT(error, HasSubstr("a heading of the file"));
    EXPECT_EQ(error.find("did you mean"), std::string::npos) << error;
  }
}

TEST(Config, WhatIsWrittenReadsBackTheSame) {
  for (const learn::Algorithm& algorithm : learn::Algorithms()) {
    const auto named = [](std::string_view name) {
      return [name](const learn::Hyperparameter& row) { return row.name == name; };
    };
    if (std::ranges::none_of(algorithm.hyperparameters, named("gamma"))) continue;  // one that another test has added
    RunConfig config;
    config.world = "cartpole-v1";
    config.algorithm = algorithm.name;
    config.steps = 123456789012345;
    config.seed = 5;
    config.deadline_s = 0.1;
    config.progress = false;
    ASSERT_TRUE(ApplySetting("gamma=0.123456789", &config).ok());
    ASSERT_TRUE(ApplySetting("net_arch=[32, {pi: [8], vf: [8]}]", &config).ok());
    const std::string written = WriteYaml(config);
    const RunConfig again = Read(written);
    EXPECT_EQ(WriteYaml(again), written);
    EXPECT_EQ(again.steps, config.steps);
    EXPECT_EQ(again.deadline_s, config.deadline_s);
    for (const learn::Hyperparameter& row : algorithm.hyperparameters) {
      EXPECT_EQ(Hyperparameter(again, row.name), Hyperparameter(config, row.name)) << row.name;
      EXPECT_THAT(written, HasSubstr(std::string("  ") + row.name + ": ")) << "resolved in full";
    }
  }
}

TEST(Config, TextsSurviveQuotesAndControlCharacters) {
  RunConfig config;
  config.algorithm = "of \"no\" table\\\n\x01";
  config.hyperparameters = {{"any", "a # b: c"}};
  const Result<YamlNode> tree = ParseYaml(WriteYaml(config), "written");
  ASSERT_TRUE(tree.ok()) << tree.status().message();
  for (const YamlNode& node : tree->children) {
    if (node.key == "algorithm") {
      EXPECT_EQ(node.text, config.algorithm);
    } else if (node.key == "hyperparameters") {
      EXPECT_EQ(node.children[0].text, "a # b: c");
    }
  }
}

TEST(Config, APresetIsTheOtherDefaultsUnderWhatIsSet) {
  const std::string own = WriteYaml(Read("algorithm: a2c\n"));
  EXPECT_THAT(own, AllOf(HasSubstr("  vf_coef: 0.5"), HasSubstr("  log_keys: \"sb3\"")));
  const std::string other = WriteYaml(Read("ent_coef: 0.5\npreset: sb2\nalgorithm: a2c\n"));
  EXPECT_THAT(other,
              AllOf(HasSubstr("  vf_coef: 0.25"), HasSubstr("  log_keys: \"sb2\""), HasSubstr("  ent_coef: 0.5")));
  EXPECT_EQ(WriteYaml(Read(other)), other) << "what was written starts the same run";
  const std::string of3 = WriteYaml(Read("algorithm: ppo2\npreset: sb3\n"));
  EXPECT_THAT(of3, AllOf(HasSubstr("  batch_size: 64"), HasSubstr("  n_steps: 2048"), HasSubstr("  noptepochs: 10")));
  EXPECT_THAT(ErrorOf("preset: sb4\n"), AllOf(HasSubstr("'sb4'"), HasSubstr("sb2 or sb3")));
}

TEST(Config, FilesThatCannotBeReadSaySo) {
  consac::testing::ScratchFolder scratch("config");
  RunConfig config;
  EXPECT_EQ(ReadYamlFile(scratch.path() + "/none.yaml", &config).code(), StatusCode::kNotFound);
  EXPECT_FALSE(ReadYamlFile(scratch.path(), &config).ok());
  const std::string path = scratch.path() + "/run.yaml";
  std::ofstream(path) << "sed: 1\n";
  EXPECT_EQ(ReadYamlFile(path, &config).message(), path + ":1: unknown key 'sed' (did you mean 'seed'?)");
}

// docs/configuration.md repeats the table of fields; this is what keeps it true.
TEST(Config, TheDocumentListsEveryField) {
  std::ifstream file(std::string(CONSAC_SOURCE_DIR) + "/docs/configuration.md");
  const std::string document((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (const ConfigField& field : ConfigFields()) {
    EXPECT_THAT(document, HasSubstr("| `" + field.name + "` | " + field.type + " | " +
                                    (field.default_value.empty() ? "" : "`" + field.default_value + "`") + " | " +
                                    field.meaning + " |"));
  }
}

}  // namespace
}  // namespace consac::run
