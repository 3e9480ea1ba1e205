// Copyright CONSAC authors. MIT License.
#include "ConsacStats.h"

#include "Stats/Stats.h"

DECLARE_STATS_GROUP(TEXT("Consac"), STATGROUP_Consac, STATCAT_Advanced);
DECLARE_FLOAT_ACCUMULATOR_STAT(TEXT("Steps of agents in a second"), STAT_ConsacStepsPerSecond, STATGROUP_Consac);
DECLARE_FLOAT_ACCUMULATOR_STAT(TEXT("Milliseconds of a step"), STAT_ConsacPollMilliseconds, STATGROUP_Consac);
DECLARE_FLOAT_ACCUMULATOR_STAT(TEXT("Mean reward of an episode"), STAT_ConsacMeanReward, STATGROUP_Consac);

void ConsacPlugin::ShowStats(const FConsacProgress& Progress)
{
	SET_FLOAT_STAT(STAT_ConsacStepsPerSecond, Progress.StepsPerSecond);
	SET_FLOAT_STAT(STAT_ConsacPollMilliseconds, Progress.PollMilliseconds);
	SET_FLOAT_STAT(STAT_ConsacMeanReward, Progress.MeanEpisodeReward);
}
