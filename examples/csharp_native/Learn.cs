// A game in C# whose balls learn inside it, through consac.h; then the model acts by itself.
//   mcs -langversion:7 -out:learn.exe Learn.cs Native.cs && mono learn.exe ball.consac
using System;
using System.Runtime.InteropServices;
using ConsacNative;
using static ConsacNative.Native;

static class Learn {
  const int Balls = 4, Limit = 50;

  /// A ball on a line, to be pushed to the middle and held there.
  sealed class Ball {
    static readonly Random random = new Random(1);
    public readonly float[] Row = new float[2];  // place, speed
    public void Begin() {
      Row[0] = (float)(2 * random.NextDouble() - 1);
      Row[1] = 0;
    }
    public float Step(int push) {
      Row[1] = 0.8f * Row[1] + 0.1f * (push - 1);
      Row[0] += Row[1];
      return 1 - Math.Abs(Row[0]);
    }
    public bool Lost { get { return Math.Abs(Row[0]) > 1.5f; } }
  }

  static WorldHandle Describe() {
    Check(consac_world_new(Text("ball-v0"), out WorldHandle world));
    Check(consac_world_add_behaviour(world, Text("ball"), Balls, out int behaviour));
    Check(consac_world_add_numbers(world, behaviour, Observation, Text("ball"), 2, -2, 2));
    Check(consac_world_add_discrete(world, behaviour, Native.Action, Text("push"), 3, 0));
    Check(consac_world_set_time_limit(world, Limit));
    return world;
  }

  /// What the engine does once a tick.
  static void Tick(WorldHandle world, Ball[] balls) {
    Check(consac_world_poll(world, 0.01, out int cue));
    if (cue == Wait) return;
    for (int a = 0; a < Balls; ++a) {
      if (cue == Reset && consac_agent_resets(world, a) != 0) balls[a].Begin();
      if (cue == Act) {
        Check(consac_agent_add_reward(world, a, balls[a].Step(Marshal.ReadInt32(consac_agent_action(world, a)))));
        if (balls[a].Lost) Check(consac_agent_end_episode(world, a, Terminated));
        if (consac_agent_is_ending(world, a) != 0) {
          Marshal.Copy(balls[a].Row, 0, consac_agent_final_observation(world, a), 2);
          balls[a].Begin();
        }
      }
      Marshal.Copy(balls[a].Row, 0, consac_agent_observation(world, a), 2);
    }
    Check(consac_world_offer(world));
  }

  static int Main(string[] arguments) {
    string path = arguments.Length > 0 ? arguments[0] : "ball.consac";
    var balls = new Ball[Balls];
    for (int a = 0; a < Balls; ++a) balls[a] = new Ball();
    try {
      using (WorldHandle world = Describe()) {
        var training = new Training { Size = (UIntPtr)Marshal.SizeOf(typeof(Training)), TotalSteps = 40000, Seed = 1 };
        training.Hyperparameters = Marshal.StringToHGlobalAnsi("n_steps=64; learning_rate=1e-3");
        Check(consac_world_train(world, ref training));
        Marshal.FreeHGlobal(training.Hyperparameters);
        while (consac_world_finished(world) == 0) Tick(world, balls);
        var progress = new Progress { Size = (UIntPtr)Marshal.SizeOf(typeof(Progress)) };
        Check(consac_world_progress(world, ref progress));
        Console.WriteLine("{0}: {1} steps, mean reward {2:F1}", TextOf(progress.State), progress.Steps, progress.MeanEpisodeReward);
        Check(consac_world_save_model(world, 0, Text(path)));
      }
      Check(consac_model_load(Text(path), out ModelHandle model));
      using (model) {
        var ball = new Ball();
        ball.Row[0] = 1;
        var push = new int[1];
        for (int step = 0; step < Limit; ++step) {
          Check(consac_model_act(model, ball.Row, (UIntPtr)8, push, (UIntPtr)4));
          ball.Step(push[0]);
        }
        Console.WriteLine("from 1.00 to {0:F2}", ball.Row[0]);
      }
    } catch (ConsacException error) {
      Console.Error.WriteLine(error.Message);
      return 1;
    }
    return 0;
  }
}
