// consac-cad: reads a CAD file with OpenCASCADE and writes what consac twin needs of it (twin/cad.h) to standard
// output. A process of its own, since a damaged file may bring a CAD kernel down: it limits its own memory and time
// before it opens anything. On standard error, lines for whoever started it: "= DONE OF" parts, and "! why" at the end
// where it fails.
//
//   consac-cad FILE DEFLECTION_MM ANGLE_RAD SECONDS MEBIBYTES >assembly

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Standard_Failure.hxx>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <new>

#include "consac/base/text.h"
#include "document.h"

namespace {

using namespace consac;

// `room` lies between the soft limit and the hard one.
void Limit(decltype(RLIMIT_AS) resource, double value, rlim_t room = 0) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0) return;
  const auto wanted = static_cast<rlim_t>(value);
  limit.rlim_cur = limit.rlim_max == RLIM_INFINITY || wanted < limit.rlim_max ? wanted : limit.rlim_max;
  if (limit.rlim_max == RLIM_INFINITY || limit.rlim_max - limit.rlim_cur > room) limit.rlim_max = limit.rlim_cur + room;
  (void)setrlimit(resource, &limit);
}

int Fail(const std::string& why) {
  std::fprintf(stderr, "! %s\n", why.c_str());
  return 1;
}

bool WriteAll(int to, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(to, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  double numbers[4] = {};
  bool good = argc == 6;
  for (int i = 0; i < 4 && good; ++i)
    good = ParseNumber(std::string_view(argv[i + 2]), &numbers[i]) && numbers[i] > 0.0;
  if (!good) return Fail("usage: consac-cad FILE DEFLECTION_MM ANGLE_RAD SECONDS MEBIBYTES >assembly");
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
  Limit(RLIMIT_CPU, numbers[2], 1);  // at the soft one SIGXCPU, which says why; at the hard one SIGKILL
  Limit(RLIMIT_AS, numbers[3] * 1048576.0);
  Limit(RLIMIT_CORE, 0.0);
  const int out = dup(STDOUT_FILENO);  // OpenCASCADE talks on standard output
  if (out < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) return Fail("no descriptor is left");
  Message::DefaultMessenger()->ChangePrinters().Clear();
  auto told = std::chrono::steady_clock::now();
  const auto progress = [&](std::size_t done, std::size_t of) {
    const auto now = std::chrono::steady_clock::now();
    if (now - told < std::chrono::milliseconds(200)) return;
    told = now;
    std::fprintf(stderr, "= %zu %zu\n", done, of);
  };
  try {
    const Status status = cad::Convert(
        argv[1], {numbers[0], numbers[1]}, [&](std::span<const std::byte> bytes) { return WriteAll(out, bytes); },
        progress);
    if (!status.ok()) return Fail(status.message());
  } catch (const Standard_Failure& failure) {
    return Fail(std::string("OpenCASCADE gives up: ") + failure.DynamicType()->Name() + " " +
                failure.GetMessageString());
  } catch (const std::bad_alloc&) {
    return Fail("it takes more than " + NumberText(numbers[3]) + " MiB of memory; allow more, or simplify it");
  } catch (const std::exception& failure) {
    return Fail(std::string("OpenCASCADE gives up: ") + failure.what());
  }
  return 0;
}
