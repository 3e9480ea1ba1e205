// An engine of protocol 2 in C# 7, as a game would have it (spec/protocol2_engine.md): no thread, a socket that is looked at once a tick.
// In Unity, make an Engine in Start and call Poll in FixedUpdate; what it knows of the game is in Puck (Game.cs).
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Net;
using System.Net.Sockets;
using System.Text;

namespace Consac {

/// One session after another over one port.
public sealed class Engine {
  const int RowBytes = Puck.RowBytes, ActionBytes = Puck.ActionBytes;
  enum Phase { Hello, Configure, Reset, Step, Over }

  readonly TcpListener listener;
  readonly int worlds, head, rewards, states, size;
  readonly Puck[] pucks;
  readonly byte[] result, incoming = new byte[65536];
  readonly string spec;
  Socket socket;
  FrameReader reader;
  Phase phase;
  uint session;
  ulong last;
  byte[] answer;
  DateTime since, heard;

  public Engine(int port, int worlds) {
    this.worlds = worlds;
    head = Align(8 + worlds);
    rewards = Align(8 + worlds * RowBytes);
    states = rewards + 8 * worlds;
    size = Align(states + worlds);
    result = new byte[size];
    pucks = Enumerable.Range(0, worlds).Select(i => new Puck(i)).ToArray();
    spec = Puck.Spec(worlds);
    listener = new TcpListener(IPAddress.Loopback, port);
    listener.Start();
  }
  public int Port { get { return ((IPEndPoint)listener.LocalEndpoint).Port; } }
  static int Align(int offset) { return (offset + 7) & ~7; }

  /// What is due now, without waiting: once a tick. False when nothing came.
  public bool Poll() {
    if (socket == null && !Accept()) return false;
    try {
      if (phase < Phase.Reset && DateTime.UtcNow - since > TimeSpan.FromSeconds(5)) phase = Phase.Over;
      if (phase == Phase.Over) { Leave(); return true; }
      if (!socket.Poll(0, SelectMode.SelectRead)) {
        if (listener.Pending() && !socket.Poll(0, SelectMode.SelectRead) && !Door.TurnAway(listener, heard)) phase = Phase.Over;
        return false;
      }
      int count = socket.Receive(incoming);
      if (count == 0) { Leave(); return true; }
      heard = DateTime.UtcNow;
      reader.Feed(incoming, count);
      while (phase != Phase.Over && reader.Next(out var arrived)) Handle(arrived);
    } catch (Refused refused) { Refuse(refused, reader.Request);
    } catch (SocketException) { Leave(); }
    return true;
  }

  bool Accept() {
    if (!listener.Pending()) return false;
    socket = listener.AcceptSocket();
    socket.NoDelay = true;
    socket.SendTimeout = 10000;
    reader = new FrameReader();
    phase = Phase.Hello;
    last = 0;
    answer = null;
    since = heard = DateTime.UtcNow;
    return true;
  }
  /// What was said last arrives, though the trainer may be sending.
  void Leave() {
    try { socket.Shutdown(SocketShutdown.Send); } catch (SocketException) { }
    while (socket.Poll(50000, SelectMode.SelectRead)) {
      try { if (socket.Receive(incoming) == 0) break; } catch (SocketException) { break; }
    }
    socket.Close();
    socket = null;
  }

  byte[] Send(FrameType type, ulong request, byte[] payload) {
    byte[] bytes = FrameReader.Pack(type, request, phase == Phase.Hello ? 0 : session, payload);
    socket.Send(bytes);
    return bytes;
  }
  byte[] Refuse(Refused refused, ulong request) {
    bool ends = refused.EndsConnection || phase == Phase.Hello;
    string text = "{\"code\":\"" + refused.Code + "\",\"severity\":\"" + (ends ? "connection" : "request") + "\",\"message\":" + Json.Quote(Names.Cut(refused.Message)) +
        (refused.Env >= 0 ? ",\"env\":" + refused.Env : "") + (refused.Path != null ? ",\"path\":" + Json.Quote(Names.Cut(refused.Path)) : "") +
        (refused.Code == "UNSUPPORTED_VERSION" ? ",\"protocol\":[2,2]}" : "}");
    byte[] bytes = Send(FrameType.Error, request, Encoding.UTF8.GetBytes(text));
    if (ends) phase = Phase.Over;
    return bytes;
  }

