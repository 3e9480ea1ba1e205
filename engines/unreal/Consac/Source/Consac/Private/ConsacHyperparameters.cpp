// Copyright CONSAC authors. MIT License.
// Written by tools/generate_hyperparameters.py from the program's own table; do not edit.

#include "ConsacHyperparameters.h"

namespace
{
FString ConsacTextOf(const FConsacSchedule& Schedule)
{
	return FString::Printf(TEXT("%s%.17g"), Schedule.bLinear ? TEXT("lin_") : TEXT(""), Schedule.Value);
}

FString ConsacTextOf(EConsacTruncation Value)
{
	switch (Value)
	{
	case EConsacTruncation::Bootstrap:
		return TEXT("bootstrap");
	case EConsacTruncation::Terminal:
		return TEXT("terminal");
	}
	return TEXT("bootstrap");
}

FString ConsacTextOf(EConsacAdvantageStd Value)
{
	switch (Value)
	{
	case EConsacAdvantageStd::Population:
		return TEXT("population");
	case EConsacAdvantageStd::Sample:
		return TEXT("sample");
	}
	return TEXT("population");
}

FString ConsacTextOf(EConsacValueLoss Value)
{
	switch (Value)
	{
	case EConsacValueLoss::Sb2:
		return TEXT("sb2");
	case EConsacValueLoss::Sb3:
		return TEXT("sb3");
	}
	return TEXT("sb2");
}

FString ConsacTextOf(EConsacOptimizer Value)
{
	switch (Value)
	{
	case EConsacOptimizer::Tensorflow:
		return TEXT("tensorflow");
	case EConsacOptimizer::Pytorch:
		return TEXT("pytorch");
	}
	return TEXT("tensorflow");
}

FString ConsacTextOf(EConsacPolicy Value)
{
	switch (Value)
	{
	case EConsacPolicy::Auto:
		return TEXT("auto");
	case EConsacPolicy::MlpPolicy:
		return TEXT("MlpPolicy");
	case EConsacPolicy::CnnPolicy:
		return TEXT("CnnPolicy");
	case EConsacPolicy::MultiInputPolicy:
		return TEXT("MultiInputPolicy");
	}
	return TEXT("auto");
}

FString ConsacTextOf(EConsacActFun Value)
{
	switch (Value)
	{
	case EConsacActFun::Tanh:
		return TEXT("tanh");
	case EConsacActFun::Relu:
		return TEXT("relu");
	case EConsacActFun::Sigmoid:
		return TEXT("sigmoid");
	case EConsacActFun::Elu:
		return TEXT("elu");
	case EConsacActFun::LeakyRelu:
		return TEXT("leaky_relu");
	case EConsacActFun::Silu:
		return TEXT("silu");
	case EConsacActFun::Softplus:
		return TEXT("softplus");
	case EConsacActFun::Linear:
		return TEXT("linear");
	}
	return TEXT("tanh");
}

FString ConsacTextOf(EConsacLrSchedule Value)
{
	switch (Value)
	{
	case EConsacLrSchedule::Constant:
		return TEXT("constant");
	case EConsacLrSchedule::Linear:
		return TEXT("linear");
	case EConsacLrSchedule::DoubleLinearCon:
		return TEXT("double_linear_con");
	case EConsacLrSchedule::MiddleDrop:
		return TEXT("middle_drop");
	case EConsacLrSchedule::DoubleMiddleDrop:
		return TEXT("double_middle_drop");
	}
	return TEXT("constant");
}

FString ConsacTextOf(EConsacTrainFreqUnit Value)
{
	switch (Value)
	{
	case EConsacTrainFreqUnit::Step:
		return TEXT("step");
	case EConsacTrainFreqUnit::Episode:
		return TEXT("episode");
	}
	return TEXT("step");
}

FString ConsacTextOf(EConsacWarmUp Value)
{
	switch (Value)
	{
	case EConsacWarmUp::Random:
		return TEXT("random");
	case EConsacWarmUp::EpsilonGreedy:
		return TEXT("epsilon_greedy");
	}
	return TEXT("random");
}

FString ConsacTextOf(EConsacGradClip Value)
{
	switch (Value)
	{
	case EConsacGradClip::Variable:
		return TEXT("variable");
	case EConsacGradClip::Global:
		return TEXT("global");
	}
	return TEXT("variable");
}

FString ConsacTextOf(EConsacDqnPolicy Value)
{
	switch (Value)
	{
	case EConsacDqnPolicy::Auto:
		return TEXT("auto");
	case EConsacDqnPolicy::MlpPolicy:
		return TEXT("MlpPolicy");
	case EConsacDqnPolicy::CnnPolicy:
		return TEXT("CnnPolicy");
	case EConsacDqnPolicy::MultiInputPolicy:
		return TEXT("MultiInputPolicy");
	case EConsacDqnPolicy::LnMlpPolicy:
		return TEXT("LnMlpPolicy");
	case EConsacDqnPolicy::LnCnnPolicy:
		return TEXT("LnCnnPolicy");
	}
	return TEXT("auto");
}

FString ConsacTextOf(EConsacInit Value)
{
	switch (Value)
	{
	case EConsacInit::Orthogonal:
		return TEXT("orthogonal");
	case EConsacInit::Xavier:
		return TEXT("xavier");
	case EConsacInit::Pytorch:
		return TEXT("pytorch");
	}
	return TEXT("orthogonal");
}

FString ConsacTextOf(EConsacReplayBufferClass Value)
{
	switch (Value)
	{
	case EConsacReplayBufferClass::ReplayBuffer:
		return TEXT("ReplayBuffer");
	case EConsacReplayBufferClass::HerReplayBuffer:
		return TEXT("HerReplayBuffer");
	}
	return TEXT("ReplayBuffer");
}

FString ConsacTextOf(EConsacGoalSelectionStrategy Value)
{
	switch (Value)
	{
	case EConsacGoalSelectionStrategy::Future:
		return TEXT("future");
	case EConsacGoalSelectionStrategy::Final:
		return TEXT("final");
	case EConsacGoalSelectionStrategy::Episode:
		return TEXT("episode");
	case EConsacGoalSelectionStrategy::Random:
		return TEXT("random");
	}
	return TEXT("future");
}

FString ConsacTextOf(EConsacActionNoise Value)
{
	switch (Value)
	{
	case EConsacActionNoise::None:
		return TEXT("none");
	case EConsacActionNoise::Normal:
		return TEXT("normal");
	case EConsacActionNoise::OrnsteinUhlenbeck:
		return TEXT("ornstein_uhlenbeck");
	}
	return TEXT("none");
}

FString ConsacTextOf(EConsacActorStep Value)
{
	switch (Value)
	{
	case EConsacActorStep::BeforeCritic:
		return TEXT("before_critic");
	case EConsacActorStep::AfterCritic:
		return TEXT("after_critic");
	}
	return TEXT("before_critic");
}
}

