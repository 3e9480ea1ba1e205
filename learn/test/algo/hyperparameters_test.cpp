// Hyperparameter tables: defaults are legal, values are checked, unknown names find their nearest.
#include "consac/learn/algo/hyperparameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>

#include "consac/learn/algo/learner.h"

namespace consac::learn {
namespace {

TEST(Tables, EveryDefaultIsLegalAndEveryNameIsOnce) {
  for (const Algorithm& algorithm : Algorithms()) {
    std::set<std::string> names;
    HyperparameterSet values(algorithm.hyperparameters);
    for (const Hyperparameter& row : algorithm.hyperparameters) {
      EXPECT_TRUE(names.insert(row.name).second) << row.name;
      EXPECT_TRUE(row.alias[0] == '\0' || names.insert(row.alias).second) << row.alias;
      EXPECT_TRUE(values.Set(row.name, row.default_value).ok()) << row.name;
      EXPECT_FALSE(std::string(row.meaning).empty());
      EXPECT_FALSE(std::string(row.source).empty());
    }
  }
}

// Stable Baselines 2.10.2, PPO2.__init__.
TEST(Tables, Ppo2HasStableBaselinesNamesAndDefaults) {
  const HyperparameterSet values((*FindAlgorithm("ppo2"))->hyperparameters);
  const std::pair<const char*, double> defaults[] = {
      {"gamma", 0.99},        {"n_steps", 128}, {"ent_coef", 0.01},  {"learning_rate", 2.5e-4}, {"vf_coef", 0.5},
      {"max_grad_norm", 0.5}, {"lam", 0.95},    {"nminibatches", 4}, {"noptepochs", 4},         {"cliprange", 0.2}};
  for (const auto& [name, value] : defaults) EXPECT_DOUBLE_EQ(values.Real(name), value) << name;
  EXPECT_TRUE(values.Absent("cliprange_vf"));
  EXPECT_DOUBLE_EQ(values.Real("gae_lambda"), 0.95);
  EXPECT_DOUBLE_EQ(values.Real("clip_range"), 0.2);
  EXPECT_EQ(values.Integer("n_epochs"), 4);
}

TEST(Tables, PpoHasStableBaselines3NamesAndDefaults) {
  const HyperparameterSet values((*FindAlgorithm("ppo"))->hyperparameters);
  const std::pair<const char*, double> defaults[] = {
      {"learning_rate", 3e-4}, {"n_steps", 2048},   {"batch_size", 64}, {"n_epochs", 10}, {"gamma", 0.99},
      {"gae_lambda", 0.95},    {"clip_range", 0.2}, {"ent_coef", 0.0},  {"vf_coef", 0.5}, {"max_grad_norm", 0.5}};
  for (const auto& [name, value] : defaults) EXPECT_DOUBLE_EQ(values.Real(name), value) << name;
  EXPECT_TRUE(values.Absent("clip_range_vf") && values.Absent("target_kl"));
  EXPECT_TRUE(values.Boolean("normalize_advantage"));
}

// What people paste: every argument of the constructors of Stable Baselines 2.10.2 and 3, of their policies and of
// learn.
TEST(Tables, EveryNameOfStableBaselinesIsTakenOrAnswered) {
  const std::string common =
      "policy env verbose tensorboard_log _init_setup_model policy_kwargs full_tensorboard_log seed n_cpu_tf_sess "
      "total_timesteps callback log_interval tb_log_name reset_num_timesteps progress_bar gamma learning_rate device "
      "stats_window_size net_arch layers act_fun activation_fn features_extractor_class features_extractor_kwargs "
      "share_features_extractor normalize_images optimizer_class optimizer_kwargs cnn_extractor feature_extraction "
      "monitor_wrapper ";
  const std::string on_policy = common +
                                "n_steps ent_coef vf_coef max_grad_norm lam gae_lambda use_sde sde_sample_freq "
                                "rollout_buffer_class rollout_buffer_kwargs normalize_advantage ortho_init "
                                "log_std_init full_std use_expln squash_output ";
  const std::string ppo = on_policy +
                          "nminibatches noptepochs cliprange cliprange_vf batch_size n_epochs clip_range "
                          "clip_range_vf target_kl ";
  const std::string replay = common +
                             "buffer_size learning_starts batch_size tau train_freq gradient_steps n_steps "
                             "replay_buffer_class replay_buffer_kwargs optimize_memory_usage layer_norm "
                             "n_sampled_goal goal_selection_strategy model_class copy_info_dict online_sampling "
                             "max_episode_length handle_timeout_termination ";
  const std::string continuous = replay + "action_noise random_exploration n_critics reg_weight ";
  const std::pair<const char*, std::string> constructors[] = {
      {"ppo2", ppo},
      {"ppo", ppo},
      {"a2c", on_policy + "alpha momentum epsilon lr_schedule rms_prop_eps use_rms_prop "},
      {"dqn", replay + "exploration_fraction exploration_final_eps exploration_initial_eps double_q "
                       "target_network_update_freq target_update_interval prioritized_replay "
                       "prioritized_replay_alpha prioritized_replay_beta0 prioritized_replay_beta_iters "
                       "prioritized_replay_eps param_noise max_grad_norm dueling "},
      {"sac", continuous + "ent_coef target_update_interval target_entropy use_sde sde_sample_freq use_sde_at_warmup "
                           "log_std_init use_expln clip_mean "},
      {"td3", continuous + "policy_delay target_policy_noise target_noise_clip "},
      {"ddpg", continuous + "memory_policy eval_env nb_train_steps nb_rollout_steps nb_eval_steps param_noise "
                            "normalize_observations param_noise_adaption_interval normalize_returns enable_popart "
                            "observation_range critic_l2_reg return_range actor_lr critic_lr clip_norm reward_scale "
                            "render render_eval memory_limit "}};
  // The run's own (consac/run/config.h), which has no hyperparameter of that name.
  const std::set<std::string> of_the_run = {"log_interval"};
  for (const auto& [algorithm, names] : constructors) {
    const std::span<const Hyperparameter> table = (*FindAlgorithm(algorithm))->hyperparameters;
    std::istringstream words(names);
    for (std::string name; words >> name;) {
      const bool taken = std::any_of(table.begin(), table.end(),
                                     [&](const Hyperparameter& row) { return row.name == name || row.alias == name; });
      EXPECT_TRUE(taken || of_the_run.count(name) > 0 || !StableBaselinesAnswer(name).empty())
          << algorithm << " " << name;
    }
  }
  HyperparameterSet td3((*FindAlgorithm("td3"))->hyperparameters);
  EXPECT_EQ(td3.Set("use_sde", "true").message(),
            "'use_sde' of Stable Baselines is no hyperparameter here: noise that follows the state is of sac, ppo, "
            "ppo2 and a2c; leave it out");
  EXPECT_EQ(StableBaselinesAnswer("gama"), "");
}

TEST(Values, FormsThatPeopleWrite) {
  HyperparameterSet values((*FindAlgorithm("ppo2"))->hyperparameters);
  EXPECT_TRUE(values.Set("learning_rate", "lin_2.5e-4").ok());
  EXPECT_TRUE(values.AsSchedule("learning_rate").linear);
  EXPECT_DOUBLE_EQ(values.AsSchedule("learning_rate").At(0.5), 1.25e-4);
  EXPECT_TRUE(values.Set("n_steps", "1_024").ok());
  EXPECT_EQ(values.Integer("n_steps"), 1024);
  EXPECT_TRUE(values.Set("n_steps", "1e3").ok());
  EXPECT_TRUE(values.Set("norm_obs", "True").ok());
  EXPECT_TRUE(values.Boolean("norm_obs"));
  EXPECT_TRUE(values.Set("max_grad_norm", "none").ok());
  EXPECT_TRUE(values.Absent("max_grad_norm"));
  EXPECT_TRUE(values.Changed("n_steps"));
  EXPECT_FALSE(values.Changed("gamma"));
}

TEST(Values, BadOnesAreQuotedWithWhatWasExpected) {
  HyperparameterSet values((*FindAlgorithm("ppo2"))->hyperparameters);
  const std::pair<const char*, const char*> cases[] = {
      {"gamma", "1.5"},   {"gamma", "nan"},      {"gamma", "none"},    {"n_steps", "0"},
      {"n_steps", "2.5"}, {"norm_obs", "maybe"}, {"act_fun", "thanh"}, {"learning_rate", "lin_x"}};
  for (const auto& [name, text] : cases) {
    const Status status = values.Set(name, text);
    EXPECT_FALSE(status.ok()) << name << text;
    EXPECT_NE(status.message().find(text), std::string::npos) << status.message();
    EXPECT_NE(status.message().find("expected"), std::string::npos) << status.message();
  }
  for (const char* text : {"yes", "on", "1", "no", "off", "0", "TRUE", "t"})
    EXPECT_NE(values.Set("norm_obs", text).message().find("expected true or false"), std::string::npos) << text;
  EXPECT_NE(values.Set("learnin_rate", "1").message().find("'learning_rate'"), std::string::npos);
  EXPECT_NE(FindAlgorithm("pop2").status().message().find("'ppo2'"), std::string::npos);
}

}  // namespace
}  // namespace consac::learn
