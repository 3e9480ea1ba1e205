// Copyright CONSAC authors. MIT License.
#include "ConsacPanelState.h"

namespace ConsacPanelWords
{

FString Ago(double Seconds)
{
	constexpr double Minute = 60.0;
	constexpr double Hour = 60.0 * Minute;
	constexpr double Day = 24.0 * Hour;
	if (Seconds < Minute)
	{
		return TEXT("just now");
	}
	if (Seconds < Hour)
	{
		return FString::Printf(TEXT("%d min ago"), static_cast<int32>(Seconds / Minute));
	}
	if (Seconds < Day)
	{
		return FString::Printf(TEXT("%d h ago"), static_cast<int32>(Seconds / Hour));
	}
	return Seconds < 2.0 * Day ? FString(TEXT("1 day ago")) : FString::Printf(TEXT("%d days ago"), static_cast<int32>(Seconds / Day));
}

static FString Lines(const FString& Text, const FString& Line)
{
	return Text.IsEmpty() ? Line : FString::Printf(TEXT("%s\n%s"), *Text, *Line);
}

static FString Trainer(const FConsacPanelTrainer& Row)
{
	const FConsacProgress& Progress = Row.Progress;
	const FString Stands = Row.bWaitsForTurn ? FString(TEXT("waits for its turn: another one drives the agents"))
		: !Progress.State.IsEmpty() ? Progress.State : FString(TEXT("has not begun"));
	FString Text = FString::Printf(TEXT("%s (%s): %s"), *Row.Name, *Row.Mode, *Stands);
	if (!Row.bRuns && !Progress.State.IsEmpty())
	{
		Text = FString::Printf(TEXT("%s; stopped"), *Text);
	}
	if (Progress.Steps > 0)
	{
		const FString Of = Progress.TotalSteps > 0 ? FString::Printf(TEXT(" of %lld"), Progress.TotalSteps) : FString();
		Text = FString::Printf(TEXT("%s\nstep %lld%s, %lld episodes"), *Text, Progress.Steps, *Of, Progress.Episodes);
	}
	if (Progress.Episodes > 0)
	{
		Text = FString::Printf(TEXT("%s, mean reward %.3g over %.0f steps"), *Text, static_cast<double>(Progress.MeanEpisodeReward), static_cast<double>(Progress.MeanEpisodeLength));
	}
	return Text;
}

FString State(const FConsacPanelState& Panel)
{
	if (!Panel.bPlays)
	{
		return Panel.bLevelHasTrainer ? TEXT("Nothing plays. Press Play: the Consac Trainer of this level then begins, or Start begins it.")
			: TEXT("Nothing plays, and this level has no Consac Trainer. Tools > Consac > New Hello Level makes a level that learns; in a level of your own place a Consac Trainer (Place Actors), and actors with a Consac Agent.");
	}
	if (Panel.Trainers.IsEmpty())
	{
		return TEXT("The game plays without a Consac Trainer and without a Consac Environment: nobody trains.");
	}
	FString Text;
	for (const FConsacPanelTrainer& Row : Panel.Trainers)
	{
		Text = Lines(Text, Trainer(Row));
	}
	return Text;
}

FString Curve(const FConsacPanelState& Panel)
{
	const TArray<FConsacCurvePoint> Points = Panel.Curve.GetPoints();
	if (Points.Num() < 2)
	{
		return TEXT("Mean reward of an episode, over steps: the curve comes once episodes have ended.");
	}
	return FString::Printf(TEXT("Mean reward of an episode, from step %lld to %lld: lowest %.3g, highest %.3g, now %.3g"), Points[0].Steps, Points[Points.Num() - 1].Steps,
		static_cast<double>(Panel.Curve.GetLowest()), static_cast<double>(Panel.Curve.GetHighest()), static_cast<double>(Points[Points.Num() - 1].Reward));
}

FString Speed(const FConsacPanelState& Panel)
{
	if (Panel.Trainers.IsEmpty() || Panel.Times.Frames == 0)
	{
		return FString();
	}
	const FConsacPanelTrainer& First = Panel.Trainers[0];
	const FConsacFrameTimes& Times = Panel.Times;
	return FString::Printf(TEXT("%.0f steps/s of %d agents, %.0f frames/s\na frame takes %.2f ms: %.2f ms the game's tick, %.2f ms drawing and the editor; the latest decision %.3f ms"),
		static_cast<double>(First.Progress.StepsPerSecond), First.Agents, 1000.0 / Times.Frame, Times.Frame, Times.Worlds, Times.Frame - Times.Worlds,
		static_cast<double>(First.Progress.PollMilliseconds));
}

FString Slow(const FConsacPanelState& Panel)
{
	if (Panel.Trainers.IsEmpty() || !Panel.Trainers[0].bRuns)
	{
		return FString();
	}
	const FConsacPanelTrainer& First = Panel.Trainers[0];
	if (First.Progress.TotalSteps > 0 && First.Progress.Steps >= First.Progress.TotalSteps)
	{
		return FString(); // nothing is waited for any more
	}
	const FConsacFrameTimes& Times = Panel.Times;
	if (First.Port != 0 && First.Progress.Steps == 0)
	{
		return FString::Printf(TEXT("Nobody trains yet: Start Program, or consac train tcp://127.0.0.1:%d in a terminal."), First.Port);
	}
	if (Times.Frames == 0 || Times.Frame <= 0.0)
	{
		return FString();
	}
	const double Decision = static_cast<double>(First.Progress.PollMilliseconds);
	const double Around = Times.Frame - Times.Worlds;
	if (2.0 * Around > Times.Frame)
	{
		const FString Helps = First.bFullSpeed ? TEXT("a small viewport helps, and Max Steps Per Tick where an action is complete when On Action returns")
			: TEXT("Full Speed of the trainer is off, so frames may wait for the screen; a small viewport helps too");
		return FString::Printf(TEXT("Most of a frame, %.0f %%, is drawing and the editor: %s."), 100.0 * Around / Times.Frame, *Helps);
	}
	if (2.0 * Decision > Times.Worlds)
	{
		return FString::Printf(TEXT("Most of the game's tick is the decision, %.3f ms: %s."), Decision,
			First.Port != 0 ? TEXT("the game waits for the trainer's answer; more agents share one wait") : TEXT("a smaller network helps, or Pipelined, which lets models compute while the game goes on"));
	}
	return FString::Printf(TEXT("Most of a frame, %.0f %%, is the game's own tick: its actors, physics and the agents' events."), 100.0 * Times.Worlds / Times.Frame);
}

FString Models(const FConsacPanelState& Panel)
{
	if (Panel.Models.IsEmpty())
	{
		return TEXT("No models below Saved/Consac yet.");
	}
	FString Text = TEXT("Models below Saved/Consac, the latest first:");
	for (const FConsacPanelModel& Model : Panel.Models)
	{
		Text = Lines(Text, FString::Printf(TEXT("%s, %s (%s UTC), %lld KiB"), *Model.File, *Ago((Panel.NowUtc - Model.Changed).GetTotalSeconds()),
			*Model.Changed.ToString(TEXT("%Y-%m-%d %H:%M")), (Model.Bytes + 1023) / 1024));
	}
	return Panel.MoreModels > 0 ? Lines(Text, FString::Printf(TEXT("and %d more"), Panel.MoreModels)) : Text;
}

FString Faults(const FConsacPanelState& Panel)
{
	FString Text;
	for (const FConsacFault& Fault : Panel.Faults)
	{
		const FString Often = Fault.Times > 1 ? FString::Printf(TEXT(", %d times"), Fault.Times) : FString();
		Text = Lines(Text, FString::Printf(TEXT("%s (%s%s): %s"), Fault.bWarning ? TEXT("Warning") : TEXT("Error"), *Ago(Panel.Now - Fault.When), *Often, *Fault.Text));
	}
	return Text;
}

}
