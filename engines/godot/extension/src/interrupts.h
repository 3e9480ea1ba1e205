#pragma once
// Ctrl-C and SIGTERM in an engine without a window, which would end it at once: noted instead, so that what was learned
// can be saved first. Only where nobody else has asked for them; the second one ends the engine as ever.

namespace consac::godot {

/// From now on they are noted. A second call does nothing.
void CatchInterrupts();
/// Whether one has come since.
bool Interrupted();
/// As it was before CatchInterrupts().
void ForgetInterrupts();

}  // namespace consac::godot
