#pragma once
/// Whether a widget has done with an event.
class FReply {
 public:
  static FReply Handled() { return FReply(); }
};
