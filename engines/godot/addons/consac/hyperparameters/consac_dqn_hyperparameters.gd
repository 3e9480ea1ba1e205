# Written by tools/generate_hyperparameters.py from the program's own table; do not edit.
class_name ConsacDqnHyperparameters
extends ConsacHyperparameters
## Deep Q-learning, as in Stable Baselines3 or, with the preset sb2, 2.10.2.

## Discount per step. (Stable Baselines3, DQN)
@export_range(0.0, 1.0, 1e-8) var gamma: float = 0.99

## The optimiser's step size. (Stable Baselines3, DQN)
@export_range(0.0, 1.0, 1e-8, "or_greater") var learning_rate: float = 1e-4
## [member learning_rate] times the part of the training that is left: 1 at its start, 0 at its
## end.
@export var learning_rate_linear: bool = false

## Share of the training over which epsilon falls. (Stable Baselines3, DQN)
@export_range(0.0, 1.0, 1e-8) var exploration_fraction: float = 0.1

## Epsilon at the start. (Stable Baselines3, DQN)
@export_range(0.0, 1.0, 1e-8) var exploration_initial_eps: float = 1.0

## Epsilon from then on. (Stable Baselines3, DQN)
@export_range(0.0, 1.0, 1e-8) var exploration_final_eps: float = 0.05

## Transitions that are remembered, of all agents together. (Stable Baselines3, DQN)
@export_range(1, 1000000000, 1) var buffer_size: int = 1000000

## Agent steps before the first gradient. (Stable Baselines3, DQN)
@export_range(0, 1000000000, 1) var learning_starts: int = 100

## Transitions of a gradient step. (Stable Baselines3, DQN)
@export_range(1, 1000000, 1) var batch_size: int = 32

## Steps that a target looks ahead. (Stable Baselines3, DQN)
@export_range(1, 1000000, 1) var n_steps: int = 1

## Steps of each agent, or episodes, between rounds of learning. (Stable Baselines3, DQN)
@export_range(1, 1000000000, 1) var train_freq: int = 4

## Share of the target network that an update replaces. (Stable Baselines3, DQN)
@export_range(0.0, 1.0, 1e-8) var tau: float = 1.0

## Whose names the logs have. (CONSAC; the two generations differ here)
@export_enum("sb2", "sb3") var log_keys: String = "sb3"

## A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two
## generations differ here)
@export_enum("bootstrap", "terminal") var truncation: String = "bootstrap"

## What train_freq counts. (Stable Baselines3, DQN)
@export_enum("step", "episode") var train_freq_unit: String = "step"

## Of each round; -1: one for every transition since the last. (Stable Baselines3, DQN)
@export_range(-1, 1000000000, 1) var gradient_steps: int = 1

## Draw by how wrong the values were. (Stable Baselines 2.10.2, DQN)
@export var prioritized_replay: bool = false

## Exponent of the priorities. (Stable Baselines 2.10.2, DQN)
@export_range(0.0, 10.0, 1e-8) var prioritized_replay_alpha: float = 0.6

## Exponent of the weights that make up for it, at the start. (Stable Baselines 2.10.2, DQN)
@export_range(0.0, 1.0, 1e-8) var prioritized_replay_beta0: float = 0.4

## Whether [member prioritized_replay_beta_iters] is set at all.
@export var set_prioritized_replay_beta_iters: bool = false
## Agent steps until that is 1; none: all of the training. (Stable Baselines 2.10.2, DQN)
@export_range(1, 1000000000, 1) var prioritized_replay_beta_iters: int = 1

## Added to every error that becomes a priority. (Stable Baselines 2.10.2, DQN)
@export_range(1e-30, 1.0, 1e-8) var prioritized_replay_eps: float = 1e-6

## How it acts before learning_starts. (CONSAC; the two generations differ here)
@export_enum("random", "epsilon_greedy") var warm_up: String = "random"

## Agent steps between updates of the target network. (Stable Baselines3, DQN)
@export_range(1, 1000000000, 1) var target_update_interval: int = 10000

## Whether [member max_grad_norm] is set at all.
@export var set_max_grad_norm: bool = true
## Gradient norms are clipped to this. (Stable Baselines3, DQN)
@export_range(0.0, 1.0, 1e-8, "or_greater") var max_grad_norm: float = 10.0

## The norm of each tensor's gradient (SB2), or of the whole (SB3). (CONSAC; the two generations
## differ here)
@export_enum("variable", "global") var grad_clip: String = "global"

## Whose form of Adam and of the global clip. (CONSAC; the two generations differ here)
@export_enum("tensorflow", "pytorch") var optimizer: String = "pytorch"

## Adam's epsilon. (CONSAC; the two generations differ here)
@export_range(0.0, 1.0, 1e-8) var adam_epsilon: float = 1e-8

## The network chooses, its target judges. (Stable Baselines 2.10.2, DQN)
@export var double_q: bool = false

