// Names that people bring along from Stable Baselines 2.10.2 and 3 (constructors, policy_kwargs, learn) and that are no
// hyperparameters of the algorithm they are given to: what each is here. Looked up only where the table has no such
// row. Source: the constructors of stable_baselines 2.10.2 and stable_baselines3.
#include "consac/base/text.h"
#include "consac/learn/algo/hyperparameters.h"

namespace consac::learn {
namespace {

struct StableBaselinesName {
  std::string_view name;
  std::string_view answer;  // how the sentence about it goes on
};

constexpr std::string_view kAnswerCpu = "learning runs on the CPU; leave it out, and give threads";
constexpr std::string_view kAnswerThreads = "the run's threads says how many cores learn";
constexpr std::string_view kAnswerSde = "it goes with use_sde, which sac, ppo, ppo2 and a2c have; leave it out";
constexpr std::string_view kAnswerSacSde = "it goes with use_sde in sac; leave it out";
constexpr std::string_view kAnswerRollout = "there is one kind of rollout; leave it out";
constexpr std::string_view kAnswerEvaluation =
    "the run's eval_every, eval_episodes and eval_world say when, how long and where";
constexpr std::string_view kAnswerRender = "nothing is drawn while learning; watch a model with consac play";
constexpr std::string_view kAnswerExtractor =
    "policy says what observations go through: MlpPolicy, CnnPolicy, MultiInputPolicy";

constexpr StableBaselinesName kAnswers[] = {
    {"_init_setup_model", "networks are made with the learner; leave it out"},
    {"action_noise_kwargs", "give noise_std, noise_mean, noise_theta and noise_dt"},
    {"async_eigen_decomp", "it is of acktr; leave it out"},
    {"callback", "the run's checkpoint_every_s, eval_every and stop_reward do what callbacks are mostly for"},
    {"clip_mean", kAnswerSacSde},
    {"cnn_extractor", kAnswerExtractor},
    {"copy_info_dict", "what goals are paid does not depend on an info; leave it out"},
    {"device", kAnswerCpu},
    {"env", "the world is named behind consac train"},
    {"eval_env", kAnswerEvaluation},
    {"feature_extraction", kAnswerExtractor},
    {"features_extractor_class", kAnswerExtractor},
    {"features_extractor_kwargs", kAnswerExtractor},
    {"full_std", kAnswerSde},
    {"full_tensorboard_log", "TensorBoard files have numbers and no histograms; leave it out"},
    {"handle_timeout_termination", "truncation says it: bootstrap or terminal"},
    {"layers", "its name is net_arch"},
    {"max_episode_length", "a world says itself when an episode is cut; leave it out"},
    {"memory_limit", "its name is buffer_size"},
    {"memory_policy", "Stable Baselines ignores it, too; leave it out"},
    {"model_class", "HER goes around the run's algorithm: give that and replay_buffer_class=HerReplayBuffer"},
    {"monitor_wrapper", "episodes are always counted; leave it out"},
    {"n_cpu_tf_sess", kAnswerThreads},
    {"n_critics", "it is of sac, td3 and ddpg; leave it out"},
    {"n_envs", "the run's envs says how many copies of a world there are"},
    {"nb_eval_steps", kAnswerEvaluation},
    {"normalize_images", "bytes of images are always divided by 255; norm_obs normalises everything else"},
    {"nprocs", kAnswerThreads},
    {"num_procs", kAnswerThreads},
    {"online_sampling", "goals are chosen when transitions are drawn; leave it out"},
    {"optimize_memory_usage", "an observation is remembered once anyway; leave it out"},
    {"optimizer_class", "optimizer says whose form of Adam: pytorch or tensorflow"},
    {"optimizer_kwargs", "give adam_epsilon"},
    {"policy_kwargs", "give what is in it by its own name, as net_arch=[64, 64] activation_fn=relu"},
    {"progress_bar", "its name is progress"},
    {"reg_weight", "Stable Baselines does not use it, either; leave it out"},
    {"render", kAnswerRender},
    {"render_eval", kAnswerRender},
    {"replay_buffer_kwargs", "give what is in it by its own name: n_sampled_goal, goal_selection_strategy"},
    {"reset_num_timesteps", "a run that goes on is given --resume"},
    {"rollout_buffer_class", kAnswerRollout},
    {"rollout_buffer_kwargs", kAnswerRollout},
    {"sde_net_arch", "noise is a function of the policy's last hidden layer; leave it out"},
    {"sde_sample_freq", kAnswerSde},
    {"seed", "it is the run's own, beside the hyperparameters"},
    {"share_features_extractor",
     "behind images ppo and a2c share one CNN, in sac, td3 and ddpg the actor has its own; "
     "leave it out"},
    {"squash_output", "it goes with use_sde in ppo, ppo2 and a2c, and sac always does so; leave it out"},
    {"stats_window_size", "logs are of the latest 100 episodes; leave it out"},
    {"tb_log_name", "TensorBoard files are in the run's folder, whose name is the run's"},
    {"tensorboard_log", "the run's tensorboard says whether; the files are in its folder"},
    {"total_timesteps", "the run's steps says how long it trains"},
    {"use_expln", kAnswerSde},
    {"use_sde", "noise that follows the state is of sac, ppo, ppo2 and a2c; leave it out"},
    {"use_sde_at_warmup", kAnswerSacSde},
    {"verbose", "the run's table and progress say what is printed"},
};

}  // namespace

std::string StableBaselinesAnswer(std::string_view name) {
  for (const StableBaselinesName& row : kAnswers) {
    if (row.name == name)
      return Quote(name) + " of Stable Baselines is no hyperparameter here: " + std::string(row.answer);
  }
  return "";
}

}  // namespace consac::learn
