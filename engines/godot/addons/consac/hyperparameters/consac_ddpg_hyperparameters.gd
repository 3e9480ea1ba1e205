# Written by tools/generate_hyperparameters.py from the program's own table; do not edit.
class_name ConsacDdpgHyperparameters
extends ConsacHyperparameters
## Deep deterministic policy gradient for Box actions, as in Stable Baselines3 or, with the preset
## sb2, 2.10.2.

## Discount per step. (Stable Baselines3, DDPG)
@export_range(0.0, 1.0, 1e-8) var gamma: float = 0.99

## Transitions that are remembered, of all agents together. (Stable Baselines3, DDPG)
@export_range(1, 1000000000, 1) var buffer_size: int = 1000000

## Agent steps before the first gradient. (Stable Baselines3, DDPG)
@export_range(0, 1000000000, 1) var learning_starts: int = 100

## Steps that a target looks ahead. (Stable Baselines3, DDPG)
@export_range(1, 1000000, 1) var n_steps: int = 1

## What train_freq counts. (Stable Baselines3, DDPG)
@export_enum("step", "episode") var train_freq_unit: String = "step"

## A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two
## generations differ here)
@export_enum("bootstrap", "terminal") var truncation: String = "bootstrap"

## Share of the target network that an update replaces. (Stable Baselines3, DDPG)
@export_range(0.0, 1.0, 1e-8) var tau: float = 0.005

## Whose names the logs have. (CONSAC; the two generations differ here)
@export_enum("sb2", "sb3") var log_keys: String = "sb3"

## Transitions of a gradient step. (Stable Baselines3, DDPG)
@export_range(1, 1000000, 1) var batch_size: int = 256

## Step size of the critic. (Stable Baselines3, DDPG)
@export_range(0.0, 1.0, 1e-8, "or_greater") var learning_rate: float = 1e-3
## [member learning_rate] times the part of the training that is left: 1 at its start, 0 at its
## end.
@export var learning_rate_linear: bool = false

## Whether [member actor_lr] is set at all.
@export var set_actor_lr: bool = false
## Step size of the actor; none: the critic's. (Stable Baselines 2.10.2, DDPG)
@export_range(0.0, 1.0, 1e-8, "or_greater") var actor_lr: float = 0.0
## [member actor_lr] times the part of the training that is left: 1 at its start, 0 at its end.
@export var actor_lr_linear: bool = false

## Steps of each agent, or episodes, between rounds of learning. (Stable Baselines3, DDPG)
@export_range(1, 1000000000, 1) var train_freq: int = 1

## Of each round; -1: one for every transition since the last. (Stable Baselines3, DDPG)
@export_range(-1, 1000000000, 1) var gradient_steps: int = 1

## Whether [member clip_norm] is set at all.
@export var set_clip_norm: bool = false
## The norm of each tensor's gradient is clipped to this. (Stable Baselines 2.10.2, DDPG)
@export_range(0.0, 1.0, 1e-8, "or_greater") var clip_norm: float = 0.0

## Weight of half the squares of the critic's hidden weights. (Stable Baselines 2.10.2, DDPG)
@export_range(0.0, 1.0, 1e-8, "or_greater") var critic_l2_reg: float = 0.0

## Factor of rewards. (Stable Baselines 2.10.2, DDPG)
@export_range(0.0, 1.0, 1e-8, "or_greater") var reward_scale: float = 1.0

## The critic learns values by their running moments; with enable_popart. (Stable Baselines
## 2.10.2, DDPG)
@export var normalize_returns: bool = false

## Those are followed, and the critic's last layer with them. (Stable Baselines 2.10.2, DDPG)
@export var enable_popart: bool = false

## Whether [member return_range] is set at all.
@export var set_return_range: bool = false
## What the critic says and learns is clipped to plus and minus this. (Stable Baselines 2.10.2,
## DDPG)
@export_range(0.0, 1.0, 1e-8, "or_greater") var return_range: float = 0.0

## The actor learns by the critic of before its step (SB2), or of after (SB3). (CONSAC; the two
## generations differ here)
@export_enum("before_critic", "after_critic") var actor_step: String = "after_critic"

## Hidden layers of the critic that read the observation alone. (CONSAC; the two generations
## differ here)
@export_range(0, 64, 1) var action_layer: int = 0

## Whether [member output_bound] is set at all.
@export var set_output_bound: bool = false
## Initial outputs have weights within this; none: as the rest. (CONSAC; the two generations
## differ here)
@export_range(0.0, 1000000.0, 1e-8) var output_bound: float = 0.0

## Explore by noise in the actor's parameters. (Stable Baselines 2.10.2, DDPG)
@export var param_noise: bool = false

## Its deviation at the start. (Stable Baselines 2.10.2, DDPG)
@export_range(1e-30, 1000.0, 1e-8) var param_noise_stddev: float = 0.1

## How far it shall move actions, which go from -1 to 1. (Stable Baselines 2.10.2, DDPG)
@export_range(0.0, 2.0, 1e-8) var desired_action_stddev: float = 0.1

