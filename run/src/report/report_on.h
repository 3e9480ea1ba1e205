#pragma once
// Report::Open with a console of one's choice: for tests, which read what was printed.

#include <memory>

#include "consac/base/status.h"
#include "consac/run/report.h"
#include "report/console.h"

namespace consac::run {

/// A report that prints to `console`.
Result<std::unique_ptr<Report>> ReportOn(const ReportOptions& options, const ConsoleOptions& console);

}  // namespace consac::run