  void Handle(Arrived frame) {
    if (frame.Type == FrameType.Pong || ((ushort)frame.Type & 0x8000) != 0) return;
    if (frame.Type == FrameType.Bye) { phase = Phase.Over; return; }
    if (phase == Phase.Hello) { Hello(frame); return; }
    if (frame.Type == FrameType.Ping) {
      if (frame.Payload.Length > 64) throw new Refused("MALFORMED", "a PING of more than 64 bytes");
      Send(FrameType.Pong, 0, frame.Payload);
      return;
    }
    bool foreign = frame.Type == FrameType.Hello || (frame.Session != 0 && frame.Session != session), repeated = frame.Request == last && answer != null;
    if (foreign || (frame.Request != last + 1 && !repeated)) {
      Refuse(new Refused("BAD_STATE", "request " + frame.Request + " of session " + frame.Session), frame.Request);
      return;
    }
    if (repeated) { socket.Send(answer); return; }
    last = frame.Request;
    try { answer = CarryOut(frame); } catch (Refused refused) { answer = Refuse(refused, frame.Request); }
  }

  void Hello(Arrived frame) {
    if (frame.Type != FrameType.Hello) throw new Refused("BAD_STATE", "HELLO comes first");
    var said = Json.Read(frame.Payload);
    var range = Json.Member<List<object>>(said, "protocol", null);
    if (range == null || range.Count != 2 || !range.All(bound => bound is long)) throw new Refused("MALFORMED", "HELLO without protocol");
    if ((long)range[0] > 2 || (long)range[1] < 2) throw new Refused("UNSUPPORTED_VERSION", "this engine speaks 2");
    if (Json.Member(said, "capabilities", new List<object>()).Any(capability => !(capability is string))) throw new Refused("MALFORMED", "capabilities are texts");
    Json.Member(said, "token", Json.Member(said, "client", ""));
    if (Json.Member(said, "resume", "") != "") throw new Refused("AUTH_FAILED", "sessions end with their connection");
    long limit = Json.Member<long>(said, "max_frame", FrameReader.LastLimit);
    reader.Limit = (int)Math.Min(Math.Max(limit, FrameReader.FirstLimit), FrameReader.LastLimit);
    ++session;
    phase = Phase.Configure;
    Send(FrameType.Welcome, 0, Encoding.UTF8.GetBytes("{\"protocol\":2,\"server\":\"Engine.cs\",\"session\":" + session + ",\"capabilities\":[],\"max_frame\":" + reader.Limit + "}"));
  }

  byte[] CarryOut(Arrived frame) {
    bool fits = true;
    switch (frame.Type) {
      case FrameType.Configure: fits = phase == Phase.Configure || phase == Phase.Reset; break;
      case FrameType.Reset: fits = phase == Phase.Reset || phase == Phase.Step; break;
      case FrameType.Step: fits = phase == Phase.Step; break;
      case FrameType.Render: throw new Refused("UNSUPPORTED", "this engine draws nothing");
      default: throw new Refused("UNKNOWN_MESSAGE", "type " + (int)frame.Type);
    }
    if (!fits) throw new Refused("BAD_STATE", frame.Type + " does not belong here");
    if (frame.Type == FrameType.Configure) return Send(FrameType.Spec, frame.Request, Configure(Json.Read(frame.Payload)));
    return Send(FrameType.Result, frame.Request, frame.Type == FrameType.Reset ? Reset(frame.Payload) : Step(frame.Payload));
  }

  byte[] Configure(Dictionary<string, object> said) {
    string autoreset = Json.Member(said, "autoreset", "same_step"), transport = Json.Member(said, "transport", "tcp");
    var expected = Json.Member<List<object>>(said, "expect", null);
    Names.Check(expected);
    if (autoreset != "same_step" || transport != "tcp") throw new Refused("UNSUPPORTED", "same_step and tcp only");
    byte[] offer = Encoding.UTF8.GetBytes(spec);
    string path = expected == null ? null : Json.Difference(expected, Json.Read(offer)["behaviours"], "behaviours");
    if (path != null) throw new Refused("SPEC_MISMATCH", path + " is another; the engine offers " + spec, -1, path);
    if (Math.Max(offer.Length, size + worlds * (RowBytes + 64) + 64) > reader.Limit) throw new Refused("UNSUPPORTED", "SPEC or RESULT does not fit into max_frame");
    phase = Phase.Reset;
    return offer;
  }

