# Written by tools/generate_hyperparameters.py from the program's own table; do not edit.
class_name ConsacPpoHyperparameters
extends ConsacHyperparameters
## Proximal policy optimisation as in Stable Baselines3.

## The optimiser's step size. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8, "or_greater") var learning_rate: float = 3e-4
## [member learning_rate] times the part of the training that is left: 1 at its start, 0 at its
## end.
@export var learning_rate_linear: bool = false

## Steps per world and update; the rollout is n_steps times worlds. (Stable Baselines3, PPO)
@export_range(1, 1000000000, 1) var n_steps: int = 2048

## Discount per step. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8) var gamma: float = 0.99

## Decay of generalised advantages; 1 is Monte Carlo, 0 is one step. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8) var gae_lambda: float = 0.95

## Weight of the entropy bonus. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8, "or_greater") var ent_coef: float = 0.0

## Weight of the value loss. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8, "or_greater") var vf_coef: float = 0.5

## Whether [member max_grad_norm] is set at all.
@export var set_max_grad_norm: bool = true
## Global gradient norm is clipped to this. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8, "or_greater") var max_grad_norm: float = 0.5

## Standardise advantages per minibatch. (Stable Baselines3, PPO)
@export var normalize_advantage: bool = true

## A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two
## generations differ here)
@export_enum("bootstrap", "terminal") var truncation: String = "bootstrap"

## Whether [member nminibatches] is set at all.
@export var set_nminibatches: bool = false
## Minibatches per epoch; must divide the rollout; in ppo instead of batch_size. (Stable Baselines
## 2.10.2, PPO2)
@export_range(1, 1000000000, 1) var nminibatches: int = 1

## Rows per minibatch; in ppo2 instead of nminibatches. (Stable Baselines3, PPO)
@export_range(1, 1000000000, 1) var batch_size: int = 64

## Passes over the rollout per update. (Stable Baselines3, PPO)
@export_range(1, 1000000, 1) var n_epochs: int = 10

## How far the probability ratio may move. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8, "or_greater") var clip_range: float = 0.2
## [member clip_range] times the part of the training that is left: 1 at its start, 0 at its end.
@export var clip_range_linear: bool = false

## Whether [member clip_range_vf] is set at all.
@export var set_clip_range_vf: bool = false
## How far the value may move; none: as cliprange (ppo2), no clipping (ppo); negative: no
## clipping. (Stable Baselines3, PPO)
@export var clip_range_vf: float = 0.0
## [member clip_range_vf] times the part of the training that is left: 1 at its start, 0 at its
## end.
@export var clip_range_vf_linear: bool = false

## Whether [member target_kl] is set at all.
@export var set_target_kl: bool = false
## Stop an update's epochs past 1.5 times this divergence. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8, "or_greater") var target_kl: float = 0.0

## Deviation by n (SB2) or n - 1 (SB3). (CONSAC; the two generations differ here)
@export_enum("population", "sample") var advantage_std: String = "sample"

## Half the mean of the larger of both errors, or the mean of one. (CONSAC; the two generations
## differ here)
@export_enum("sb2", "sb3") var value_loss: String = "sb3"

## Whose form of Adam and of the gradient clip. (CONSAC; the two generations differ here)
@export_enum("tensorflow", "pytorch") var optimizer: String = "pytorch"

## Adam's epsilon. (Stable Baselines3, PPO)
@export_range(0.0, 1.0, 1e-8) var adam_epsilon: float = 1e-5

## Kind of network: dense layers, convolutions for images, both; auto: what the observation needs.
## (Stable Baselines3, PPO)
@export_enum("auto", "MlpPolicy", "CnnPolicy", "MultiInputPolicy") var policy: String = "auto"

## Layers: shared widths, then dict(pi=[...], vf=[...]); auto: [dict(pi=[64, 64], vf=[64, 64])],
## none behind CnnPolicy. (Stable Baselines3, PPO)
@export var net_arch: String = "auto"

## Activation of hidden layers. (Stable Baselines3, PPO)
@export_enum("tanh", "relu", "sigmoid", "elu", "leaky_relu", "silu", "softplus", "linear") var activation_fn: String = "tanh"

## Orthogonal initial weights; false: PyTorch's uniform. (Stable Baselines3, PPO)
@export var ortho_init: bool = true

## Starting log standard deviation of Box actions. (Stable Baselines3, PPO)
@export_range(-20.0, 20.0, 1e-8) var log_std_init: float = 0.0

## Box actions explore by noise that is a function of the state (gSDE). (Stable Baselines3, PPO)
@export var use_sde: bool = false

## With gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone.
## (Stable Baselines3, PPO)
@export_range(-1, 1000000000, 1) var sde_sample_freq: int = -1

## With gSDE: a deviation for each feature and element of the action; false: for each feature.
## (Stable Baselines3, PPO)
@export var full_std: bool = true

## With gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x). (Stable Baselines3,
## PPO)
@export var use_expln: bool = false

## With gSDE: tanh brings actions into their bounds; false: they are clipped. (Stable Baselines3,
## PPO)
@export var squash_output: bool = false

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
	return "ppo"


func collect() -> Dictionary:
	return {
		"learning_rate": schedule_text(learning_rate, learning_rate_linear),
		"n_steps": str(n_steps),
		"gamma": var_to_str(gamma),
		"gae_lambda": var_to_str(gae_lambda),
		"ent_coef": var_to_str(ent_coef),
		"vf_coef": var_to_str(vf_coef),
		"max_grad_norm": var_to_str(max_grad_norm) if set_max_grad_norm else "none",
		"normalize_advantage": "true" if normalize_advantage else "false",
		"truncation": truncation,
		"nminibatches": str(nminibatches) if set_nminibatches else "none",
		"batch_size": str(batch_size),
		"n_epochs": str(n_epochs),
		"clip_range": schedule_text(clip_range, clip_range_linear),
		"clip_range_vf": schedule_text(clip_range_vf, clip_range_vf_linear) if set_clip_range_vf else "none",
		"target_kl": var_to_str(target_kl) if set_target_kl else "none",
		"advantage_std": advantage_std,
		"value_loss": value_loss,
		"optimizer": optimizer,
		"adam_epsilon": var_to_str(adam_epsilon),
		"policy": policy,
		"net_arch": net_arch,
		"activation_fn": activation_fn,
		"ortho_init": "true" if ortho_init else "false",
		"log_std_init": var_to_str(log_std_init),
		"use_sde": "true" if use_sde else "false",
		"sde_sample_freq": str(sde_sample_freq),
		"full_std": "true" if full_std else "false",
		"use_expln": "true" if use_expln else "false",
		"squash_output": "true" if squash_output else "false",
		"norm_obs": "true" if norm_obs else "false",
		"norm_reward": "true" if norm_reward else "false",
		"clip_obs": var_to_str(clip_obs),
		"clip_reward": var_to_str(clip_reward),
		"norm_epsilon": var_to_str(norm_epsilon),
	}