FString UConsacPpo2Hyperparameters::GetAlgorithm() const
{
	return TEXT("ppo2");
}

void UConsacPpo2Hyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	AddText(Into, TEXT("learning_rate"), ConsacTextOf(LearningRate));
	AddInteger(Into, TEXT("n_steps"), NSteps);
	AddReal(Into, TEXT("gamma"), Gamma);
	AddReal(Into, TEXT("lam"), Lam);
	AddReal(Into, TEXT("ent_coef"), EntCoef);
	AddReal(Into, TEXT("vf_coef"), VfCoef);
	if (bSetMaxGradNorm)
	{
		AddReal(Into, TEXT("max_grad_norm"), MaxGradNorm);
	}
	else
	{
		AddText(Into, TEXT("max_grad_norm"), TEXT("none"));
	}
	AddBoolean(Into, TEXT("normalize_advantage"), bNormalizeAdvantage);
	AddText(Into, TEXT("truncation"), ConsacTextOf(Truncation));
	AddInteger(Into, TEXT("nminibatches"), Nminibatches);
	if (bSetBatchSize)
	{
		AddInteger(Into, TEXT("batch_size"), BatchSize);
	}
	else
	{
		AddText(Into, TEXT("batch_size"), TEXT("none"));
	}
	AddInteger(Into, TEXT("noptepochs"), Noptepochs);
	AddText(Into, TEXT("cliprange"), ConsacTextOf(Cliprange));
	if (bSetCliprangeVf)
	{
		AddText(Into, TEXT("cliprange_vf"), ConsacTextOf(CliprangeVf));
	}
	else
	{
		AddText(Into, TEXT("cliprange_vf"), TEXT("none"));
	}
	if (bSetTargetKl)
	{
		AddReal(Into, TEXT("target_kl"), TargetKl);
	}
	else
	{
		AddText(Into, TEXT("target_kl"), TEXT("none"));
	}
	AddText(Into, TEXT("advantage_std"), ConsacTextOf(AdvantageStd));
	AddText(Into, TEXT("value_loss"), ConsacTextOf(ValueLoss));
	AddText(Into, TEXT("optimizer"), ConsacTextOf(Optimizer));
	AddReal(Into, TEXT("adam_epsilon"), AdamEpsilon);
	AddText(Into, TEXT("policy"), ConsacTextOf(Policy));
	AddText(Into, TEXT("net_arch"), NetArch);
	AddText(Into, TEXT("act_fun"), ConsacTextOf(ActFun));
	AddBoolean(Into, TEXT("ortho_init"), bOrthoInit);
	AddReal(Into, TEXT("log_std_init"), LogStdInit);
	AddBoolean(Into, TEXT("use_sde"), bUseSde);
	AddInteger(Into, TEXT("sde_sample_freq"), SdeSampleFreq);
	AddBoolean(Into, TEXT("full_std"), bFullStd);
	AddBoolean(Into, TEXT("use_expln"), bUseExpln);
	AddBoolean(Into, TEXT("squash_output"), bSquashOutput);
	AddBoolean(Into, TEXT("norm_obs"), bNormObs);
	AddBoolean(Into, TEXT("norm_reward"), bNormReward);
	AddReal(Into, TEXT("clip_obs"), ClipObs);
	AddReal(Into, TEXT("clip_reward"), ClipReward);
	AddReal(Into, TEXT("norm_epsilon"), NormEpsilon);
}

