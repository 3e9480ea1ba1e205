#pragma once
// A run that another one takes the place of (--force): its files are set aside in the folders where they were, and go
// only once the new run is saved. Whatever happens before, a SIGKILL included, it is put back. Private to run.
//
// Set aside, a file lies below ".replaced" in its folder: checkpoints/.replaced/step_....consac. In the run's own
// folder that name says how far things have come, for whoever finds it later, and each change of it is one rename:
//   .replaced.moving   on the way, there or back: some files are here, the others in their places
//   .replaced          all of the old run is here; what is in its place is the new run's
//   .replaced.going    the new run is saved: this goes

#include <string>

#include "consac/base/status.h"

namespace consac::run {

/// In the run's own folder, where all of it is, or what of it is on its way.
inline constexpr const char *kRunAside = "/.replaced", *kRunMoving = "/.replaced.moving";
/// Said of a failure that has cost nothing.
inline constexpr const char* kNothingLost = "; nothing of the old run was removed";

/// Sets all aside that the run in the folder `path` has written; a failure leaves it as it was, and says so. Nothing
/// is done where there is nothing. Call it, as all of these, under the run's lock.
Status SetRunAside(const std::string& path);
/// Whether a run is set aside there.
bool IsRunAside(const std::string& path);
/// Removes what the new run has written and puts the old one back. A failure says where its files are; it may be called
/// again.
Status PutRunBack(const std::string& path);
/// Puts the old run's model of that name in the place of the new one's, which has learned nothing: engines go on with
/// it until the next one is saved. Nothing where there is none, or where files cannot have two names.
void KeepModelOfRunAside(const std::string& path, const std::string& name);
/// Removes what was set aside. An error where not even its name can be changed: then it would be put back later.
Status RemoveRunAside(const std::string& path);

/// Whether an earlier process has left something of this undone.
bool IsReplacingUnfinished(const std::string& path);
/// Does it: puts a run back whose successor was not saved, with a warning that says so.
Status FinishReplacing(const std::string& path);

}  // namespace consac::run
