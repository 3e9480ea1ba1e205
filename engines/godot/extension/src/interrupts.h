#pragma once
// Ctrl-C and SIGTERM in an engine without a window, which would end it at once: noted instead, so that what was learned
// can be saved first. Only where nobody else has asked for them; the second one ends the engine as ever.

namespace consac::godot {

/// From now on they are noted, until each that has called this has called ForgetInterrupts().
void CatchInterrupts();
/// Whether one has come since the first call.
bool Interrupted();
/// As it was before CatchInterrupts(), once nobody else wants them.
void ForgetInterrupts();
/// Likewise, whoever wants them: the handler goes with the library.
void EndInterrupts();

}  // namespace consac::godot