FString UConsacPpoHyperparameters::GetAlgorithm() const
{
	return TEXT("ppo");
}

void UConsacPpoHyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	AddText(Into, TEXT("learning_rate"), ConsacTextOf(LearningRate));
	AddInteger(Into, TEXT("n_steps"), NSteps);
	AddReal(Into, TEXT("gamma"), Gamma);
	AddReal(Into, TEXT("gae_lambda"), GaeLambda);
	AddReal(Into, TEXT("ent_coef"), EntCoef);
	AddReal(Into, TEXT("vf_coef"), VfCoef);
	if (bSetMaxGradNorm)
	{
		AddReal(Into, TEXT("max_grad_norm"), MaxGradNorm);
	}
	else
	{
		AddText(Into, TEXT("max_grad_norm"), TEXT("none"));
	}
	AddBoolean(Into, TEXT("normalize_advantage"), bNormalizeAdvantage);
	AddText(Into, TEXT("truncation"), ConsacTextOf(Truncation));
	if (bSetNminibatches)
	{
		AddInteger(Into, TEXT("nminibatches"), Nminibatches);
	}
	else
	{
		AddText(Into, TEXT("nminibatches"), TEXT("none"));
	}
	AddInteger(Into, TEXT("batch_size"), BatchSize);
	AddInteger(Into, TEXT("n_epochs"), NEpochs);
	AddText(Into, TEXT("clip_range"), ConsacTextOf(ClipRange));
	if (bSetClipRangeVf)
	{
		AddText(Into, TEXT("clip_range_vf"), ConsacTextOf(ClipRangeVf));
	}
	else
	{
		AddText(Into, TEXT("clip_range_vf"), TEXT("none"));
	}
	if (bSetTargetKl)
	{
		AddReal(Into, TEXT("target_kl"), TargetKl);
	}
	else
	{
		AddText(Into, TEXT("target_kl"), TEXT("none"));
	}
	AddText(Into, TEXT("advantage_std"), ConsacTextOf(AdvantageStd));
	AddText(Into, TEXT("value_loss"), ConsacTextOf(ValueLoss));
	AddText(Into, TEXT("optimizer"), ConsacTextOf(Optimizer));
	AddReal(Into, TEXT("adam_epsilon"), AdamEpsilon);
	AddText(Into, TEXT("policy"), ConsacTextOf(Policy));
	AddText(Into, TEXT("net_arch"), NetArch);
	AddText(Into, TEXT("activation_fn"), ConsacTextOf(ActivationFn));
	AddBoolean(Into, TEXT("ortho_init"), bOrthoInit);
	AddReal(Into, TEXT("log_std_init"), LogStdInit);
	AddBoolean(Into, TEXT("use_sde"), bUseSde);
	AddInteger(Into, TEXT("sde_sample_freq"), SdeSampleFreq);
	AddBoolean(Into, TEXT("full_std"), bFullStd);
	AddBoolean(Into, TEXT("use_expln"), bUseExpln);
	AddBoolean(Into, TEXT("squash_output"), bSquashOutput);
	AddBoolean(Into, TEXT("norm_obs"), bNormObs);
	AddBoolean(Into, TEXT("norm_reward"), bNormReward);
	AddReal(Into, TEXT("clip_obs"), ClipObs);
	AddReal(Into, TEXT("clip_reward"), ClipReward);
	AddReal(Into, TEXT("norm_epsilon"), NormEpsilon);
}

