// What an engine of protocol 2 needs: frames, CRC, JSON. C# 7 with nothing but the base library, as Unity has it. spec/protocol2.md is the law.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Text;
using System.Text.RegularExpressions;

namespace Consac {

public enum FrameType : ushort {
  Hello = 1, Welcome, Configure, Spec, Reset, Step, Result, Error, GoAway, Bye, Ping, Pong, Paused, Resumed, Render, Frame
}

/// Something that the trainer said and should not have; Code as in the table of errors.
public sealed class Refused : Exception {
  public readonly string Code, Path;
  public readonly int Env;  // -1: none
  public Refused(string code, string message, int env = -1, string path = null) : base(message) {
    Code = code;
    Env = env;
    Path = path;
  }
  static readonly HashSet<string> ends = new HashSet<string> {
    "BAD_MAGIC", "MALFORMED", "FRAME_TOO_LARGE", "CRC_MISMATCH", "UNSUPPORTED_VERSION", "AUTH_FAILED", "CAPACITY" };
  public bool EndsConnection { get { return ends.Contains(Code); } }
}

public struct Arrived {
  public FrameType Type;
  public ulong Request;
  public uint Session;
  public byte[] Payload;
}

/// Bytes in, frames out, however they are cut or joined.
public sealed class FrameReader {
  public const int FirstLimit = 4096, LastLimit = 1 << 26;
  const uint Magic = 0x43534EC0;
  public int Limit = FirstLimit;
  public ulong Request;  // number in the latest header; 0 without a magic
  byte[] input = new byte[65536];
  int begin, end;
  static readonly uint[] crcTable = MakeCrcTable();

  public void Feed(byte[] data, int count) {
    if (input.Length - end < count) {
      var larger = end - begin + count > input.Length ? new byte[2 * (end - begin + count)] : input;
      Buffer.BlockCopy(input, begin, larger, 0, end - begin);
      end -= begin;
      begin = 0;
      input = larger;
    }
    Buffer.BlockCopy(data, 0, input, end, count);
    end += count;
  }

  /// False when no whole frame is there yet.
  public bool Next(out Arrived arrived) {
    arrived = new Arrived();
    int there = end - begin;
    if (there >= 4) Request = 0;
    if (there >= 4 && BitConverter.ToUInt32(input, begin) != Magic) throw new Refused("BAD_MAGIC", "no frame of protocol 2");
    if (there < 32) return false;
    arrived.Request = Request = BitConverter.ToUInt64(input, begin + 16);
    int flags = BitConverter.ToUInt16(input, begin + 6);
    uint length = BitConverter.ToUInt32(input, begin + 8);
    if (flags > 1 || BitConverter.ToUInt32(input, begin + 28) != 0) throw new Refused("MALFORMED", "unknown bits of a header are 0");
    if (length > Limit) throw new Refused("FRAME_TOO_LARGE", length + " bytes; at most " + Limit);
    if (there < 32 + length) return false;
    arrived.Type = (FrameType)BitConverter.ToUInt16(input, begin + 4);
    arrived.Session = BitConverter.ToUInt32(input, begin + 24);
    arrived.Payload = new byte[length];
    Buffer.BlockCopy(input, begin + 32, arrived.Payload, 0, (int)length);
    uint crc = BitConverter.ToUInt32(input, begin + 12);
    begin += 32 + (int)length;
    if (flags == 1 && Crc32c(arrived.Payload) != crc) throw new Refused("CRC_MISMATCH", "a payload was changed");
    return true;
  }

  /// A whole frame.
  public static byte[] Pack(FrameType type, ulong request, uint session, byte[] payload) {
    var bytes = new MemoryStream();
    var writer = new BinaryWriter(bytes);  // little-endian everywhere
    writer.Write(Magic);
    writer.Write((ushort)type);
    writer.Write((ushort)0);
    writer.Write(payload.Length);
    writer.Write(0);
    writer.Write(request);
    writer.Write(session);
    writer.Write(0);
    writer.Write(payload);
    return bytes.ToArray();
  }

  static uint[] MakeCrcTable() {
    var table = new uint[256];
    for (uint n = 0; n < 256; ++n) {
      table[n] = n;
      for (int bit = 0; bit < 8; ++bit) table[n] = (table[n] & 1) != 0 ? (table[n] >> 1) ^ 0x82F63B78 : table[n] >> 1;
    }
    return table;
  }
  static uint Crc32c(byte[] bytes) {
    uint crc = 0xFFFFFFFF;
    foreach (byte value in bytes) crc = crcTable[(crc ^ value) & 255] ^ (crc >> 8);
    return crc ^ 0xFFFFFFFF;
  }
}

/// JSON as values: Dictionary, List, string, long (whole), double, bool, null.
public sealed class Json {
  const int Largest = 1 << 20, Deepest = 64;
  static readonly Regex numbers = new Regex(@"\G-?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][+-]?[0-9]+)?");
  readonly string text;
  int at, depth, values;
  Json(string text) { this.text = text; }

