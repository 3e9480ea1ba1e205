// Copyright CONSAC authors. MIT License.
// Written by tools/generate_hyperparameters.py from the program's own table; do not edit.

#pragma once

#include "CoreMinimal.h"
#include "ConsacHyperparametersBase.h"
#include "ConsacHyperparameters.generated.h"

/** What Truncation may be. */
UENUM(BlueprintType)
enum class EConsacTruncation : uint8
{
	Bootstrap UMETA(DisplayName="bootstrap"),
	Terminal UMETA(DisplayName="terminal")
};

/** What AdvantageStd may be. */
UENUM(BlueprintType)
enum class EConsacAdvantageStd : uint8
{
	Population UMETA(DisplayName="population"),
	Sample UMETA(DisplayName="sample")
};

/** What ValueLoss may be. */
UENUM(BlueprintType)
enum class EConsacValueLoss : uint8
{
	Sb2 UMETA(DisplayName="sb2"),
	Sb3 UMETA(DisplayName="sb3")
};

/** What Optimizer may be. */
UENUM(BlueprintType)
enum class EConsacOptimizer : uint8
{
	Tensorflow UMETA(DisplayName="tensorflow"),
	Pytorch UMETA(DisplayName="pytorch")
};

/** What Policy may be. */
UENUM(BlueprintType)
enum class EConsacPolicy : uint8
{
	Auto UMETA(DisplayName="auto"),
	MlpPolicy UMETA(DisplayName="MlpPolicy"),
	CnnPolicy UMETA(DisplayName="CnnPolicy"),
	MultiInputPolicy UMETA(DisplayName="MultiInputPolicy")
};

/** What ActFun may be. */
UENUM(BlueprintType)
enum class EConsacActFun : uint8
{
	Tanh UMETA(DisplayName="tanh"),
	Relu UMETA(DisplayName="relu"),
	Sigmoid UMETA(DisplayName="sigmoid"),
	Elu UMETA(DisplayName="elu"),
	LeakyRelu UMETA(DisplayName="leaky_relu"),
	Silu UMETA(DisplayName="silu"),
	Softplus UMETA(DisplayName="softplus"),
	Linear UMETA(DisplayName="linear")
};

/** What LrSchedule may be. */
UENUM(BlueprintType)
enum class EConsacLrSchedule : uint8
{
	Constant UMETA(DisplayName="constant"),
	Linear UMETA(DisplayName="linear"),
	DoubleLinearCon UMETA(DisplayName="double_linear_con"),
	MiddleDrop UMETA(DisplayName="middle_drop"),
	DoubleMiddleDrop UMETA(DisplayName="double_middle_drop")
};

/** What TrainFreqUnit may be. */
UENUM(BlueprintType)
enum class EConsacTrainFreqUnit : uint8
{
	Step UMETA(DisplayName="step"),
	Episode UMETA(DisplayName="episode")
};

/** What WarmUp may be. */
UENUM(BlueprintType)
enum class EConsacWarmUp : uint8
{
	Random UMETA(DisplayName="random"),
	EpsilonGreedy UMETA(DisplayName="epsilon_greedy")
};

/** What GradClip may be. */
UENUM(BlueprintType)
enum class EConsacGradClip : uint8
{
	Variable UMETA(DisplayName="variable"),
	Global UMETA(DisplayName="global")
};

/** What DqnPolicy may be. */
UENUM(BlueprintType)
enum class EConsacDqnPolicy : uint8
{
	Auto UMETA(DisplayName="auto"),
	MlpPolicy UMETA(DisplayName="MlpPolicy"),
	CnnPolicy UMETA(DisplayName="CnnPolicy"),
	MultiInputPolicy UMETA(DisplayName="MultiInputPolicy"),
	LnMlpPolicy UMETA(DisplayName="LnMlpPolicy"),
	LnCnnPolicy UMETA(DisplayName="LnCnnPolicy")
};

/** What Init may be. */
UENUM(BlueprintType)
enum class EConsacInit : uint8
{
	Orthogonal UMETA(DisplayName="orthogonal"),
	Xavier UMETA(DisplayName="xavier"),
	Pytorch UMETA(DisplayName="pytorch")
};

/** What ReplayBufferClass may be. */
UENUM(BlueprintType)
enum class EConsacReplayBufferClass : uint8
{
	ReplayBuffer UMETA(DisplayName="ReplayBuffer"),
	HerReplayBuffer UMETA(DisplayName="HerReplayBuffer")
};

/** What GoalSelectionStrategy may be. */
UENUM(BlueprintType)
enum class EConsacGoalSelectionStrategy : uint8
{
	Future UMETA(DisplayName="future"),
	Final UMETA(DisplayName="final"),
	Episode UMETA(DisplayName="episode"),
	Random UMETA(DisplayName="random")
};