FString UConsacA2cHyperparameters::GetAlgorithm() const
{
	return TEXT("a2c");
}

void UConsacA2cHyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	AddText(Into, TEXT("learning_rate"), ConsacTextOf(LearningRate));
	AddInteger(Into, TEXT("n_steps"), NSteps);
	AddReal(Into, TEXT("gamma"), Gamma);
	AddReal(Into, TEXT("gae_lambda"), GaeLambda);
	AddReal(Into, TEXT("ent_coef"), EntCoef);
	AddReal(Into, TEXT("vf_coef"), VfCoef);
	if (bSetMaxGradNorm)
	{
		AddReal(Into, TEXT("max_grad_norm"), MaxGradNorm);
	}
	else
	{
		AddText(Into, TEXT("max_grad_norm"), TEXT("none"));
	}
	AddBoolean(Into, TEXT("normalize_advantage"), bNormalizeAdvantage);
	AddText(Into, TEXT("truncation"), ConsacTextOf(Truncation));
	AddText(Into, TEXT("lr_schedule"), ConsacTextOf(LrSchedule));
	AddBoolean(Into, TEXT("use_rms_prop"), bUseRmsProp);
	AddText(Into, TEXT("optimizer"), ConsacTextOf(Optimizer));
	AddReal(Into, TEXT("alpha"), Alpha);
	AddReal(Into, TEXT("momentum"), Momentum);
	AddReal(Into, TEXT("rms_prop_eps"), RmsPropEps);
	AddReal(Into, TEXT("adam_epsilon"), AdamEpsilon);
	AddText(Into, TEXT("log_keys"), ConsacTextOf(LogKeys));
	AddText(Into, TEXT("policy"), ConsacTextOf(Policy));
	AddText(Into, TEXT("net_arch"), NetArch);
	AddText(Into, TEXT("activation_fn"), ConsacTextOf(ActivationFn));
	AddBoolean(Into, TEXT("ortho_init"), bOrthoInit);
	AddReal(Into, TEXT("log_std_init"), LogStdInit);
	AddBoolean(Into, TEXT("use_sde"), bUseSde);
	AddInteger(Into, TEXT("sde_sample_freq"), SdeSampleFreq);
	AddBoolean(Into, TEXT("full_std"), bFullStd);
	AddBoolean(Into, TEXT("use_expln"), bUseExpln);
	AddBoolean(Into, TEXT("squash_output"), bSquashOutput);
	AddBoolean(Into, TEXT("norm_obs"), bNormObs);
	AddBoolean(Into, TEXT("norm_reward"), bNormReward);
	AddReal(Into, TEXT("clip_obs"), ClipObs);
	AddReal(Into, TEXT("clip_reward"), ClipReward);
	AddReal(Into, TEXT("norm_epsilon"), NormEpsilon);
}

