#pragma once
// Commands of the rendering thread wait until somebody flushes them: whoever counts on them before is wrong.
#include <functional>

#include "RHICommandList.h"

namespace Shim {
void EnqueueRender(std::function<void(FRHICommandListImmediate&)> command);
}  // namespace Shim

#define ENQUEUE_RENDER_COMMAND(name) \
  struct name##Command {};           \
  Shim::EnqueueRender

/// Waits until they are done.
void FlushRenderingCommands();