/** What ActionNoise may be. */
UENUM(BlueprintType)
enum class EConsacActionNoise : uint8
{
	None UMETA(DisplayName="none"),
	Normal UMETA(DisplayName="normal"),
	OrnsteinUhlenbeck UMETA(DisplayName="ornstein_uhlenbeck")
};

/** What ActorStep may be. */
UENUM(BlueprintType)
enum class EConsacActorStep : uint8
{
	BeforeCritic UMETA(DisplayName="before_critic"),
	AfterCritic UMETA(DisplayName="after_critic")
};

/** A number that stays, or goes down to nothing over the training. */
USTRUCT(BlueprintType)
struct CONSAC_API FConsacSchedule
{
	GENERATED_BODY()

	FConsacSchedule() = default;
	FConsacSchedule(double InValue, bool bInLinear) : Value(InValue), bLinear(bInLinear) {}

	/** The value; at the start, where it goes down. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	double Value = 0.0;

	/** Times the part of the training that is left: 1 at its start, 0 at its end. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bLinear = false;
};

/** Hyperparameters of ppo2: proximal policy optimisation as in Stable Baselines 2.10.2, the thesis' algorithm. */
UCLASS(BlueprintType)
class CONSAC_API UConsacPpo2Hyperparameters : public UConsacHyperparameters
{
	GENERATED_BODY()

public:
	/** The optimiser's step size. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule LearningRate = FConsacSchedule(2.5e-4, false);

	/** Steps per world and update; the rollout is n_steps times worlds. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 NSteps = 128;

	/** Discount per step. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Gamma = 0.99;

	/** Decay of generalised advantages; 1 is Monte Carlo, 0 is one step. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Lam = 0.95;

	/** Weight of the entropy bonus. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double EntCoef = 0.01;

	/** Weight of the value loss. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double VfCoef = 0.5;

	/** Whether max_grad_norm is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetMaxGradNorm = true;

	/** Global gradient norm is clipped to this. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetMaxGradNorm"))
	double MaxGradNorm = 0.5;

	/** Standardise advantages per minibatch. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormalizeAdvantage = true;

	/**
	 * A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTruncation Truncation = EConsacTruncation::Bootstrap;

	/**
	 * Minibatches per epoch; must divide the rollout; in ppo instead of batch_size. (Stable Baselines 2.10.2, PPO2)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 Nminibatches = 4;

	/** Whether batch_size is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetBatchSize = false;

	/** Rows per minibatch; in ppo2 instead of nminibatches. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000", EditCondition="bSetBatchSize"))
	int32 BatchSize = 1;

	/** Passes over the rollout per update. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 Noptepochs = 4;

	/** How far the probability ratio may move. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule Cliprange = FConsacSchedule(0.2, false);

	/** Whether cliprange_vf is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetCliprangeVf = false;

	/**
	 * How far the value may move; none: as cliprange (ppo2), no clipping (ppo); negative: no clipping. (Stable
	 * Baselines 2.10.2, PPO2)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(EditCondition="bSetCliprangeVf"))
	FConsacSchedule CliprangeVf = FConsacSchedule(0.0, false);

	/** Whether target_kl is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetTargetKl = false;

	/** Stop an update's epochs past 1.5 times this divergence. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetTargetKl"))
	double TargetKl = 0.0;

	/** Deviation by n (SB2) or n - 1 (SB3). (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacAdvantageStd AdvantageStd = EConsacAdvantageStd::Population;

	/** Half the mean of the larger of both errors, or the mean of one. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss ValueLoss = EConsacValueLoss::Sb2;

	/** Whose form of Adam and of the gradient clip. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacOptimizer Optimizer = EConsacOptimizer::Tensorflow;

	/** Adam's epsilon. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double AdamEpsilon = 1e-5;

	/**
	 * Kind of network: dense layers, convolutions for images, both; auto: what the observation needs. (Stable
	 * Baselines 2.10.2, PPO2)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacPolicy Policy = EConsacPolicy::Auto;

	/**
	 * Layers: shared widths, then dict(pi=[...], vf=[...]); auto: [dict(pi=[64, 64], vf=[64, 64])], none behind
	 * CnnPolicy. (Stable Baselines 2.10.2, PPO2)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString NetArch = TEXT("auto");

	/** Activation of hidden layers. (Stable Baselines 2.10.2, PPO2) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActFun ActFun = EConsacActFun::Tanh;

	/** Orthogonal initial weights; false: PyTorch's uniform. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bOrthoInit = true;

	/** Starting log standard deviation of Box actions. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-20", ClampMax="20"))
	double LogStdInit = 0.0;

	/** Box actions explore by noise that is a function of the state (gSDE). (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseSde = false;

	/**
	 * With gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone. (Stable Baselines3,
	 * PPO)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 SdeSampleFreq = 0;

	/**
	 * With gSDE: a deviation for each feature and element of the action; false: for each feature. (Stable Baselines3,
	 * PPO)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bFullStd = true;

	/** With gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x). (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseExpln = false;

	/** With gSDE: tanh brings actions into their bounds; false: they are clipped. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bSquashOutput = false;

	/** Normalise observations by their running moments. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormObs = false;

	/** Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormReward = false;

	/** Largest normalised observation. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000001", ClampMax="1000000000"))
	double ClipObs = 10.0;

	/** Largest scaled reward. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double ClipReward = 10.0;

	/** Added to variances. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double NormEpsilon = 1e-8;

	virtual FString GetAlgorithm() const override;
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const override;
};

/** Hyperparameters of ppo: proximal policy optimisation as in Stable Baselines3. */
UCLASS(BlueprintType)
class CONSAC_API UConsacPpoHyperparameters : public UConsacHyperparameters
{
	GENERATED_BODY()

public:
	/** The optimiser's step size. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule LearningRate = FConsacSchedule(3e-4, false);

	/** Steps per world and update; the rollout is n_steps times worlds. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 NSteps = 2048;

	/** Discount per step. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Gamma = 0.99;

	/** Decay of generalised advantages; 1 is Monte Carlo, 0 is one step. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double GaeLambda = 0.95;

	/** Weight of the entropy bonus. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double EntCoef = 0.0;

	/** Weight of the value loss. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double VfCoef = 0.5;

	/** Whether max_grad_norm is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetMaxGradNorm = true;

	/** Global gradient norm is clipped to this. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetMaxGradNorm"))
	double MaxGradNorm = 0.5;

	/** Standardise advantages per minibatch. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormalizeAdvantage = true;

	/**
	 * A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTruncation Truncation = EConsacTruncation::Bootstrap;

	/** Whether nminibatches is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetNminibatches = false;

	/**
	 * Minibatches per epoch; must divide the rollout; in ppo instead of batch_size. (Stable Baselines 2.10.2, PPO2)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000", EditCondition="bSetNminibatches"))
	int32 Nminibatches = 1;

	/** Rows per minibatch; in ppo2 instead of nminibatches. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 BatchSize = 64;

	/** Passes over the rollout per update. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 NEpochs = 10;

	/** How far the probability ratio may move. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule ClipRange = FConsacSchedule(0.2, false);

	/** Whether clip_range_vf is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetClipRangeVf = false;

	/**
	 * How far the value may move; none: as cliprange (ppo2), no clipping (ppo); negative: no clipping. (Stable
	 * Baselines3, PPO)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(EditCondition="bSetClipRangeVf"))
	FConsacSchedule ClipRangeVf = FConsacSchedule(0.0, false);

	/** Whether target_kl is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetTargetKl = false;

	/** Stop an update's epochs past 1.5 times this divergence. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetTargetKl"))
	double TargetKl = 0.0;

	/** Deviation by n (SB2) or n - 1 (SB3). (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacAdvantageStd AdvantageStd = EConsacAdvantageStd::Sample;

	/** Half the mean of the larger of both errors, or the mean of one. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss ValueLoss = EConsacValueLoss::Sb3;

	/** Whose form of Adam and of the gradient clip. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacOptimizer Optimizer = EConsacOptimizer::Pytorch;

	/** Adam's epsilon. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double AdamEpsilon = 1e-5;

	/**
	 * Kind of network: dense layers, convolutions for images, both; auto: what the observation needs. (Stable
	 * Baselines3, PPO)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacPolicy Policy = EConsacPolicy::Auto;

	/**
	 * Layers: shared widths, then dict(pi=[...], vf=[...]); auto: [dict(pi=[64, 64], vf=[64, 64])], none behind
	 * CnnPolicy. (Stable Baselines3, PPO)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString NetArch = TEXT("auto");

	/** Activation of hidden layers. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActFun ActivationFn = EConsacActFun::Tanh;

	/** Orthogonal initial weights; false: PyTorch's uniform. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bOrthoInit = true;

	/** Starting log standard deviation of Box actions. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-20", ClampMax="20"))
	double LogStdInit = 0.0;

	/** Box actions explore by noise that is a function of the state (gSDE). (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseSde = false;

	/**
	 * With gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone. (Stable Baselines3,
	 * PPO)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 SdeSampleFreq = 0;

	/**
	 * With gSDE: a deviation for each feature and element of the action; false: for each feature. (Stable Baselines3,
	 * PPO)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bFullStd = true;

	/** With gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x). (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseExpln = false;

	/** With gSDE: tanh brings actions into their bounds; false: they are clipped. (Stable Baselines3, PPO) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bSquashOutput = false;

	/** Normalise observations by their running moments. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormObs = false;

	/** Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormReward = false;

	/** Largest normalised observation. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000001", ClampMax="1000000000"))
	double ClipObs = 10.0;

	/** Largest scaled reward. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double ClipReward = 10.0;

	/** Added to variances. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double NormEpsilon = 1e-8;

	virtual FString GetAlgorithm() const override;
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const override;
};

/** Hyperparameters of a2c: advantage actor-critic, as in Stable Baselines3 or, with the preset sb2, 2.10.2. */
UCLASS(BlueprintType)
class CONSAC_API UConsacA2cHyperparameters : public UConsacHyperparameters
{
	GENERATED_BODY()

public:
	/** The optimiser's step size. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule LearningRate = FConsacSchedule(7e-4, false);

	/** Steps per world and update; the rollout is n_steps times worlds. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 NSteps = 5;

	/** Discount per step. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Gamma = 0.99;

	/** Decay of generalised advantages; 1 is Monte Carlo, 0 is one step. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double GaeLambda = 1.0;

	/** Weight of the entropy bonus. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double EntCoef = 0.0;

	/** Weight of the value loss. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double VfCoef = 0.5;

	/** Whether max_grad_norm is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetMaxGradNorm = true;

	/** Global gradient norm is clipped to this. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetMaxGradNorm"))
	double MaxGradNorm = 0.5;

	/** Standardise advantages per minibatch. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormalizeAdvantage = false;

	/**
	 * A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTruncation Truncation = EConsacTruncation::Bootstrap;

	/** Multiplies learning_rate as time passes. (Stable Baselines 2.10.2, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacLrSchedule LrSchedule = EConsacLrSchedule::Constant;

	/** RMSProp; false: Adam. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseRmsProp = true;

	/** Whose form of RMSProp or Adam and of the gradient clip. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacOptimizer Optimizer = EConsacOptimizer::Pytorch;

	/** Decay of RMSProp's mean square. (Stable Baselines 2.10.2, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Alpha = 0.99;

	/** RMSProp's momentum. (Stable Baselines 2.10.2, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Momentum = 0.0;

	/** RMSProp's epsilon. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double RmsPropEps = 1e-5;

	/** Adam's epsilon. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double AdamEpsilon = 1e-5;

	/** Whose names the logs have. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss LogKeys = EConsacValueLoss::Sb3;

	/**
	 * Kind of network: dense layers, convolutions for images, both; auto: what the observation needs. (Stable
	 * Baselines3, A2C)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacPolicy Policy = EConsacPolicy::Auto;

	/**
	 * Layers: shared widths, then dict(pi=[...], vf=[...]); auto: [dict(pi=[64, 64], vf=[64, 64])], none behind
	 * CnnPolicy. (Stable Baselines3, A2C)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString NetArch = TEXT("auto");

	/** Activation of hidden layers. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActFun ActivationFn = EConsacActFun::Tanh;

	/** Orthogonal initial weights; false: PyTorch's uniform. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bOrthoInit = true;

	/** Starting log standard deviation of Box actions. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-20", ClampMax="20"))
	double LogStdInit = 0.0;

	/** Box actions explore by noise that is a function of the state (gSDE). (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseSde = false;

	/**
	 * With gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone. (Stable Baselines3,
	 * A2C)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 SdeSampleFreq = 0;

	/**
	 * With gSDE: a deviation for each feature and element of the action; false: for each feature. (Stable Baselines3,
	 * A2C)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bFullStd = true;

	/** With gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x). (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseExpln = false;

	/** With gSDE: tanh brings actions into their bounds; false: they are clipped. (Stable Baselines3, A2C) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bSquashOutput = false;

	/** Normalise observations by their running moments. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormObs = false;

	/** Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormReward = false;

	/** Largest normalised observation. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000001", ClampMax="1000000000"))
	double ClipObs = 10.0;

	/** Largest scaled reward. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double ClipReward = 10.0;

	/** Added to variances. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double NormEpsilon = 1e-8;

	virtual FString GetAlgorithm() const override;
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const override;
};

/** Hyperparameters of dqn: deep Q-learning, as in Stable Baselines3 or, with the preset sb2, 2.10.2. */
UCLASS(BlueprintType)
class CONSAC_API UConsacDqnHyperparameters : public UConsacHyperparameters
{
	GENERATED_BODY()

public:
	/** Discount per step. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Gamma = 0.99;

	/** The optimiser's step size. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule LearningRate = FConsacSchedule(1e-4, false);

	/** Share of the training over which epsilon falls. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double ExplorationFraction = 0.1;

	/** Epsilon at the start. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double ExplorationInitialEps = 1.0;

	/** Epsilon from then on. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double ExplorationFinalEps = 0.05;

	/** Transitions that are remembered, of all agents together. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 BufferSize = 1000000;

	/** Agent steps before the first gradient. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000000"))
	int32 LearningStarts = 100;

	/** Transitions of a gradient step. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 BatchSize = 32;

	/** Steps that a target looks ahead. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 NSteps = 1;

	/** Steps of each agent, or episodes, between rounds of learning. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 TrainFreq = 4;

	/** Share of the target network that an update replaces. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Tau = 1.0;

	/** Whose names the logs have. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss LogKeys = EConsacValueLoss::Sb3;

	/**
	 * A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTruncation Truncation = EConsacTruncation::Bootstrap;

	/** What train_freq counts. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTrainFreqUnit TrainFreqUnit = EConsacTrainFreqUnit::Step;

	/** Of each round; -1: one for every transition since the last. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 GradientSteps = 1;

	/** Draw by how wrong the values were. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bPrioritizedReplay = false;

	/** Exponent of the priorities. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="10"))
	double PrioritizedReplayAlpha = 0.6;

	/** Exponent of the weights that make up for it, at the start. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double PrioritizedReplayBeta0 = 0.4;

	/** Whether prioritized_replay_beta_iters is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetPrioritizedReplayBetaIters = false;

	/** Agent steps until that is 1; none: all of the training. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000", EditCondition="bSetPrioritizedReplayBetaIters"))
	int32 PrioritizedReplayBetaIters = 1;

	/** Added to every error that becomes a priority. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000000000000000000000000000001", ClampMax="1"))
	double PrioritizedReplayEps = 1e-6;

	/** How it acts before learning_starts. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacWarmUp WarmUp = EConsacWarmUp::Random;

	/** Agent steps between updates of the target network. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 TargetUpdateInterval = 10000;

	/** Whether max_grad_norm is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetMaxGradNorm = true;

	/** Gradient norms are clipped to this. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetMaxGradNorm"))
	double MaxGradNorm = 10.0;

	/** The norm of each tensor's gradient (SB2), or of the whole (SB3). (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacGradClip GradClip = EConsacGradClip::Global;

	/** Whose form of Adam and of the global clip. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacOptimizer Optimizer = EConsacOptimizer::Pytorch;

	/** Adam's epsilon. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double AdamEpsilon = 1e-8;

	/** The network chooses, its target judges. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bDoubleQ = false;

	/** Explore by noise in the parameters, as strong as epsilon would be. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bParamNoise = false;

	/**
	 * Kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the observation needs.
	 * (Stable Baselines3, DQN)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacDqnPolicy Policy = EConsacDqnPolicy::Auto;

	/**
	 * Widths of hidden layers; auto: [64, 64], behind CnnPolicy none but in the value's tower; with dueling they are
	 * that tower's there. (Stable Baselines3, DQN)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString NetArch = TEXT("auto");

	/** Activation of hidden layers. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActFun ActivationFn = EConsacActFun::Relu;

	/** Q = V + A - mean A, from a tower of these widths for each. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bDueling = false;

	/** Hidden layers are normalised before their activation. (Stable Baselines 2.10.2, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bLayerNorm = false;

	/** How weights start. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacInit Init = EConsacInit::Pytorch;

	/** Draw what is remembered as it was, or also as if other goals had been meant (HER). (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacReplayBufferClass ReplayBufferClass = EConsacReplayBufferClass::ReplayBuffer;

	/** HER: transitions drawn with another goal for each with its own. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	int32 NSampledGoal = 4;

	/** HER: whose goal, of later in the episode, its end, any of it, any episode. (Stable Baselines3, DQN) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacGoalSelectionStrategy GoalSelectionStrategy = EConsacGoalSelectionStrategy::Future;

	/**
	 * HER: goals from before a step and no ends (SB2), or from after it and ends as they were (SB3). (CONSAC; the two
	 * generations differ here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss HerForm = EConsacValueLoss::Sb3;

	/** Normalise observations by their running moments. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormObs = false;

	/** Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormReward = false;

	/** Largest normalised observation. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000001", ClampMax="1000000000"))
	double ClipObs = 10.0;

	/** Largest scaled reward. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double ClipReward = 10.0;

	/** Added to variances. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double NormEpsilon = 1e-8;

	virtual FString GetAlgorithm() const override;
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const override;
};

/**
 * Hyperparameters of sac: soft actor-critic for Box actions, as in Stable Baselines3 or, with the preset sb2,
 * 2.10.2.
 */
UCLASS(BlueprintType)
class CONSAC_API UConsacSacHyperparameters : public UConsacHyperparameters
{
	GENERATED_BODY()

public:
	/** The optimiser's step size. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule LearningRate = FConsacSchedule(3e-4, false);

	/** Transitions of a gradient step. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 BatchSize = 256;

	/** Steps of each agent, or episodes, between rounds of learning. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 TrainFreq = 1;

	/** Of each round; -1: one for every transition since the last. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 GradientSteps = 1;

	/** Discount per step. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Gamma = 0.99;

	/** Transitions that are remembered, of all agents together. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 BufferSize = 1000000;

	/** Agent steps before the first gradient. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000000"))
	int32 LearningStarts = 100;

	/** Steps that a target looks ahead. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 NSteps = 1;

	/** What train_freq counts. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTrainFreqUnit TrainFreqUnit = EConsacTrainFreqUnit::Step;

	/**
	 * A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTruncation Truncation = EConsacTruncation::Bootstrap;

	/** Share of the target network that an update replaces. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Tau = 0.005;

	/** Whose names the logs have. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss LogKeys = EConsacValueLoss::Sb3;

	/** Weight of the entropy; auto learns it from 1, auto_0.1 from 0.1. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString EntCoef = TEXT("auto");

	/** The entropy that a learned ent_coef aims at; auto: minus the action's elements. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString TargetEntropy = TEXT("auto");

	/** Gradient steps between updates of the target network. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 TargetUpdateInterval = 1;

	/**
	 * Targets from a network of the state's value (SB2), or from target critics (SB3). (CONSAC; the two generations
	 * differ here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bValueNetwork = false;

	/** Box actions explore by noise that is a function of the state (gSDE). (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseSde = false;

	/**
	 * With gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone. (Stable Baselines3,
	 * SAC)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 SdeSampleFreq = 0;

	/**
	 * With gSDE: a deviation for each feature and element of the action; false: for each feature. (Stable Baselines3,
	 * SAC)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bFullStd = true;

	/** With gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x). (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseExpln = false;

	/**
	 * With gSDE: the policy acts before learning_starts, too, in place of uniform actions. (Stable Baselines3, SAC)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bUseSdeAtWarmup = false;

	/** With gSDE: starting log standard deviation. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-20", ClampMax="20"))
	double LogStdInit = -3.0;

	/**
	 * With gSDE: means are brought within plus and minus this, before tanh; 0: as they are. (Stable Baselines3, SAC)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double ClipMean = 2.0;

	/** Noise that is added to actions while learning. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActionNoise ActionNoise = EConsacActionNoise::None;

	/** Its deviation, where actions go from -1 to 1. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseStd = 0.1;

	/** Its mean, or what it is drawn back to. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1000000", ClampMax="1000000"))
	double NoiseMean = 0.0;

	/** Ornstein_uhlenbeck: how strongly it is drawn back. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseTheta = 0.15;

	/** Ornstein_uhlenbeck: time of a step. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseDt = 0.01;

	/** Probability of a uniform action. (Stable Baselines 2.10.2, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double RandomExploration = 0.0;

	/** Whose form of Adam. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacOptimizer Optimizer = EConsacOptimizer::Pytorch;

	/** Adam's epsilon. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double AdamEpsilon = 1e-8;

	/**
	 * Kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the observation needs.
	 * (Stable Baselines3, SAC)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacDqnPolicy Policy = EConsacDqnPolicy::Auto;

	/** Widths of hidden layers of actor and critics, or dict(pi=[...], qf=[...]). (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString NetArch = TEXT("[256, 256]");

	/** Activation of hidden layers. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActFun ActivationFn = EConsacActFun::Relu;

	/** Hidden layers are normalised before their activation. (Stable Baselines 2.10.2, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bLayerNorm = false;

	/** How weights start. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacInit Init = EConsacInit::Pytorch;

	/** Critics; targets take the least of what theirs say. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="10"))
	int32 NCritics = 2;

	/** Draw what is remembered as it was, or also as if other goals had been meant (HER). (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacReplayBufferClass ReplayBufferClass = EConsacReplayBufferClass::ReplayBuffer;

	/** HER: transitions drawn with another goal for each with its own. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	int32 NSampledGoal = 4;

	/** HER: whose goal, of later in the episode, its end, any of it, any episode. (Stable Baselines3, SAC) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacGoalSelectionStrategy GoalSelectionStrategy = EConsacGoalSelectionStrategy::Future;

	/**
	 * HER: goals from before a step and no ends (SB2), or from after it and ends as they were (SB3). (CONSAC; the two
	 * generations differ here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss HerForm = EConsacValueLoss::Sb3;

	/** Normalise observations by their running moments. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormObs = false;

	/** Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormReward = false;

	/** Largest normalised observation. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000001", ClampMax="1000000000"))
	double ClipObs = 10.0;

	/** Largest scaled reward. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double ClipReward = 10.0;

	/** Added to variances. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double NormEpsilon = 1e-8;

	virtual FString GetAlgorithm() const override;
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const override;
};

/**
 * Hyperparameters of td3: twin delayed deterministic policy gradient for Box actions, as in Stable Baselines3 or,
 * with the preset sb2, 2.10.2.
 */
UCLASS(BlueprintType)
class CONSAC_API UConsacTd3Hyperparameters : public UConsacHyperparameters
{
	GENERATED_BODY()

public:
	/** The optimiser's step size. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule LearningRate = FConsacSchedule(1e-3, false);

	/** Transitions of a gradient step. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 BatchSize = 256;

	/** Steps of each agent, or episodes, between rounds of learning. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 TrainFreq = 1;

	/** Of each round; -1: one for every transition since the last. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 GradientSteps = 1;

	/** Discount per step. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Gamma = 0.99;

	/** Transitions that are remembered, of all agents together. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 BufferSize = 1000000;

	/** Agent steps before the first gradient. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000000"))
	int32 LearningStarts = 100;

	/** Steps that a target looks ahead. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 NSteps = 1;

	/** What train_freq counts. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTrainFreqUnit TrainFreqUnit = EConsacTrainFreqUnit::Step;

	/**
	 * A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTruncation Truncation = EConsacTruncation::Bootstrap;

	/** Share of the target network that an update replaces. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Tau = 0.005;

	/** Whose names the logs have. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss LogKeys = EConsacValueLoss::Sb3;

	/** Gradient steps of the critics for one of the actor and the targets. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 PolicyDelay = 2;

	/** Deviation of the noise on the target's actions, which go from -1 to 1. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double TargetPolicyNoise = 0.2;

	/** That noise is clipped to this. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double TargetNoiseClip = 0.5;

	/** Noise that is added to actions while learning. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActionNoise ActionNoise = EConsacActionNoise::None;

	/** Its deviation, where actions go from -1 to 1. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseStd = 0.1;

	/** Its mean, or what it is drawn back to. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1000000", ClampMax="1000000"))
	double NoiseMean = 0.0;

	/** Ornstein_uhlenbeck: how strongly it is drawn back. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseTheta = 0.15;

	/** Ornstein_uhlenbeck: time of a step. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseDt = 0.01;

	/** Probability of a uniform action. (Stable Baselines 2.10.2, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double RandomExploration = 0.0;

	/** Whose form of Adam. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacOptimizer Optimizer = EConsacOptimizer::Pytorch;

	/** Adam's epsilon. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double AdamEpsilon = 1e-8;

	/**
	 * Kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the observation needs.
	 * (Stable Baselines3, TD3)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacDqnPolicy Policy = EConsacDqnPolicy::Auto;

	/** Widths of hidden layers of actor and critics, or dict(pi=[...], qf=[...]). (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString NetArch = TEXT("[400, 300]");

	/** Activation of hidden layers. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActFun ActivationFn = EConsacActFun::Relu;

	/** Hidden layers are normalised before their activation. (Stable Baselines 2.10.2, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bLayerNorm = false;

	/** How weights start. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacInit Init = EConsacInit::Pytorch;

	/** Critics; targets take the least of what theirs say. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="10"))
	int32 NCritics = 2;

	/** Draw what is remembered as it was, or also as if other goals had been meant (HER). (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacReplayBufferClass ReplayBufferClass = EConsacReplayBufferClass::ReplayBuffer;

	/** HER: transitions drawn with another goal for each with its own. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	int32 NSampledGoal = 4;

	/** HER: whose goal, of later in the episode, its end, any of it, any episode. (Stable Baselines3, TD3) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacGoalSelectionStrategy GoalSelectionStrategy = EConsacGoalSelectionStrategy::Future;

	/**
	 * HER: goals from before a step and no ends (SB2), or from after it and ends as they were (SB3). (CONSAC; the two
	 * generations differ here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss HerForm = EConsacValueLoss::Sb3;

	/** Normalise observations by their running moments. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormObs = false;

	/** Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormReward = false;

	/** Largest normalised observation. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000001", ClampMax="1000000000"))
	double ClipObs = 10.0;

	/** Largest scaled reward. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double ClipReward = 10.0;

	/** Added to variances. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double NormEpsilon = 1e-8;

	virtual FString GetAlgorithm() const override;
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const override;
};

/**
 * Hyperparameters of ddpg: deep deterministic policy gradient for Box actions, as in Stable Baselines3 or, with
 * the preset sb2, 2.10.2.
 */
UCLASS(BlueprintType)
class CONSAC_API UConsacDdpgHyperparameters : public UConsacHyperparameters
{
	GENERATED_BODY()

public:
	/** Discount per step. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Gamma = 0.99;

	/** Transitions that are remembered, of all agents together. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 BufferSize = 1000000;

	/** Agent steps before the first gradient. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000000"))
	int32 LearningStarts = 100;

	/** Steps that a target looks ahead. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 NSteps = 1;

	/** What train_freq counts. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTrainFreqUnit TrainFreqUnit = EConsacTrainFreqUnit::Step;

	/**
	 * A cut episode goes on in the value estimate (SB3), or counts as ended (SB2). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacTruncation Truncation = EConsacTruncation::Bootstrap;

	/** Share of the target network that an update replaces. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double Tau = 0.005;

	/** Whose names the logs have. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss LogKeys = EConsacValueLoss::Sb3;

	/** Transitions of a gradient step. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000"))
	int32 BatchSize = 256;

	/** Step size of the critic. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FConsacSchedule LearningRate = FConsacSchedule(1e-3, false);

	/** Whether actor_lr is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetActorLr = false;

	/** Step size of the actor; none: the critic's. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(EditCondition="bSetActorLr"))
	FConsacSchedule ActorLr = FConsacSchedule(0.0, false);

	/** Steps of each agent, or episodes, between rounds of learning. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 TrainFreq = 1;

	/** Of each round; -1: one for every transition since the last. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1", ClampMax="1000000000"))
	int32 GradientSteps = 1;

	/** Whether clip_norm is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetClipNorm = false;

	/** The norm of each tensor's gradient is clipped to this. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetClipNorm"))
	double ClipNorm = 0.0;

	/** Weight of half the squares of the critic's hidden weights. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double CriticL2Reg = 0.0;

	/** Factor of rewards. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double RewardScale = 1.0;

	/** The critic learns values by their running moments; with enable_popart. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormalizeReturns = false;

	/** Those are followed, and the critic's last layer with them. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bEnablePopart = false;

	/** Whether return_range is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetReturnRange = false;

	/** What the critic says and learns is clipped to plus and minus this. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", EditCondition="bSetReturnRange"))
	double ReturnRange = 0.0;

	/**
	 * The actor learns by the critic of before its step (SB2), or of after (SB3). (CONSAC; the two generations differ
	 * here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActorStep ActorStep = EConsacActorStep::AfterCritic;

	/** Hidden layers of the critic that read the observation alone. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="64"))
	int32 ActionLayer = 0;

	/** Whether output_bound is set at all. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(InlineEditConditionToggle))
	bool bSetOutputBound = false;

	/** Initial outputs have weights within this; none: as the rest. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000", EditCondition="bSetOutputBound"))
	double OutputBound = 0.0;

	/** Explore by noise in the actor's parameters. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bParamNoise = false;

	/** Its deviation at the start. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000000000000000000000000000001", ClampMax="1000"))
	double ParamNoiseStddev = 0.1;

	/** How far it shall move actions, which go from -1 to 1. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="2"))
	double DesiredActionStddev = 0.1;

	/** Factor by which its deviation grows or shrinks. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="10"))
	double AdoptionCoefficient = 1.01;

	/** Gradient steps between two of those. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="1000000000"))
	int32 ParamNoiseAdaptionInterval = 50;

	/** Noise that is added to actions while learning. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActionNoise ActionNoise = EConsacActionNoise::None;

	/** Its deviation, where actions go from -1 to 1. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseStd = 0.1;

	/** Its mean, or what it is drawn back to. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="-1000000", ClampMax="1000000"))
	double NoiseMean = 0.0;

	/** Ornstein_uhlenbeck: how strongly it is drawn back. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseTheta = 0.15;

	/** Ornstein_uhlenbeck: time of a step. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	double NoiseDt = 0.01;

	/** Probability of a uniform action. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double RandomExploration = 0.0;

	/** Whose form of Adam. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacOptimizer Optimizer = EConsacOptimizer::Pytorch;

	/** Adam's epsilon. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double AdamEpsilon = 1e-8;

	/**
	 * Kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the observation needs.
	 * (Stable Baselines3, DDPG)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacDqnPolicy Policy = EConsacDqnPolicy::Auto;

	/** Widths of hidden layers of actor and critics, or dict(pi=[...], qf=[...]). (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	FString NetArch = TEXT("[400, 300]");

	/** Activation of hidden layers. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacActFun ActivationFn = EConsacActFun::Relu;

	/** Hidden layers are normalised before their activation. (Stable Baselines 2.10.2, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bLayerNorm = false;

	/** How weights start. (CONSAC; the two generations differ here) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacInit Init = EConsacInit::Pytorch;

	/** Critics; targets take the least of what theirs say. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="1", ClampMax="10"))
	int32 NCritics = 1;

	/**
	 * Draw what is remembered as it was, or also as if other goals had been meant (HER). (Stable Baselines3, DDPG)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacReplayBufferClass ReplayBufferClass = EConsacReplayBufferClass::ReplayBuffer;

	/** HER: transitions drawn with another goal for each with its own. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1000000"))
	int32 NSampledGoal = 4;

	/** HER: whose goal, of later in the episode, its end, any of it, any episode. (Stable Baselines3, DDPG) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacGoalSelectionStrategy GoalSelectionStrategy = EConsacGoalSelectionStrategy::Future;

	/**
	 * HER: goals from before a step and no ends (SB2), or from after it and ends as they were (SB3). (CONSAC; the two
	 * generations differ here)
	 */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	EConsacValueLoss HerForm = EConsacValueLoss::Sb3;

	/** Normalise observations by their running moments. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormObs = false;

	/** Scale rewards by the running deviation of the return. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters")
	bool bNormReward = false;

	/** Largest normalised observation. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0.000001", ClampMax="1000000000"))
	double ClipObs = 10.0;

	/** Largest scaled reward. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0"))
	double ClipReward = 10.0;

	/** Added to variances. (Stable Baselines, VecNormalize) */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Hyperparameters", meta=(ClampMin="0", ClampMax="1"))
	double NormEpsilon = 1e-8;

	virtual FString GetAlgorithm() const override;
	virtual void Collect(TArray<FConsacHyperparameter>& Into) const override;
};