FString UConsacDqnHyperparameters::GetAlgorithm() const
{
	return TEXT("dqn");
}

void UConsacDqnHyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	AddReal(Into, TEXT("gamma"), Gamma);
	AddText(Into, TEXT("learning_rate"), ConsacTextOf(LearningRate));
	AddReal(Into, TEXT("exploration_fraction"), ExplorationFraction);
	AddReal(Into, TEXT("exploration_initial_eps"), ExplorationInitialEps);
	AddReal(Into, TEXT("exploration_final_eps"), ExplorationFinalEps);
	AddInteger(Into, TEXT("buffer_size"), BufferSize);
	AddInteger(Into, TEXT("learning_starts"), LearningStarts);
	AddInteger(Into, TEXT("batch_size"), BatchSize);
	AddInteger(Into, TEXT("n_steps"), NSteps);
	AddInteger(Into, TEXT("train_freq"), TrainFreq);
	AddReal(Into, TEXT("tau"), Tau);
	AddText(Into, TEXT("log_keys"), ConsacTextOf(LogKeys));
	AddText(Into, TEXT("truncation"), ConsacTextOf(Truncation));
	AddText(Into, TEXT("train_freq_unit"), ConsacTextOf(TrainFreqUnit));
	AddInteger(Into, TEXT("gradient_steps"), GradientSteps);
	AddBoolean(Into, TEXT("prioritized_replay"), bPrioritizedReplay);
	AddReal(Into, TEXT("prioritized_replay_alpha"), PrioritizedReplayAlpha);
	AddReal(Into, TEXT("prioritized_replay_beta0"), PrioritizedReplayBeta0);
	if (bSetPrioritizedReplayBetaIters)
	{
		AddInteger(Into, TEXT("prioritized_replay_beta_iters"), PrioritizedReplayBetaIters);
	}
	else
	{
		AddText(Into, TEXT("prioritized_replay_beta_iters"), TEXT("none"));
	}
	AddReal(Into, TEXT("prioritized_replay_eps"), PrioritizedReplayEps);
	AddText(Into, TEXT("warm_up"), ConsacTextOf(WarmUp));
	AddInteger(Into, TEXT("target_update_interval"), TargetUpdateInterval);
	if (bSetMaxGradNorm)
	{
		AddReal(Into, TEXT("max_grad_norm"), MaxGradNorm);
	}
	else
	{
		AddText(Into, TEXT("max_grad_norm"), TEXT("none"));
	}
	AddText(Into, TEXT("grad_clip"), ConsacTextOf(GradClip));
	AddText(Into, TEXT("optimizer"), ConsacTextOf(Optimizer));
	AddReal(Into, TEXT("adam_epsilon"), AdamEpsilon);
	AddBoolean(Into, TEXT("double_q"), bDoubleQ);
	AddBoolean(Into, TEXT("param_noise"), bParamNoise);
	AddText(Into, TEXT("policy"), ConsacTextOf(Policy));
	AddText(Into, TEXT("net_arch"), NetArch);
	AddText(Into, TEXT("activation_fn"), ConsacTextOf(ActivationFn));
	AddBoolean(Into, TEXT("dueling"), bDueling);
	AddBoolean(Into, TEXT("layer_norm"), bLayerNorm);
	AddText(Into, TEXT("init"), ConsacTextOf(Init));
	AddText(Into, TEXT("replay_buffer_class"), ConsacTextOf(ReplayBufferClass));
	AddInteger(Into, TEXT("n_sampled_goal"), NSampledGoal);
	AddText(Into, TEXT("goal_selection_strategy"), ConsacTextOf(GoalSelectionStrategy));
	AddText(Into, TEXT("her_form"), ConsacTextOf(HerForm));
	AddBoolean(Into, TEXT("norm_obs"), bNormObs);
	AddBoolean(Into, TEXT("norm_reward"), bNormReward);
	AddReal(Into, TEXT("clip_obs"), ClipObs);
	AddReal(Into, TEXT("clip_reward"), ClipReward);
	AddReal(Into, TEXT("norm_epsilon"), NormEpsilon);
}

