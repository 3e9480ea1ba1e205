# Written by tools/generate_hyperparameters.py from the program's own table; do not edit.
class_name ConsacSacHyperparameters
extends ConsacHyperparameters
## Soft actor-critic for Box actions, as in Stable Baselines3 or, with the preset sb2, 2.10.2.

## The optimiser's step size. (Stable Baselines3, SAC)
@export_range(0.0, 1.0, 1e-8, "or_greater") var learning_rate: float = 3e-4
## [member learning_rate] times the part of the training that is left: 1 at its start, 0 at its
## end.
@export var learning_rate_linear: bool = false

## Transitions of a gradient step. (Stable Baselines3, SAC)
@export_range(1, 1000000, 1) var batch_size: int = 256

## Steps of each agent, or episodes, between rounds of learning. (Stable Baselines3, SAC)
@export_range(1, 1000000000, 1) var train_freq: int = 1

## Of each round; -1: one for every transition since the last. (Stable Baselines3, SAC)
@export_range(-1, 1000000000, 1) var gradient_steps: int = 1

## Discount per step. (Stable Baselines3, SAC)
@export_range(0.0, 1.0, 1e-8) var gamma: float = 0.99

## Transitions that are remembered, of all agents together. (Stable Baselines3, SAC)
@export_range(1, 1000000000, 1) var buffer_size: int = 1000000

## Agent steps before the first gradient. (Stable Baselines3, SAC)
@export_range(0, 1000000000, 1) var learning_starts: int = 100

## Steps that a target looks ahead. (Stable Baselines3, SAC)
@export_range(1, 1000000, 1) var n_steps: int = 1

## What train_freq counts. (Stable Baselines3, SAC)
@export_enum("step", "episode") var train_freq_unit: String = "step"

## A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two
## generations differ here)
@export_enum("bootstrap", "terminal") var truncation: String = "bootstrap"

## Share of the target network that an update replaces. (Stable Baselines3, SAC)
@export_range(0.0, 1.0, 1e-8) var tau: float = 0.005

## Whose names the logs have. (CONSAC; the two generations differ here)
@export_enum("sb2", "sb3") var log_keys: String = "sb3"

## Weight of the entropy; auto learns it from 1, auto_0.1 from 0.1. (Stable Baselines3, SAC)
@export var ent_coef: String = "auto"

## The entropy that a learned ent_coef aims at; auto: minus the action's elements. (Stable
## Baselines3, SAC)
@export var target_entropy: String = "auto"

## Gradient steps between updates of the target network. (Stable Baselines3, SAC)
@export_range(1, 1000000000, 1) var target_update_interval: int = 1

## Targets from a network of the state's value (SB2), or from target critics (SB3). (CONSAC; the
## two generations differ here)
@export var value_network: bool = false

## Box actions explore by noise that is a function of the state (gSDE). (Stable Baselines3, SAC)
@export var use_sde: bool = false

## With gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone.
## (Stable Baselines3, SAC)
@export_range(-1, 1000000000, 1) var sde_sample_freq: int = -1

## With gSDE: a deviation for each feature and element of the action; false: for each feature.
## (Stable Baselines3, SAC)
@export var full_std: bool = true

## With gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x). (Stable Baselines3,
## SAC)
@export var use_expln: bool = false

## With gSDE: the policy acts before learning_starts, too, in place of uniform actions. (Stable
## Baselines3, SAC)
@export var use_sde_at_warmup: bool = false

## With gSDE: starting log standard deviation. (Stable Baselines3, SAC)
@export_range(-20.0, 20.0, 1e-8) var log_std_init: float = -3.0

## With gSDE: means are brought within plus and minus this, before tanh; 0: as they are. (Stable
## Baselines3, SAC)
@export_range(0.0, 1000000.0, 1e-8) var clip_mean: float = 2.0

## Noise that is added to actions while learning. (Stable Baselines3, SAC)
@export_enum("none", "normal", "ornstein_uhlenbeck") var action_noise: String = "none"

## Its deviation, where actions go from -1 to 1. (Stable Baselines3, SAC)
@export_range(0.0, 1000000.0, 1e-8) var noise_std: float = 0.1

