#include "describe.h"

#include <algorithm>
#include <cmath>

#include "consac/base/text.h"
#include "reader.h"

namespace consac::godot {
namespace {

// Numbers of one entry, and bytes of one world: more is a slip of the pen, and no engine survives it.
constexpr std::int64_t kMostNumbers = std::int64_t{1} << 24;

enum class Type { kBox, kDiscrete, kMultiDiscrete, kMultiBinary };

Status TooLarge(const std::string& what) {
  return {StatusCode::kInvalidArgument, what + "more than " + std::to_string(kMostNumbers) + " numbers; use fewer"};
}

Result<std::vector<std::int64_t>> WholeNumbers(const std::string& what, const std::vector<double>& numbers) {
  std::vector<std::int64_t> whole;
  std::int64_t product = 1;
  for (const double number : numbers) {
    if (!(number >= 1.0 && number <= static_cast<double>(kMostNumbers)) || number != std::floor(number))
      return Status{StatusCode::kInvalidArgument, what + NumberText(number) + " is no whole number of at least 1"};
    whole.push_back(static_cast<std::int64_t>(number));
    product *= whole.back();
    if (product > kMostNumbers) return TooLarge(what);
  }
  return whole;
}

// One bound for all elements, or one for each.
bool Spread(std::vector<double>* bound, std::size_t count) {
  if (bound->size() == 1) bound->resize(count, bound->front());
  return bound->size() == count;
}

Result<Space> ReadBox(Reader& reader, const std::string& what) {
  DType dtype = DType::kF32;
  reader.Take<DType>("dtype", &dtype, {{"float32", DType::kF32}, {"uint8", DType::kU8}});
  const bool bytes = dtype == DType::kU8;
  std::vector<double> low{bytes ? 0.0 : -1.0}, high{bytes ? 255.0 : 1.0}, sides{1.0};
  reader.Take("low", &low);
  reader.Take("high", &high);
  sides[0] = static_cast<double>(std::max({low.size(), high.size(), std::size_t{1}}));
  reader.Take("shape", &sides);
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  Result<std::vector<std::int64_t>> shape = WholeNumbers(what + "'shape': ", sides);
  if (!shape.ok()) return shape.status();
  std::size_t count = 1;
  for (const std::int64_t side : *shape) count *= static_cast<std::size_t>(side);
  const std::size_t lows = low.size(), highs = high.size();
  if (!Spread(&low, count) || !Spread(&high, count)) {
    return Status{StatusCode::kInvalidArgument, what + "has " + std::to_string(lows) + " numbers in 'low', " +
                                                    std::to_string(highs) + " in 'high'; expected 1 or " +
                                                    std::to_string(count)};
  }
  return Space::Box(std::move(low), std::move(high), std::move(*shape), dtype);
}

Result<Space> ReadChoice(Reader& reader, const std::string& what, Type type) {
  std::int64_t n = 0, start = 0;
  std::vector<double> choices;
  if (type == Type::kMultiDiscrete) {
    reader.Take("nvec", &choices);
  } else {
    reader.Take("n", &n);
  }
  if (type == Type::kDiscrete) reader.Take("start", &start);
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  constexpr std::int64_t kFarthest = std::int64_t{1} << 30;
  if (n > kMostNumbers) return TooLarge(what);
  if (std::abs(start) > kFarthest)
    return Status{StatusCode::kInvalidArgument,
                  what + "'start' is " + std::to_string(start) + ", which is too far off"};
  if (type == Type::kDiscrete) return Space::Discrete(n, start);
  if (type == Type::kMultiBinary) return Space::MultiBinary(n);
  Result<std::vector<std::int64_t>> nvec = WholeNumbers(what + "'nvec': ", choices);
  if (!nvec.ok()) return nvec.status();
  return Space::MultiDiscrete(std::move(*nvec));
}

Result<host::Entry> ReadEntry(const Dictionary& table, const std::string& where) {
  Reader reader(table, where + ": ");
  host::Entry entry;
  Type type = Type::kBox;
  reader.Take("name", &entry.name);
  const std::string what = where + " '" + entry.name + "': ";
  if (entry.name.empty()) return Status{StatusCode::kInvalidArgument, where + ": an entry has no 'name'; give it one"};
  if (!reader.Has("type")) return Status{StatusCode::kInvalidArgument, what + "has no 'type'; give one, as \"box\""};
  reader.Take<Type>("type", &type,
                    {{"box", Type::kBox},
                     {"discrete", Type::kDiscrete},
                     {"multi_discrete", Type::kMultiDiscrete},
                     {"multi_binary", Type::kMultiBinary}});
  Result<Space> space = type == Type::kBox ? ReadBox(reader, what) : ReadChoice(reader, what, type);
  if (!space.ok()) {
    const std::string& message = space.status().message();
    return Status{space.status().code(), message.starts_with(where) ? message : what + message};
  }
  entry.space = *std::move(space);
  return entry;
}

Status ReadEntries(Reader& reader, std::string_view key, const std::string& where, std::vector<host::Entry>* entries) {
  std::vector<Dictionary> tables;
  reader.Take(key, &tables);
  for (const Dictionary& table : tables) {
    Result<host::Entry> entry = ReadEntry(table, where + ", " + std::string(key));
    if (!entry.ok()) return entry.status();
    entries->push_back(*std::move(entry));
  }
  return Status::Ok();
}

Status ReadGoals(const Dictionary& table, const std::string& where, host::Goals* goals) {
  Reader reader(table, where + ", goals: ");
  if (!reader.Has("reward"))
    return {StatusCode::kInvalidArgument, where + ", goals: has no 'reward'; give \"sparse\" or \"dense\""};
  reader.Take<host::GoalReward>("reward", &goals->reward,
                                {{"sparse", host::GoalReward::kSparse}, {"dense", host::GoalReward::kDense}});
  reader.Take("threshold", &goals->threshold);
  reader.Take("pays", &goals->pays);
  return reader.Finish();
}

void DescribeSpace(const Space& space, Dictionary* table) {
  const auto numbers = [](const auto& values) {
    Array array;
    for (const auto value : values) array.Append(Variant::Of(value));
    return Variant::Of(array);
  };
  switch (space.kind()) {
    case SpaceKind::kBox:
      table->Set("type", Variant::Of(std::string_view("box")));
      table->Set("dtype", Variant::Of(std::string_view(space.dtype() == DType::kU8 ? "uint8" : "float32")));
      table->Set("shape", numbers(space.shape()));
      table->Set("low", numbers(space.low()));
      table->Set("high", numbers(space.high()));
      break;
    case SpaceKind::kDiscrete:
      table->Set("type", Variant::Of(std::string_view("discrete")));
      table->Set("n", Variant::Of(space.n()));
      table->Set("start", Variant::Of(space.start()));
      break;
    case SpaceKind::kMultiDiscrete:
      table->Set("type", Variant::Of(std::string_view("multi_discrete")));
      table->Set("nvec", numbers(space.nvec()));
      break;
    default:
      table->Set("type", Variant::Of(std::string_view("multi_binary")));
      table->Set("n", Variant::Of(space.shape().empty() ? std::int64_t{0} : space.shape()[0]));
  }
}

}  // namespace

Result<host::Offering> ReadOffering(const Dictionary& table) {
  host::Offering offering;
  Reader reader(table, "behaviour: ");
  reader.Take("name", &offering.name);
  const std::string where = "behaviour '" + offering.name + "'";
  reader.Take("agents", &offering.agents);
  reader.Take("masks_actions", &offering.masks_actions);
  Dictionary goals;
  reader.Take("goals", &goals);
  if (reader.Has("goals")) CONSAC_RETURN_IF_ERROR(ReadGoals(goals, where, &offering.goals));
  CONSAC_RETURN_IF_ERROR(ReadEntries(reader, "observations", where, &offering.observations));
  CONSAC_RETURN_IF_ERROR(ReadEntries(reader, "actions", where, &offering.actions));
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  for (const host::Entry& entry : offering.actions) {
    if (entry.space.kind() == SpaceKind::kBox && entry.space.dtype() != DType::kF32)
      return Status{StatusCode::kInvalidArgument,
                    where + ", actions '" + entry.name + "': no action is uint8; use float32"};
  }
  return offering;
}

namespace {

Result<ParameterSpec> ReadParameter(const Dictionary& table) {
  ParameterSpec parameter;
  Reader reader(table, "parameter: ");
  reader.Take("name", &parameter.name);
  reader.Take("default", &parameter.default_value);
  reader.Take("low", &parameter.low);
  reader.Take("high", &parameter.high);
  reader.Take("description", &parameter.description);
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  return parameter;
}

/// "agents" are pairs of a behaviour and a place of it, all in one row.
Result<GroupSpec> ReadGroup(const Dictionary& table) {
  GroupSpec group;
  std::vector<double> agents;
  Reader reader(table, "group: ");
  reader.Take("name", &group.name);
  reader.Take("agents", &agents);
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  constexpr double kMost = 1e9;
  const auto place = [](double number) { return number >= 0.0 && number <= kMost && number == std::floor(number); };
  if (agents.size() % 2 != 0 || !std::all_of(agents.begin(), agents.end(), place)) {
    return Status{StatusCode::kInvalidArgument,
                  "group '" + group.name + "': 'agents' holds pairs of a behaviour and a place of it, from 0"};
  }
  for (std::size_t i = 0; i < agents.size(); i += 2)
    group.members.push_back({static_cast<std::size_t>(agents[i]), static_cast<std::size_t>(agents[i + 1])});
  return group;
}

}  // namespace

Result<host::TickWorldOptions> ReadWorld(const Dictionary& table) {
  host::TickWorldOptions options;
  std::vector<Dictionary> behaviours;
  Reader reader(table, "world: ");
  reader.Take("id", &options.id);
  reader.Take("max_episode_steps", &options.max_episode_steps);
  reader.Take("agents_leave", &options.agents_leave);
  reader.Take("notes", &options.notes);
  std::vector<Dictionary> parameters, groups;
  reader.Take("parameters", &parameters);
  reader.Take("groups", &groups);
  for (const Dictionary& table_of_one : parameters) {
    Result<ParameterSpec> parameter = ReadParameter(table_of_one);
    if (!parameter.ok()) return parameter.status();
    options.parameters.push_back(*std::move(parameter));
  }
  for (const Dictionary& table_of_one : groups) {
    Result<GroupSpec> group = ReadGroup(table_of_one);
    if (!group.ok()) return group.status();
    options.groups.push_back(*std::move(group));
  }
  reader.Take("behaviours", &behaviours);
  for (const Dictionary& behaviour : behaviours) {
    Result<host::Offering> offering = ReadOffering(behaviour);
    if (!offering.ok()) return offering.status();
    options.offerings.push_back(*std::move(offering));
  }
  CONSAC_RETURN_IF_ERROR(reader.Finish());
  return options;
}

Array DescribeEntries(const std::vector<Leaf>& leaves) {
  Array all;
  for (const Leaf& leaf : leaves) {
    Dictionary table;
    table.Set("name", Variant::Of(std::string_view(leaf.name)));
    DescribeSpace(leaf.space, &table);
    all.Append(Variant::Of(table));
  }
  return all;
}

}  // namespace consac::godot
