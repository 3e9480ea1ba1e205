// Who comes while a trainer is there is told so (R25), and does not wait unanswered.
using System;
using System.Net.Sockets;
using System.Text;

namespace Consac {

public static class Door {
  /// Hears a HELLO, for a moment, and answers it with CAPACITY; false where nothing has been heard of the trainer for so long that its machine is gone.
  public static bool TurnAway(TcpListener listener, DateTime heard) {
    if (DateTime.UtcNow - heard > TimeSpan.FromSeconds(40)) return false;
    Socket other = listener.AcceptSocket();
    try {
      other.NoDelay = true;
      other.Poll(100000, SelectMode.SelectRead);
      other.Receive(new byte[65536]);
      string text = "{\"code\":\"CAPACITY\",\"severity\":\"connection\",\"message\":\"another trainer is connected; try again later\",\"retry_after_s\":1}";
      other.Send(FrameReader.Pack(FrameType.Error, 0, 0, Encoding.UTF8.GetBytes(text)));
      other.Shutdown(SocketShutdown.Send);
    } catch (SocketException) {  // it has left already
    }
    other.Close();
    return true;
  }
}
}