  /// RESET's and STEP's first words (R42), and their byte for each world (R43).
  static uint Words(byte[] payload, uint flags) {
    if (payload.Length < 8) throw new Refused("WRONG_SIZE", payload.Length + " bytes");
    if ((BitConverter.ToUInt32(payload, 0) & ~flags) != 0 || BitConverter.ToUInt32(payload, 4) != 0) throw new Refused("MALFORMED", "unknown flags are 0");
    return BitConverter.ToUInt32(payload, 0);
  }
  void CheckChosen(byte[] payload) {
    for (int env = 0; env < worlds; ++env)
      if (payload[8 + env] > 1) throw new Refused("OUT_OF_RANGE", payload[8 + env] + " for environment " + env, env);
  }
  byte[] Reset(byte[] payload) {
    uint flags = Words(payload, 3);
    bool seeded = (flags & 1) != 0, options = (flags & 2) != 0;
    int text = head + (seeded ? 8 * worlds : 0) + 4;
    uint length = options && payload.Length >= text ? BitConverter.ToUInt32(payload, text - 4) : 0;
    if (payload.Length != (options ? ((long)text + length + 7) & ~7L : text - 4)) throw new Refused("WRONG_SIZE", "RESET of " + payload.Length + " bytes");
    CheckChosen(payload);
    for (int env = 0; env < worlds && seeded; ++env)
      if (payload[8 + env] == 1 && BitConverter.ToInt64(payload, head + 8 * env) < 0) throw new Refused("OUT_OF_RANGE", "a negative seed", env);
    if (options) Json.Read(payload, text, (int)length);
    if (phase == Phase.Reset && Enumerable.Range(0, worlds).Any(env => payload[8 + env] == 0)) throw new Refused("BAD_STATE", "the first RESET is of every environment");
    phase = Phase.Step;
    for (int env = 0; env < worlds; ++env) {
      if (payload[8 + env] == 1) {
        if (seeded) pucks[env].Seed(BitConverter.ToInt64(payload, head + 8 * env));
        pucks[env].Begin();
      }
      Tell(env, 0, payload[8 + env] == 1 ? 24 : result[states + env] & 24);
    }
    return Finish(new byte[0], "");
  }
  byte[] Step(byte[] payload) {
    Words(payload, 0);
    if (payload.Length != Align(head + worlds * ActionBytes)) throw new Refused("WRONG_SIZE", "STEP of " + payload.Length + " bytes");
    CheckChosen(payload);
    for (int env = 0; env < worlds; ++env) {
      float push = BitConverter.ToSingle(payload, head + ActionBytes * env);
      if (payload[8 + env] == 0 || (push >= -1 && push <= 1)) continue;
      throw new Refused(float.IsNaN(push) || float.IsInfinity(push) ? "NON_FINITE" : "OUT_OF_RANGE", "a push outside -1 to 1", env);
    }
    var finals = new MemoryStream();
    var ended = new List<int>();
    var places = new List<string>();
    for (int env = 0; env < worlds; ++env) {
      double reward = 0;
      int state = result[states + env] & 24;
      if (payload[8 + env] == 1) {
        bool terminated, over = pucks[env].Step(BitConverter.ToSingle(payload, head + ActionBytes * env), out reward, out terminated);
        state = !over ? 16 : terminated ? 29 : 30;
        if (over) {
          finals.Write(pucks[env].Row(), 0, RowBytes);
          ended.Add(env);
          places.Add(pucks[env].Place.ToString("R", CultureInfo.InvariantCulture));
          pucks[env].Begin();
        }
      }
      Tell(env, reward, state);
    }
    string infos = ended.Count == 0 ? "" : "{\"final_infos\":{\"place\":{\"slots\":[" + string.Join(",", ended) + "],\"values\":[" + string.Join(",", places) + "]}}}";
    return Finish(finals.ToArray(), infos);
  }

  void Tell(int env, double reward, int state) {
    Buffer.BlockCopy(pucks[env].Row(), 0, result, 8 + RowBytes * env, RowBytes);
    Buffer.BlockCopy(BitConverter.GetBytes(reward), 0, result, rewards + 8 * env, 8);
    result[states + env] = (byte)state;
  }
  /// RESULT: what is always there, final rows, infos.
  byte[] Finish(byte[] finals, string infos) {
    byte[] text = Encoding.UTF8.GetBytes(infos);
    int at = Align(size + finals.Length);
    var payload = new byte[text.Length > 0 ? Align(at + 4 + text.Length) : at];
    result[0] = (byte)((finals.Length > 0 ? 1 : 0) | (text.Length > 0 ? 2 : 0));
    Buffer.BlockCopy(result, 0, payload, 0, size);
    Buffer.BlockCopy(finals, 0, payload, size, finals.Length);
    if (text.Length > 0) Buffer.BlockCopy(BitConverter.GetBytes(text.Length), 0, payload, at, 4);
    Buffer.BlockCopy(text, 0, payload, Math.Min(at + 4, payload.Length), text.Length);
    return payload;
  }
}
}