## Explore by noise in the parameters, as strong as epsilon would be. (Stable Baselines 2.10.2,
## DQN)
@export var param_noise: bool = false

## Kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the
## observation needs. (Stable Baselines3, DQN)
@export_enum("auto", "MlpPolicy", "CnnPolicy", "MultiInputPolicy", "LnMlpPolicy", "LnCnnPolicy") var policy: String = "auto"

## Widths of hidden layers; auto: [64, 64], behind CnnPolicy none but in the value's tower; with
## dueling they are that tower's there. (Stable Baselines3, DQN)
@export var net_arch: String = "auto"

## Activation of hidden layers. (Stable Baselines3, DQN)
@export_enum("tanh", "relu", "sigmoid", "elu", "leaky_relu", "silu", "softplus", "linear") var activation_fn: String = "relu"

## Q = V + A - mean A, from a tower of these widths for each. (Stable Baselines 2.10.2, DQN)
@export var dueling: bool = false

## Hidden layers are normalised before their activation. (Stable Baselines 2.10.2, DQN)
@export var layer_norm: bool = false

## How weights start. (CONSAC; the two generations differ here)
@export_enum("orthogonal", "xavier", "pytorch") var init: String = "pytorch"

## Draw what is remembered as it was, or also as if other goals had been meant (HER). (Stable
## Baselines3, DQN)
@export_enum("ReplayBuffer", "HerReplayBuffer") var replay_buffer_class: String = "ReplayBuffer"

## HER: transitions drawn with another goal for each with its own. (Stable Baselines3, DQN)
@export_range(0, 1000000, 1) var n_sampled_goal: int = 4

## HER: whose goal, of later in the episode, its end, any of it, any episode. (Stable Baselines3,
## DQN)
@export_enum("future", "final", "episode", "random") var goal_selection_strategy: String = "future"

## HER: goals from before a step and no ends (SB2), or from after it and ends as they were (SB3).
## (CONSAC; the two generations differ here)
@export_enum("sb2", "sb3") var her_form: String = "sb3"

## Normalise observations by their running moments. (Stable Baselines, VecNormalize)
@export var norm_obs: bool = false

## Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize)
@export var norm_reward: bool = false

## Largest normalised observation. (Stable Baselines, VecNormalize)
@export_range(1e-06, 1000000000.0, 1e-8) var clip_obs: float = 10.0

## Largest scaled reward. (Stable Baselines, VecNormalize)
@export_range(0.0, 1.0, 1e-8, "or_greater") var clip_reward: float = 10.0

## Added to variances. (Stable Baselines, VecNormalize)
@export_range(0.0, 1.0, 1e-8) var norm_epsilon: float = 1e-8


func algorithm() -> String:
	return "dqn"


func collect() -> Dictionary:
	return {
		"gamma": var_to_str(gamma),
		"learning_rate": schedule_text(learning_rate, learning_rate_linear),
		"exploration_fraction": var_to_str(exploration_fraction),
		"exploration_initial_eps": var_to_str(exploration_initial_eps),
		"exploration_final_eps": var_to_str(exploration_final_eps),
		"buffer_size": str(buffer_size),
		"learning_starts": str(learning_starts),
		"batch_size": str(batch_size),
		"n_steps": str(n_steps),
		"train_freq": str(train_freq),
		"tau": var_to_str(tau),
		"log_keys": log_keys,
		"truncation": truncation,
		"train_freq_unit": train_freq_unit,
		"gradient_steps": str(gradient_steps),
		"prioritized_replay": "true" if prioritized_replay else "false",
		"prioritized_replay_alpha": var_to_str(prioritized_replay_alpha),
		"prioritized_replay_beta0": var_to_str(prioritized_replay_beta0),
		"prioritized_replay_beta_iters": str(prioritized_replay_beta_iters) if set_prioritized_replay_beta_iters else "none",
		"prioritized_replay_eps": var_to_str(prioritized_replay_eps),
		"warm_up": warm_up,
		"target_update_interval": str(target_update_interval),
		"max_grad_norm": var_to_str(max_grad_norm) if set_max_grad_norm else "none",
		"grad_clip": grad_clip,
		"optimizer": optimizer,
		"adam_epsilon": var_to_str(adam_epsilon),
		"double_q": "true" if double_q else "false",
		"param_noise": "true" if param_noise else "false",
		"policy": policy,
		"net_arch": net_arch,
		"activation_fn": activation_fn,
		"dueling": "true" if dueling else "false",
		"layer_norm": "true" if layer_norm else "false",
		"init": init,
		"replay_buffer_class": replay_buffer_class,
		"n_sampled_goal": str(n_sampled_goal),
		"goal_selection_strategy": goal_selection_strategy,
		"her_form": her_form,
		"norm_obs": "true" if norm_obs else "false",
		"norm_reward": "true" if norm_reward else "false",
		"clip_obs": var_to_str(clip_obs),
		"clip_reward": var_to_str(clip_reward),
		"norm_epsilon": var_to_str(norm_epsilon),
	}