  /// One object (R7), or MALFORMED.
  public static Dictionary<string, object> Read(byte[] bytes, int from = 0, int count = -1) {
    if (bytes.Length > Largest) throw new Refused("MALFORMED", "more than 1 MiB of JSON");
    try {
      var json = new Json(new UTF8Encoding(false, true).GetString(bytes, from, count < 0 ? bytes.Length : count));
      var value = json.Value() as Dictionary<string, object>;
      json.Space();
      if (value != null && json.at == json.text.Length) return value;
    } catch (DecoderFallbackException) {
    } catch (FormatException) {
    } catch (EncoderFallbackException) {  // half of a surrogate pair
    } catch (IndexOutOfRangeException) {  // the text is cut
    }
    throw new Refused("MALFORMED", "no JSON object");
  }

  /// A member of its kind (R9), or what holds where it is missing.
  public static T Member<T>(Dictionary<string, object> said, string name, T otherwise) {
    object value;
    if (!said.TryGetValue(name, out value)) return otherwise;
    if (value is T) return (T)value;
    throw new Refused("MALFORMED", name + " is of the wrong type");
  }

  /// A text in quotes.
  public static string Quote(string text) {
    var quoted = new StringBuilder("\"");
    foreach (char c in text) {
      if (c == '"' || c == '\\') quoted.Append('\\').Append(c);
      else if (c < ' ') quoted.Append("\\u").Append(((int)c).ToString("x4"));
      else quoted.Append(c);
    }
    return quoted.Append('"').ToString();
  }

  /// Path of the first difference of `found` from what was expected (R32); null for none.
  public static string Difference(object expected, object found, string path) {
    if (expected is Dictionary<string, object> wanted && found is Dictionary<string, object> has) {
      foreach (var member in wanted) {
        object other;
        if (!has.TryGetValue(member.Key, out other)) return path + "/" + member.Key;
        string below = Difference(member.Value, other, path + "/" + member.Key);
        if (below != null) return below;
      }
      return null;
    }
    if (expected is List<object> list && found is List<object> there && list.Count == there.Count) {
      for (int i = 0; i < list.Count; ++i) {
        string below = Difference(list[i], there[i], path + "/" + i);
        if (below != null) return below;
      }
      return null;
    }
    bool numbers = (expected is long || expected is double) && (found is long || found is double);
    return numbers ? Convert.ToDouble(expected) == Convert.ToDouble(found) ? null : path : Equals(expected, found) ? null : path;
  }

  void Space() { while (at < text.Length && " \t\r\n".IndexOf(text[at]) >= 0) ++at; }
  char Next() { Space(); return text[at]; }
  void Take(string what) {
    if (string.CompareOrdinal(text, at, what, 0, what.Length) != 0) throw new FormatException();
    at += what.Length;
  }
  object Value() {
    if (++values > 1 << 18) throw new FormatException();
    switch (Next()) {
      case '{': return Object();
      case '[': return List();
      case '"': return Text();
      case 't': Take("true"); return true;
      case 'f': Take("false"); return false;
      case 'n': Take("null"); return null;
      default: return Number();
    }
  }
  Dictionary<string, object> Object() {
    var value = new Dictionary<string, object>();
    for (Open(); Next() != '}' || value.Count > 0;) {
      if (Next() != '"') throw new FormatException();
      string name = Text();
      Space();
      Take(":");
      if (value.ContainsKey(name)) throw new FormatException();
      value[name] = Value();
      if (Next() == '}') break;
      Take(",");
    }
    return Close(value);
  }
  List<object> List() {
    var value = new List<object>();
    for (Open(); Next() != ']' || value.Count > 0;) {
      value.Add(Value());
      if (Next() == ']') break;
      Take(",");
    }
    return Close(value);
  }
  void Open() { ++at; if (++depth > Deepest) throw new FormatException(); }
  T Close<T>(T value) { ++at; --depth; return value; }
  string Text() {
    var value = new StringBuilder();
    for (++at; text[at] != '"'; ++at) {
      if (text[at] < ' ') throw new FormatException();
      if (text[at] != '\\') { value.Append(text[at]); continue; }
      int known = "\"\\/bfnrt".IndexOf(text[++at]);
      if (known >= 0) { value.Append("\"\\/\b\f\n\r\t"[known]); continue; }
      if (text[at] != 'u' || at + 4 >= text.Length) throw new FormatException();
      value.Append((char)int.Parse(text.Substring(at + 1, 4), NumberStyles.AllowHexSpecifier));
      at += 4;
    }
    ++at;
    new UTF8Encoding(false, true).GetByteCount(value.ToString());
    return value.ToString();
  }
  object Number() {
    var number = numbers.Match(text, at);
    at += number.Length;
    double value;
    if (!number.Success || !double.TryParse(number.Value, NumberStyles.Float, CultureInfo.InvariantCulture, out value) || double.IsInfinity(value)) throw new FormatException();
    bool whole = number.Value.IndexOfAny(new[] {'.', 'e', 'E'}) < 0 && Math.Abs(value) < 1L << 53;
    return whole ? (object)(long)value : value;
  }
}
}
