# Written by tools/generate_hyperparameters.py from the program's own table; do not edit.
class_name ConsacA2cHyperparameters
extends ConsacHyperparameters
## Advantage actor-critic, as in Stable Baselines3 or, with the preset sb2, 2.10.2.

## The optimiser's step size. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8, "or_greater") var learning_rate: float = 7e-4
## [member learning_rate] times the part of the training that is left: 1 at its start, 0 at its
## end.
@export var learning_rate_linear: bool = false

## Steps per world and update; the rollout is n_steps times worlds. (Stable Baselines3, A2C)
@export_range(1, 1000000000, 1) var n_steps: int = 5

## Discount per step. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8) var gamma: float = 0.99

## Decay of generalised advantages; 1 is Monte Carlo, 0 is one step. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8) var gae_lambda: float = 1.0

## Weight of the entropy bonus. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8, "or_greater") var ent_coef: float = 0.0

## Weight of the value loss. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8, "or_greater") var vf_coef: float = 0.5

## Whether [member max_grad_norm] is set at all.
@export var set_max_grad_norm: bool = true
## Global gradient norm is clipped to this. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8, "or_greater") var max_grad_norm: float = 0.5

## Standardise advantages per minibatch. (Stable Baselines3, A2C)
@export var normalize_advantage: bool = false

## A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two
## generations differ here)
@export_enum("bootstrap", "terminal") var truncation: String = "bootstrap"

## Multiplies learning_rate as time passes. (Stable Baselines 2.10.2, A2C)
@export_enum("constant", "linear", "double_linear_con", "middle_drop", "double_middle_drop") var lr_schedule: String = "constant"

## RMSProp; false: Adam. (Stable Baselines3, A2C)
@export var use_rms_prop: bool = true

## Whose form of RMSProp or Adam and of the gradient clip. (CONSAC; the two generations differ
## here)
@export_enum("tensorflow", "pytorch") var optimizer: String = "pytorch"

## Decay of RMSProp's mean square. (Stable Baselines 2.10.2, A2C)
@export_range(0.0, 1.0, 1e-8) var alpha: float = 0.99

## RMSProp's momentum. (Stable Baselines 2.10.2, A2C)
@export_range(0.0, 1.0, 1e-8) var momentum: float = 0.0

## RMSProp's epsilon. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8) var rms_prop_eps: float = 1e-5

## Adam's epsilon. (Stable Baselines3, A2C)
@export_range(0.0, 1.0, 1e-8) var adam_epsilon: float = 1e-5

## Whose names the logs have. (CONSAC; the two generations differ here)
@export_enum("sb2", "sb3") var log_keys: String = "sb3"

## Kind of network: dense layers, convolutions for images, both; auto: what the observation needs.
## (Stable Baselines3, A2C)
@export_enum("auto", "MlpPolicy", "CnnPolicy", "MultiInputPolicy") var policy: String = "auto"

## Layers: shared widths, then dict(pi=[...], vf=[...]); auto: [dict(pi=[64, 64], vf=[64, 64])],
## none behind CnnPolicy. (Stable Baselines3, A2C)
@export var net_arch: String = "auto"

## Activation of hidden layers. (Stable Baselines3, A2C)
@export_enum("tanh", "relu", "sigmoid", "elu", "leaky_relu", "silu", "softplus", "linear") var activation_fn: String = "tanh"

## Orthogonal initial weights; false: PyTorch's uniform. (Stable Baselines3, A2C)
@export var ortho_init: bool = true

## Starting log standard deviation of Box actions. (Stable Baselines3, A2C)
@export_range(-20.0, 20.0, 1e-8) var log_std_init: float = 0.0

## Box actions explore by noise that is a function of the state (gSDE). (Stable Baselines3, A2C)
@export var use_sde: bool = false

## With gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone.
## (Stable Baselines3, A2C)
@export_range(-1, 1000000000, 1) var sde_sample_freq: int = -1

## With gSDE: a deviation for each feature and element of the action; false: for each feature.
## (Stable Baselines3, A2C)
@export var full_std: bool = true

## With gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x). (Stable Baselines3,
## A2C)
@export var use_expln: bool = false

## With gSDE: tanh brings actions into their bounds; false: they are clipped. (Stable Baselines3,
## A2C)
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
	return "a2c"


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
		"lr_schedule": lr_schedule,
		"use_rms_prop": "true" if use_rms_prop else "false",
		"optimizer": optimizer,
		"alpha": var_to_str(alpha),
		"momentum": var_to_str(momentum),
		"rms_prop_eps": var_to_str(rms_prop_eps),
		"adam_epsilon": var_to_str(adam_epsilon),
		"log_keys": log_keys,
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
