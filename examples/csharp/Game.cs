// A game for Engine.cs: a puck on a line is to be pushed to the middle and held there.
//   mcs -langversion:7 -out:engine.exe Game.cs Engine.cs Protocol2.cs && mono engine.exe [port] [worlds]
//   consac train tcp://127.0.0.1:5005 --steps 30000
using System;
using System.Threading;

namespace Consac {

/// The game: one puck.
public sealed class Puck {
  public const int Limit = 50;                     // steps of an episode
  public const int RowBytes = 8, ActionBytes = 4;  // of an observation, of an action
  public float Place, Speed;
  Random random;
  int steps;
  /// SPEC of so many worlds.
  public static string Spec(int worlds) {
    return "{\"id\":\"puck-v0\",\"environments\":" + worlds + ",\"max_episode_steps\":" + Puck.Limit + ",\"deterministic\":true,\"behaviours\":[" +
        "{\"name\":\"default\",\"agents\":[\"puck\"],\"observation\":{\"type\":\"box\",\"shape\":[2],\"dtype\":\"F32\",\"low\":[-2,-1],\"high\":[2,1]}," +
        "\"action\":{\"type\":\"box\",\"shape\":[1],\"dtype\":\"F32\",\"low\":-1,\"high\":1}," +
        "\"observation_row\":{\"bytes\":8,\"leaves\":[{\"path\":\"\",\"dtype\":\"F32\",\"count\":2,\"offset\":0}]}," +
        "\"action_row\":{\"bytes\":4,\"leaves\":[{\"path\":\"\",\"dtype\":\"F32\",\"count\":1,\"offset\":0}]}}]}";
  }
  public byte[] Row() {
    var row = new byte[RowBytes];
    Buffer.BlockCopy(new[] {Place, Speed}, 0, row, 0, RowBytes);
    return row;
  }
  public Puck(int seed) { Seed(seed); }
  public void Seed(long seed) { random = new Random((int)(seed % int.MaxValue)); }
  public void Begin() {
    Place = (float)(2 * random.NextDouble() - 1);
    Speed = 0;
    steps = 0;
  }
  /// `push` is -1 to 1. True when the episode is over: terminated where the puck has left the line.
  public bool Step(float push, out double reward, out bool terminated) {
    Speed = 0.8f * Speed + 0.1f * push;
    Place += Speed;
    terminated = Math.Abs(Place) > 1.5f;
    reward = terminated ? -10 : 0.2 - Math.Abs(Place);
    return ++steps == Limit || terminated;
  }
}

public static class Program {
  public static void Main(string[] arguments) {
    var engine = new Engine(arguments.Length > 0 ? int.Parse(arguments[0]) : 5005, arguments.Length > 1 ? int.Parse(arguments[1]) : 8);
    Console.WriteLine("listening on tcp://127.0.0.1:" + engine.Port);
    while (true) {
      for (int quiet = 0; quiet < 2000; ++quiet) if (engine.Poll()) quiet = 0;  // a game would draw meanwhile
      Thread.Sleep(1);
    }
  }
}
}
