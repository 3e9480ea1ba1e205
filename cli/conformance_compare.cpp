// A RESULT beside those that a conformance case has kept.
#include <fmt/format.h>

#include "cli/conformance_conversation.h"

namespace consac::cli {

Status Conversation::Compare(const Case& what, const std::string& payload, const std::string& looked_at) {
  CONSAC_RETURN_IF_ERROR(CompareEnvironments(what, payload));
  if (what.contains("same_as") && payload != kept_[what["same_as"]])
    return Failed("the payload differs from the one before");
  const auto is_like = [&](const char* kept) { return looked_at == looked_at_[what[kept]]; };
  if (what.contains("begins_as") && !is_like("begins_as"))
    return Failed("what is looked at differs from the one before");
  if (what.contains("repeats") && !is_like("repeats"))
    return Over("one seed and the same actions bring another RESULT each time");
  if (what.contains("unlike") && is_like("unlike"))
    return Over("no value changes what is seen of an episode that begins by itself");
  if (what.contains("other_than") && is_like("other_than"))
    return Failed("this episode is as if nothing had been set; one that began in another way is not (R103)");
  if (what.contains("keep")) {
    kept_[what["keep"]] = payload;
    looked_at_[what["keep"]] = looked_at;
  }
  return Status::Ok();
}

Status Conversation::CompareEnvironments(const Case& what, const std::string& payload) {
  const std::size_t count = results_.environments();
  const auto is_like = [&](const char* kept, std::size_t i) {
    return results_.OfEnvironment(payload, i) == results_.OfEnvironment(kept_[what[kept]], i);
  };
  const struct {
    const char* kept;
    std::size_t first, end;  // the environments that are compared
    bool under_way;          // those alone in which nobody began an episode of its own
  } rows[] = {{"others_as", 0, count - 1, false}, {"last_as", count - 1, count, false}, {"goes_on_as", 0, count, true}};
  // Of who has episodes of its own nobody can know; it has them with same_step alone.
  const bool own_episodes = spec_.autoreset == protocol2::Autoreset::kSameStep;
  std::size_t others = 0;
  for (const auto& [kept, first, end, under_way] : rows) {
    for (std::size_t i = first; i < end && what.contains(kept); ++i) {
      if (results_.Ends(payload, i) || results_.Ends(kept_[what[kept]], i)) continue;
      if (under_way && own_episodes && results_.Begins(kept_[what[kept]], i)) continue;
      ++others;
      if (!is_like(kept, i))
        return Failed(fmt::format("what is looked at of environment {} is not as it was with the same values", i));
    }
  }
  if (what.contains("goes_on_as") && others == 0) return Over("no episode goes on with that step");
  for (std::size_t i = 0; i < count && what.contains("differs"); ++i) {
    if (is_like("differs", i)) return Over("no value changes what is seen of a first step");
  }
  return Status::Ok();
}

}  // namespace consac::cli
