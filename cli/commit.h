#pragma once
// Which commit the program was built from; cmake/commit.cmake writes the source. Of the command line alone.

namespace consac::cli {

/// Twelve digits, with a + where files were changed since; "unknown" where no repository says it. Lives as long as the
/// program.
const char* Commit();

}  // namespace consac::cli
