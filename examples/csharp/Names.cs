// Texts that come from the trainer and go into errors: names by spec/names.md, and what is cut.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Text;
using System.Text.RegularExpressions;

namespace Consac {

public static class Names {
  static readonly Regex hidden = new Regex(
      "[\\u0000-\\u001f\\u007f-\\u009f\\u061c\\u180e\\u200b\\u200e\\u200f\\u2028-\\u202e\\u2060-\\u206f\\ufdd0-\\ufdef\\ufeff\\ufff9-\\ufffb\\ufffe\\uffff]|\\udb40[\\udc00-\\udcff]");
  static bool Fits(object value) {
    var name = value as string;
    return name == null || (name != "" && Encoding.UTF8.GetByteCount(name) <= 255 && !hidden.IsMatch(name));
  }

  /// MALFORMED where a text that is a `name`, or one of `agents`, is no name: they are judged though they are only compared (R32).
  public static void Check(object expected) {
    if (expected is List<object> list) list.ForEach(Check);
    if (!(expected is Dictionary<string, object> members)) return;
    foreach (var member in members) {
      bool fits = member.Key == "name" ? Fits(member.Value) : member.Key != "agents" || !(member.Value is List<object> agents) || agents.All(Fits);
      if (!fits) throw new Refused("MALFORMED", "an expected name that is none");
      Check(member.Value);
    }
  }

  /// So much of a text that an ERROR has 4096 bytes at most (R17).
  public static string Cut(string text) {
    int end = Math.Min(text.Length, 300);
    return text.Substring(0, end > 0 && char.IsHighSurrogate(text[end - 1]) ? end - 1 : end);
  }
}
}
