// The configuration reader on any bytes: it refuses or accepts, and what it accepts is written and read back the same.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "consac/run/config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using consac::run::RunConfig;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  RunConfig config;
  if (consac::run::ReadYaml(text, "fuzz", &config).ok()) {
    const std::string written = consac::run::WriteYaml(config);
    RunConfig again;
    if (!consac::run::ReadYaml(written, "written", &again).ok()) std::abort();
    if (consac::run::WriteYaml(again) != written) std::abort();
  }
  (void)consac::run::ApplySetting(text, &config);
  return 0;
}