FString UConsacSacHyperparameters::GetAlgorithm() const
{
	return TEXT("sac");
}

void UConsacSacHyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	AddText(Into, TEXT("learning_rate"), ConsacTextOf(LearningRate));
	AddInteger(Into, TEXT("batch_size"), BatchSize);
	AddInteger(Into, TEXT("train_freq"), TrainFreq);
	AddInteger(Into, TEXT("gradient_steps"), GradientSteps);
	AddReal(Into, TEXT("gamma"), Gamma);
	AddInteger(Into, TEXT("buffer_size"), BufferSize);
	AddInteger(Into, TEXT("learning_starts"), LearningStarts);
	AddInteger(Into, TEXT("n_steps"), NSteps);
	AddText(Into, TEXT("train_freq_unit"), ConsacTextOf(TrainFreqUnit));
	AddText(Into, TEXT("truncation"), ConsacTextOf(Truncation));
	AddReal(Into, TEXT("tau"), Tau);
	AddText(Into, TEXT("log_keys"), ConsacTextOf(LogKeys));
	AddText(Into, TEXT("ent_coef"), EntCoef);
	AddText(Into, TEXT("target_entropy"), TargetEntropy);
	AddInteger(Into, TEXT("target_update_interval"), TargetUpdateInterval);
	AddBoolean(Into, TEXT("value_network"), bValueNetwork);
	AddBoolean(Into, TEXT("use_sde"), bUseSde);
	AddInteger(Into, TEXT("sde_sample_freq"), SdeSampleFreq);
	AddBoolean(Into, TEXT("full_std"), bFullStd);
	AddBoolean(Into, TEXT("use_expln"), bUseExpln);
	AddBoolean(Into, TEXT("use_sde_at_warmup"), bUseSdeAtWarmup);
	AddReal(Into, TEXT("log_std_init"), LogStdInit);
	AddReal(Into, TEXT("clip_mean"), ClipMean);
	AddText(Into, TEXT("action_noise"), ConsacTextOf(ActionNoise));
	AddReal(Into, TEXT("noise_std"), NoiseStd);
	AddReal(Into, TEXT("noise_mean"), NoiseMean);
	AddReal(Into, TEXT("noise_theta"), NoiseTheta);
	AddReal(Into, TEXT("noise_dt"), NoiseDt);
	AddReal(Into, TEXT("random_exploration"), RandomExploration);
	AddText(Into, TEXT("optimizer"), ConsacTextOf(Optimizer));
	AddReal(Into, TEXT("adam_epsilon"), AdamEpsilon);
	AddText(Into, TEXT("policy"), ConsacTextOf(Policy));
	AddText(Into, TEXT("net_arch"), NetArch);
	AddText(Into, TEXT("activation_fn"), ConsacTextOf(ActivationFn));
	AddBoolean(Into, TEXT("layer_norm"), bLayerNorm);
	AddText(Into, TEXT("init"), ConsacTextOf(Init));
	AddInteger(Into, TEXT("n_critics"), NCritics);
	AddText(Into, TEXT("replay_buffer_class"), ConsacTextOf(ReplayBufferClass));
	AddInteger(Into, TEXT("n_sampled_goal"), NSampledGoal);
	AddText(Into, TEXT("goal_selection_strategy"), ConsacTextOf(GoalSelectionStrategy));
	AddText(Into, TEXT("her_form"), ConsacTextOf(HerForm));
	AddBoolean(Into, TEXT("norm_obs"), bNormObs);
	AddBoolean(Into, TEXT("norm_reward"), bNormReward);
	AddReal(Into, TEXT("clip_obs"), ClipObs);
	AddReal(Into, TEXT("clip_reward"), ClipReward);
	AddReal(Into, TEXT("norm_epsilon"), NormEpsilon);
}