## Its mean, or what it is drawn back to. (Stable Baselines3, SAC)
@export_range(-1000000.0, 1000000.0, 1e-8) var noise_mean: float = 0.0

## Ornstein_uhlenbeck: how strongly it is drawn back. (Stable Baselines3, SAC)
@export_range(0.0, 1000000.0, 1e-8) var noise_theta: float = 0.15

## Ornstein_uhlenbeck: time of a step. (Stable Baselines3, SAC)
@export_range(0.0, 1000000.0, 1e-8) var noise_dt: float = 0.01

## Probability of a uniform action. (Stable Baselines 2.10.2, SAC)
@export_range(0.0, 1.0, 1e-8) var random_exploration: float = 0.0

## Whose form of Adam. (CONSAC; the two generations differ here)
@export_enum("tensorflow", "pytorch") var optimizer: String = "pytorch"

## Adam's epsilon. (CONSAC; the two generations differ here)
@export_range(0.0, 1.0, 1e-8) var adam_epsilon: float = 1e-8

## Kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the
## observation needs. (Stable Baselines3, SAC)
@export_enum("auto", "MlpPolicy", "CnnPolicy", "MultiInputPolicy", "LnMlpPolicy", "LnCnnPolicy") var policy: String = "auto"

## Widths of hidden layers of actor and critics, or dict(pi=[...], qf=[...]). (Stable Baselines3,
## SAC)
@export var net_arch: String = "[256, 256]"

## Activation of hidden layers. (Stable Baselines3, SAC)
@export_enum("tanh", "relu", "sigmoid", "elu", "leaky_relu", "silu", "softplus", "linear") var activation_fn: String = "relu"

## Hidden layers are normalised before their activation. (Stable Baselines 2.10.2, SAC)
@export var layer_norm: bool = false

## How weights start. (CONSAC; the two generations differ here)
@export_enum("orthogonal", "xavier", "pytorch") var init: String = "pytorch"

## Critics; targets take the least of what theirs say. (Stable Baselines3, SAC)
@export_range(1, 10, 1) var n_critics: int = 2

## Draw what is remembered as it was, or also as if other goals had been meant (HER). (Stable
## Baselines3, SAC)
@export_enum("ReplayBuffer", "HerReplayBuffer") var replay_buffer_class: String = "ReplayBuffer"

## HER: transitions drawn with another goal for each with its own. (Stable Baselines3, SAC)
@export_range(0, 1000000, 1) var n_sampled_goal: int = 4

## HER: whose goal, of later in the episode, its end, any of it, any episode. (Stable Baselines3,
## SAC)
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
	return "sac"


func collect() -> Dictionary:
	return {
		"learning_rate": schedule_text(learning_rate, learning_rate_linear),
		"batch_size": str(batch_size),
		"train_freq": str(train_freq),
		"gradient_steps": str(gradient_steps),
		"gamma": var_to_str(gamma),
		"buffer_size": str(buffer_size),
		"learning_starts": str(learning_starts),
		"n_steps": str(n_steps),
		"train_freq_unit": train_freq_unit,
		"truncation": truncation,
		"tau": var_to_str(tau),
		"log_keys": log_keys,
		"ent_coef": ent_coef,
		"target_entropy": target_entropy,
		"target_update_interval": str(target_update_interval),
		"value_network": "true" if value_network else "false",
		"use_sde": "true" if use_sde else "false",
		"sde_sample_freq": str(sde_sample_freq),
		"full_std": "true" if full_std else "false",
		"use_expln": "true" if use_expln else "false",
		"use_sde_at_warmup": "true" if use_sde_at_warmup else "false",
		"log_std_init": var_to_str(log_std_init),
		"clip_mean": var_to_str(clip_mean),
		"action_noise": action_noise,
		"noise_std": var_to_str(noise_std),
		"noise_mean": var_to_str(noise_mean),
		"noise_theta": var_to_str(noise_theta),
		"noise_dt": var_to_str(noise_dt),
		"random_exploration": var_to_str(random_exploration),
		"optimizer": optimizer,
		"adam_epsilon": var_to_str(adam_epsilon),
		"policy": policy,
		"net_arch": net_arch,
		"activation_fn": activation_fn,
		"layer_norm": "true" if layer_norm else "false",
		"init": init,
		"n_critics": str(n_critics),
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
