#include "offer.h"

#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"

namespace consac::run {
namespace {

using Offer = nlohmann::json;

std::string IdOf(const Offer& offer) {
  const auto id = offer.find("id");
  return id != offer.end() && id->is_string() ? id->get<std::string>() : std::string();
}

std::string BehavioursOf(const Offer& offer) {
  const auto behaviours = offer.find("behaviours");
  return behaviours != offer.end() ? JsonText(*behaviours) : std::string("[]");
}

}  // namespace

std::string OfferText(const EnvSpec& spec, std::span<const std::int64_t> slots) {
  const Result<Offer> all = ReadJson<Offer>(protocol2::BehavioursJson(spec));
  Offer behaviours = Offer::array();
  for (std::size_t b = 0; all.ok() && b < all->size(); ++b) {
    Offer behaviour;
    for (const char* member : {"name", "observation", "action", "masks_actions"}) behaviour[member] = (*all)[b][member];
    behaviour["agents"] = slots[b];
    behaviours.push_back(std::move(behaviour));
  }
  return JsonText(Offer({{"id", spec.id}, {"behaviours", std::move(behaviours)}}));
}

Status CompareOffers(const std::string& before, const std::string& now) {
  const Result<Offer> saved = ReadJson<Offer>(before), offered = ReadJson<Offer>(now);
  if (!saved.ok() || !offered.ok() || !saved->is_object()) return Status::Ok();  // nothing is known
  const std::string id = IdOf(*saved), other = IdOf(*offered);
  if (!id.empty() && !other.empty() && id != other)
    return {StatusCode::kInvalidArgument, "the world was " + Quote(id) + " and is " + Quote(other)};
  std::string path;
  const Status same = protocol2::CompareBehaviours(BehavioursOf(*saved), BehavioursOf(*offered), &path);
  return same.ok() ? same : Status{StatusCode::kInvalidArgument, protocol2::FaultText(same)};
}

}  // namespace consac::run