FString UConsacTd3Hyperparameters::GetAlgorithm() const
{
	return TEXT("td3");
}

void UConsacTd3Hyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	AddText(Into, TEXT("learning_rate"), ConsacTextOf(LearningRate));
	AddInteger(Into, TEXT("batch_size"), BatchSize);
	AddInteger(Into, TEXT("train_freq"), TrainFreq);
	AddInteger(Into, TEXT("gradient_steps"), GradientSteps);
	AddReal(Into, TEXT("gamma"), Gamma);
	AddInteger(Into, TEXT("buffer_size"), BufferSize);
	AddInteger(Into, TEXT("learning_starts"), LearningStarts);
	AddInteger(Into, TEXT("n_steps"), NSteps);
	AddText(Into, TEXT("train_freq_unit"), ConsacTextOf(TrainFreqUnit));
	AddText(Into, TEXT("truncation"), ConsacTextOf(Truncation));
	AddReal(Into, TEXT("tau"), Tau);
	AddText(Into, TEXT("log_keys"), ConsacTextOf(LogKeys));
	AddInteger(Into, TEXT("policy_delay"), PolicyDelay);
	AddReal(Into, TEXT("target_policy_noise"), TargetPolicyNoise);
	AddReal(Into, TEXT("target_noise_clip"), TargetNoiseClip);
	AddText(Into, TEXT("action_noise"), ConsacTextOf(ActionNoise));
	AddReal(Into, TEXT("noise_std"), NoiseStd);
	AddReal(Into, TEXT("noise_mean"), NoiseMean);
	AddReal(Into, TEXT("noise_theta"), NoiseTheta);
	AddReal(Into, TEXT("noise_dt"), NoiseDt);
	AddReal(Into, TEXT("random_exploration"), RandomExploration);
	AddText(Into, TEXT("optimizer"), ConsacTextOf(Optimizer));
	AddReal(Into, TEXT("adam_epsilon"), AdamEpsilon);
	AddText(Into, TEXT("policy"), ConsacTextOf(Policy));
	AddText(Into, TEXT("net_arch"), NetArch);
	AddText(Into, TEXT("activation_fn"), ConsacTextOf(ActivationFn));
	AddBoolean(Into, TEXT("layer_norm"), bLayerNorm);
	AddText(Into, TEXT("init"), ConsacTextOf(Init));
	AddInteger(Into, TEXT("n_critics"), NCritics);
	AddText(Into, TEXT("replay_buffer_class"), ConsacTextOf(ReplayBufferClass));
	AddInteger(Into, TEXT("n_sampled_goal"), NSampledGoal);
	AddText(Into, TEXT("goal_selection_strategy"), ConsacTextOf(GoalSelectionStrategy));
	AddText(Into, TEXT("her_form"), ConsacTextOf(HerForm));
	AddBoolean(Into, TEXT("norm_obs"), bNormObs);
	AddBoolean(Into, TEXT("norm_reward"), bNormReward);
	AddReal(Into, TEXT("clip_obs"), ClipObs);
	AddReal(Into, TEXT("clip_reward"), ClipReward);
	AddReal(Into, TEXT("norm_epsilon"), NormEpsilon);
}

FString UConsacDdpgHyperparameters::GetAlgorithm() const
{
	return TEXT("ddpg");
}

void UConsacDdpgHyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	AddReal(Into, TEXT("gamma"), Gamma);
	AddInteger(Into, TEXT("buffer_size"), BufferSize);
	AddInteger(Into, TEXT("learning_starts"), LearningStarts);
	AddInteger(Into, TEXT("n_steps"), NSteps);
	AddText(Into, TEXT("train_freq_unit"), ConsacTextOf(TrainFreqUnit));
	AddText(Into, TEXT("truncation"), ConsacTextOf(Truncation));
	AddReal(Into, TEXT("tau"), Tau);
	AddText(Into, TEXT("log_keys"), ConsacTextOf(LogKeys));
	AddInteger(Into, TEXT("batch_size"), BatchSize);
	AddText(Into, TEXT("learning_rate"), ConsacTextOf(LearningRate));
	if (bSetActorLr)
	{
		AddText(Into, TEXT("actor_lr"), ConsacTextOf(ActorLr));
	}
	else
	{
		AddText(Into, TEXT("actor_lr"), TEXT("none"));
	}
	AddInteger(Into, TEXT("train_freq"), TrainFreq);
	AddInteger(Into, TEXT("gradient_steps"), GradientSteps);
	if (bSetClipNorm)
	{
		AddReal(Into, TEXT("clip_norm"), ClipNorm);
	}
	else
	{
		AddText(Into, TEXT("clip_norm"), TEXT("none"));
	}
	AddReal(Into, TEXT("critic_l2_reg"), CriticL2Reg);
	AddReal(Into, TEXT("reward_scale"), RewardScale);
	AddBoolean(Into, TEXT("normalize_returns"), bNormalizeReturns);
	AddBoolean(Into, TEXT("enable_popart"), bEnablePopart);
	if (bSetReturnRange)
	{
		AddReal(Into, TEXT("return_range"), ReturnRange);
	}
	else
	{
		AddText(Into, TEXT("return_range"), TEXT("none"));
	}
	AddText(Into, TEXT("actor_step"), ConsacTextOf(ActorStep));
	AddInteger(Into, TEXT("action_layer"), ActionLayer);
	if (bSetOutputBound)
	{
		AddReal(Into, TEXT("output_bound"), OutputBound);
	}
	else
	{
		AddText(Into, TEXT("output_bound"), TEXT("none"));
	}
	AddBoolean(Into, TEXT("param_noise"), bParamNoise);
	AddReal(Into, TEXT("param_noise_stddev"), ParamNoiseStddev);
	AddReal(Into, TEXT("desired_action_stddev"), DesiredActionStddev);
	AddReal(Into, TEXT("adoption_coefficient"), AdoptionCoefficient);
	AddInteger(Into, TEXT("param_noise_adaption_interval"), ParamNoiseAdaptionInterval);
	AddText(Into, TEXT("action_noise"), ConsacTextOf(ActionNoise));
	AddReal(Into, TEXT("noise_std"), NoiseStd);
	AddReal(Into, TEXT("noise_mean"), NoiseMean);
	AddReal(Into, TEXT("noise_theta"), NoiseTheta);
	AddReal(Into, TEXT("noise_dt"), NoiseDt);
	AddReal(Into, TEXT("random_exploration"), RandomExploration);
	AddText(Into, TEXT("optimizer"), ConsacTextOf(Optimizer));
	AddReal(Into, TEXT("adam_epsilon"), AdamEpsilon);
	AddText(Into, TEXT("policy"), ConsacTextOf(Policy));
	AddText(Into, TEXT("net_arch"), NetArch);
	AddText(Into, TEXT("activation_fn"), ConsacTextOf(ActivationFn));
	AddBoolean(Into, TEXT("layer_norm"), bLayerNorm);
	AddText(Into, TEXT("init"), ConsacTextOf(Init));
	AddInteger(Into, TEXT("n_critics"), NCritics);
	AddText(Into, TEXT("replay_buffer_class"), ConsacTextOf(ReplayBufferClass));
	AddInteger(Into, TEXT("n_sampled_goal"), NSampledGoal);
	AddText(Into, TEXT("goal_selection_strategy"), ConsacTextOf(GoalSelectionStrategy));
	AddText(Into, TEXT("her_form"), ConsacTextOf(HerForm));
	AddBoolean(Into, TEXT("norm_obs"), bNormObs);
	AddBoolean(Into, TEXT("norm_reward"), bNormReward);
	AddReal(Into, TEXT("clip_obs"), ClipObs);
	AddReal(Into, TEXT("clip_reward"), ClipReward);
	AddReal(Into, TEXT("norm_epsilon"), NormEpsilon);
}
