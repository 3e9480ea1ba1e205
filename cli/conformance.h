#pragma once
// Puts any server of protocol 2 through spec/conformance/protocol2/server.json, and any trainer through trainer.json
// and results.json.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "consac/transport/transport.h"

namespace consac::cli {

/// The files of spec/conformance/protocol2 as text.
const char* ConformanceServerCases();
const char* ConformanceTrainerCases();
const char* ConformanceResults();

/// What became of one case.
struct ConformanceVerdict {
  std::string name;
  std::string rules;             ///< of spec/protocol2.md, "R11 R24"
  Status status = Status::Ok();  ///< ok, or what is wrong
  bool offered = true;           ///< false: the other end does not do what the case is of, which is its right
  std::string why_not = {};      ///< it is not offered
  int step = 0;                  ///< the last one that was done, counted from 1
  std::string asked = {};        ///< that step as the file has it
  bool expects = false;          ///< it is an `expect`
  std::string sent = {};         ///< the latest before it that is no `expect`, "" for none

  /// A step was done.
  void Note(const nlohmann::json& done);
};

/// How many cases came to what.
struct ConformanceCount {
  int held = 0, failed = 0, not_offered = 0;
  Status ended = Status::Ok();  ///< why the cases behind these were not run: no trainer came any more

  void Add(const ConformanceVerdict& verdict) {
    ++(!verdict.status.ok() ? failed : verdict.offered ? held : not_offered);
  }
};

/// Runs every case against `endpoint`, telling `say` of each; an answer is waited for `patience_s`, a pause counted.
/// kUnavailable when nobody answers there.
Result<ConformanceCount> RunConformance(const Endpoint& endpoint, const std::string& token, double patience_s,
                                        const std::function<void(const ConformanceVerdict&)>& say);

/// Is the engine of every case for a trainer that connects to `listener` again and again, each time within
/// `patience_s`; when none comes any more that is the end.
ConformanceCount RunTrainerConformance(Listener& listener, double patience_s,
                                       const std::function<void(const ConformanceVerdict&)>& say);

}  // namespace consac::cli
