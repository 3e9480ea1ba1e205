// What these examples need of consac.h, for C# 7 (Mono, Unity). A call that fails throws what consac_last_error says.
using System;
using System.Runtime.InteropServices;
using System.Text;

namespace ConsacNative {

public sealed class ConsacException : Exception {
  public ConsacException(string message) : base(message) {}
}

static class Native {
  const string Library = "consac";  // libconsac.so, consac.dll, libconsac.dylib
  public const int Observation = 0, Action = 1;
  public const int Wait = 0, Reset = 1, Act = 2;
  public const int GoesOn = 0, Terminated = 1, Truncated = 2;

  [StructLayout(LayoutKind.Sequential)]
  public struct Training {
    public UIntPtr Size;
    public IntPtr Algorithm, Hyperparameters;
    public long TotalSteps;
    public ulong Seed;
    public int AgentsGoOn;
    public IntPtr StartFrom;
    public UIntPtr StartFromCount;
  }
  [StructLayout(LayoutKind.Sequential)]
  public struct Progress {
    public UIntPtr Size;
    public IntPtr State;
    public long Steps, TotalSteps, Updates, AllSteps, Episodes, Sessions;
    public double MeanEpisodeReward, MeanEpisodeLength, StepsPerSecond, PollSeconds;
  }
  /// A model's handle; the collector frees it.
  public sealed class ModelHandle : SafeHandle {
    ModelHandle() : base(IntPtr.Zero, true) {}
    public override bool IsInvalid { get { return handle == IntPtr.Zero; } }
    protected override bool ReleaseHandle() { consac_model_free(handle); return true; }
  }
  /// A world's.
  public sealed class WorldHandle : SafeHandle {
    WorldHandle() : base(IntPtr.Zero, true) {}
    public override bool IsInvalid { get { return handle == IntPtr.Zero; } }
    protected override bool ReleaseHandle() { consac_world_free(handle); return true; }
  }

  [DllImport(Library)] public static extern uint consac_abi_version();
  [DllImport(Library)] static extern IntPtr consac_last_error();
  [DllImport(Library)] public static extern int consac_model_load(byte[] path, out ModelHandle model);
  [DllImport(Library)] static extern void consac_model_free(IntPtr model);
  [DllImport(Library)] public static extern int consac_model_act(ModelHandle model, float[] seen, UIntPtr seenSize, int[] done, UIntPtr doneSize);
  [DllImport(Library)] public static extern int consac_world_new(byte[] id, out WorldHandle world);
  [DllImport(Library)] static extern void consac_world_free(IntPtr world);
  [DllImport(Library)] public static extern int consac_world_add_behaviour(WorldHandle world, byte[] name, int agents, out int behaviour);
  [DllImport(Library)] public static extern int consac_world_add_numbers(WorldHandle world, int behaviour, int rows, byte[] name, long count, double low, double high);
  [DllImport(Library)] public static extern int consac_world_add_discrete(WorldHandle world, int behaviour, int rows, byte[] name, long n, long start);
  [DllImport(Library)] public static extern int consac_world_set_time_limit(WorldHandle world, long steps);
  [DllImport(Library)] public static extern int consac_world_train(WorldHandle world, ref Training training);
  [DllImport(Library)] public static extern int consac_world_poll(WorldHandle world, double wait, out int cue);
  [DllImport(Library)] public static extern int consac_world_offer(WorldHandle world);
  [DllImport(Library)] public static extern IntPtr consac_agent_observation(WorldHandle world, int agent);
  [DllImport(Library)] public static extern IntPtr consac_agent_final_observation(WorldHandle world, int agent);
  [DllImport(Library)] public static extern IntPtr consac_agent_action(WorldHandle world, int agent);
  [DllImport(Library)] public static extern int consac_agent_add_reward(WorldHandle world, int agent, float reward);
  [DllImport(Library)] public static extern int consac_agent_end_episode(WorldHandle world, int agent, int end);
  [DllImport(Library)] public static extern int consac_agent_is_ending(WorldHandle world, int agent);
  [DllImport(Library)] public static extern int consac_agent_resets(WorldHandle world, int agent);
  [DllImport(Library)] public static extern int consac_world_finished(WorldHandle world);
  [DllImport(Library)] public static extern int consac_world_progress(WorldHandle world, ref Progress progress);
  [DllImport(Library)] public static extern int consac_world_save_model(WorldHandle world, int behaviour, byte[] path);

  /// Throws what went wrong, if anything did.
  public static void Check(int status) {
    if (status != 0) throw new ConsacException(TextOf(consac_last_error()));
  }
  /// UTF-8 with its end, as consac.h has text.
  public static byte[] Text(string text) { return Encoding.UTF8.GetBytes(text + "\0"); }
  public static string TextOf(IntPtr text) {
    int size = 0;
    while (Marshal.ReadByte(text, size) != 0) ++size;
    var bytes = new byte[size];
    Marshal.Copy(text, bytes, 0, size);
    return Encoding.UTF8.GetString(bytes);
  }
}

}  // namespace ConsacNative