## Factor by which its deviation grows or shrinks. (Stable Baselines 2.10.2, DDPG)
@export_range(1.0, 10.0, 1e-8) var adoption_coefficient: float = 1.01

## Gradient steps between two of those. (Stable Baselines 2.10.2, DDPG)
@export_range(1, 1000000000, 1) var param_noise_adaption_interval: int = 50

## Noise that is added to actions while learning. (Stable Baselines3, DDPG)
@export_enum("none", "normal", "ornstein_uhlenbeck") var action_noise: String = "none"

## Its deviation, where actions go from -1 to 1. (Stable Baselines3, DDPG)
@export_range(0.0, 1000000.0, 1e-8) var noise_std: float = 0.1

## Its mean, or what it is drawn back to. (Stable Baselines3, DDPG)
@export_range(-1000000.0, 1000000.0, 1e-8) var noise_mean: float = 0.0

## Ornstein_uhlenbeck: how strongly it is drawn back. (Stable Baselines3, DDPG)
@export_range(0.0, 1000000.0, 1e-8) var noise_theta: float = 0.15

## Ornstein_uhlenbeck: time of a step. (Stable Baselines3, DDPG)
@export_range(0.0, 1000000.0, 1e-8) var noise_dt: float = 0.01

## Probability of a uniform action. (Stable Baselines 2.10.2, DDPG)
@export_range(0.0, 1.0, 1e-8) var random_exploration: float = 0.0

## Whose form of Adam. (CONSAC; the two generations differ here)
@export_enum("tensorflow", "pytorch") var optimizer: String = "pytorch"

## Adam's epsilon. (CONSAC; the two generations differ here)
@export_range(0.0, 1.0, 1e-8) var adam_epsilon: float = 1e-8

## Kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the
## observation needs. (Stable Baselines3, DDPG)
@export_enum("auto", "MlpPolicy", "CnnPolicy", "MultiInputPolicy", "LnMlpPolicy", "LnCnnPolicy") var policy: String = "auto"

## Widths of hidden layers of actor and critics, or dict(pi=[...], qf=[...]). (Stable Baselines3,
## DDPG)
@export var net_arch: String = "[400, 300]"

## Activation of hidden layers. (Stable Baselines3, DDPG)
@export_enum("tanh", "relu", "sigmoid", "elu", "leaky_relu", "silu", "softplus", "linear") var activation_fn: String = "relu"

## Hidden layers are normalised before their activation. (Stable Baselines 2.10.2, DDPG)
@export var layer_norm: bool = false

## How weights start. (CONSAC; the two generations differ here)
@export_enum("orthogonal", "xavier", "pytorch") var init: String = "pytorch"

## Critics; targets take the least of what theirs say. (Stable Baselines3, DDPG)
@export_range(1, 10, 1) var n_critics: int = 1

## Draw what is remembered as it was, or also as if other goals had been meant (HER). (Stable
## Baselines3, DDPG)
@export_enum("ReplayBuffer", "HerReplayBuffer") var replay_buffer_class: String = "ReplayBuffer"

## HER: transitions drawn with another goal for each with its own. (Stable Baselines3, DDPG)
@export_range(0, 1000000, 1) var n_sampled_goal: int = 4

## HER: whose goal, of later in the episode, its end, any of it, any episode. (Stable Baselines3,
## DDPG)
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
	return "ddpg"


func collect() -> Dictionary:
	return {
		"gamma": var_to_str(gamma),
		"buffer_size": str(buffer_size),
		"learning_starts": str(learning_starts),
		"n_steps": str(n_steps),
		"train_freq_unit": train_freq_unit,
		"truncation": truncation,
		"tau": var_to_str(tau),
		"log_keys": log_keys,
		"batch_size": str(batch_size),
		"learning_rate": schedule_text(learning_rate, learning_rate_linear),
		"actor_lr": schedule_text(actor_lr, actor_lr_linear) if set_actor_lr else "none",
		"train_freq": str(train_freq),
		"gradient_steps": str(gradient_steps),
		"clip_norm": var_to_str(clip_norm) if set_clip_norm else "none",
		"critic_l2_reg": var_to_str(critic_l2_reg),
		"reward_scale": var_to_str(reward_scale),
		"normalize_returns": "true" if normalize_returns else "false",
		"enable_popart": "true" if enable_popart else "false",
		"return_range": var_to_str(return_range) if set_return_range else "none",
		"actor_step": actor_step,
		"action_layer": str(action_layer),
		"output_bound": var_to_str(output_bound) if set_output_bound else "none",
		"param_noise": "true" if param_noise else "false",
		"param_noise_stddev": var_to_str(param_noise_stddev),
		"desired_action_stddev": var_to_str(desired_action_stddev),
		"adoption_coefficient": var_to_str(adoption_coefficient),
		"param_noise_adaption_interval": str(param_noise_adaption_interval),
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
