#include "consac/policy/policy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "consac/base/text.h"
#include "policy/policy_spec.h"

namespace consac {
namespace {

constexpr std::int64_t kSelfTestRows = 8;
// A sum taken in another order, as another instruction set does, differs by some float roundings of its largest term;
// a wrong weight, layout or normaliser differs by far more.
constexpr double kSelfTestTolerance = 1e-4;  // of 1 + the largest answer
constexpr float kSelfTestReach = 10.0f;      // questions without normaliser stay within it
constexpr float kLargestQuestion = std::numeric_limits<float>::max();

Status DoesNotFit(const std::string& what) {
  return {StatusCode::kInvalidArgument, what};
}

/// The first leaf in which two spaces differ, as a sentence; ok when they are equal.
Status CompareSpaces(std::string_view role, const Space& model, const Space& world) {
  if (model == world) return Status::Ok();
  const Layout model_layout = Layout::Of(model), world_layout = Layout::Of(world);
  const std::size_t leaves = std::max(model_layout.leaves.size(), world_layout.leaves.size());
  for (std::size_t i = 0; i < leaves; ++i) {
    const Leaf* mine = i < model_layout.leaves.size() ? &model_layout.leaves[i] : nullptr;
    const Leaf* theirs = i < world_layout.leaves.size() ? &world_layout.leaves[i] : nullptr;
    if (mine != nullptr && theirs != nullptr && mine->name == theirs->name && mine->space == theirs->space) continue;
    const std::string& path = mine != nullptr ? mine->name : theirs->name;
    return DoesNotFit("the model's " + std::string(role) + (path.empty() ? "" : " '" + path + "'") + " is " +
                      (mine != nullptr ? mine->space.ToString() : "absent") + ", the world's is " +
                      (theirs != nullptr ? theirs->space.ToString() : "absent") +
                      "; use a model trained for this world");
  }
  return DoesNotFit("the model's " + std::string(role) + " is " + model.ToString() + ", the world's is " +
                    world.ToString());
}

}  // namespace

struct Policy::State {
  PolicyData data;
  Layout observation, action;
  ActionHead head;
  nn::Network network;
  nn::Evaluator evaluator;
  std::int64_t max_rows = 0, last_rows = 0;
  std::vector<float> features;                  // [max_rows, feature_count]
  std::vector<float> raw;                       // [max_rows, raw actions]
  std::vector<float> states;                    // [max_rows slots, state_size]
  std::vector<float> exploration;               // [max_rows slots, exploration_size] of heads that follow the state
  std::vector<std::int64_t> exploration_lasts;  // [max_rows slots] actions until it is drawn anew; 0: now, -1: never

  State(PolicyData policy, ActionHead checked_head, nn::Network checked, std::int64_t rows)
      : data(std::move(policy)),
        observation(Layout::Of(data.observation_space)),
        action(Layout::Of(data.action_space)),
        head(std::move(checked_head)),
        network(std::move(checked)),
        evaluator(network, std::max(rows, kSelfTestRows)),
        max_rows(std::max(rows, kSelfTestRows)),
        features(static_cast<std::size_t>(max_rows * observation.feature_count)),
        raw(static_cast<std::size_t>(max_rows * head.raw_size())),
        states(static_cast<std::size_t>(max_rows * evaluator.state_size())),
        exploration(static_cast<std::size_t>(max_rows * head.exploration_size())),
        exploration_lasts(exploration.empty() ? 0 : static_cast<std::size_t>(max_rows)) {
    evaluator.Load(data.parameters);
  }

  /// Runs the actor on features that are already in network form (not yet normalised).
  const float* Run(std::int64_t rows, const nn::RecurrentRows& recurrent = {}) {
    if (data.normaliser.active()) data.normaliser.Apply(features.data(), rows);
    const float* input = features.data();
    evaluator.ForwardTo(0, std::span<const float* const>(&input, 1), rows, recurrent);
    last_rows = rows;
    return evaluator.output(0);
  }

  /// The matrices that `call` explores by, drawn where they are due: at an agent's first action, where its episode
  /// begins, and as often as the head says.
  SlotNoise Explore(const ActRows& call, std::int64_t rows, Rng& rng) {
    for (std::int64_t r = 0; r < rows; ++r) {
      const std::size_t slot = static_cast<std::size_t>(call.slots == nullptr ? r : call.slots[r]);
      std::int64_t& lasts = exploration_lasts[slot];
      if (lasts == 0 || (call.begins != nullptr && call.begins[r] != 0)) {
        head.DrawExploration(data.log_std.data(), rng,
                             exploration.data() + slot * static_cast<std::size_t>(head.exploration_size()));
        lasts = head.sample_freq() > 0 ? head.sample_freq() : -1;
      }
      if (lasts > 0) --lasts;
    }
    return {exploration.data(), call.slots};
  }

  /// Questions for the self-test, drawn from `seed`: rows of the observation space, brought to where the policy was
  /// trained: a deviation or two about the normaliser's mean, or not far from zero.
  std::vector<float> Questions(std::uint64_t seed) const {
    Rng rng(seed, StreamId("self_test"));
    std::vector<std::byte> row(observation.row_bytes);
    std::vector<float> questions(static_cast<std::size_t>(kSelfTestRows * observation.feature_count));
    for (std::int64_t r = 0; r < kSelfTestRows; ++r) {
      SampleRow(observation, rng, row.data());
      EncodeFeatures(observation, row.data(), 1, questions.data() + r * observation.feature_count);
    }
    for (std::size_t i = 0; i < questions.size(); ++i) {
      const std::size_t feature = i % static_cast<std::size_t>(observation.feature_count);
      if (data.normaliser.active())
        questions[i] = std::clamp(
            data.normaliser.mean[feature] + static_cast<float>(rng.Normal()) / data.normaliser.scale[feature],
            -kLargestQuestion, kLargestQuestion);
      else
        questions[i] = std::clamp(questions[i], -kSelfTestReach, kSelfTestReach);
    }
    return questions;
  }

  std::vector<float> Answers(std::span<const float> questions) {
    std::copy(questions.begin(), questions.end(), features.begin());
    const float* answers = Run(static_cast<std::int64_t>(questions.size()) / observation.feature_count);
    return std::vector<float>(answers, answers + last_rows * head.size());
  }

  Status RunSelfTest(const ModelFile& file, const std::vector<SelfTestPair>& pairs) {
    for (const SelfTestPair& pair : pairs) {
      const auto in = file.tensors.find(pair.in), out = file.tensors.find(pair.out);
      if (in == file.tensors.end() || out == file.tensors.end()) {
        return {StatusCode::kDataLoss,
                "the model's self-test names tensors that the file lacks: " + Quote(pair.in) + ", " + Quote(pair.out)};
      }
      const std::span<const float> questions = in->second.floats(), expected = out->second.floats();
      const auto rows = static_cast<std::int64_t>(questions.size()) / observation.feature_count;
      const bool whole = rows >= 1 && rows <= max_rows &&
                         static_cast<std::int64_t>(questions.size()) == rows * observation.feature_count &&
                         static_cast<std::int64_t>(expected.size()) == rows * head.size();
      if (!whole) return {StatusCode::kDataLoss, "the model's self-test " + Quote(pair.in) + " has an impossible size"};
      for (const std::span<const float> numbers : {questions, expected}) {
        if (std::all_of(numbers.begin(), numbers.end(), [](float number) { return std::isfinite(number); })) continue;
        return {StatusCode::kDataLoss,
                "the model's self-test " + Quote(pair.in) + " has a NaN or infinity; do not use the model"};
      }
      const std::vector<float> answers = Answers(questions);
      double largest = 0.0;
      for (const float answer : expected) largest = std::max(largest, std::fabs(static_cast<double>(answer)));
      for (std::size_t i = 0; i < answers.size(); ++i) {
        const double error = std::fabs(static_cast<double>(answers[i]) - expected[i]);
        if (std::isfinite(error) && error <= pair.tolerance * (1.0 + largest)) continue;
        return {StatusCode::kDataLoss, "the model fails its own self-test: output " + std::to_string(i) + " of " +
                                           Quote(pair.out) + " is " + NumberText(answers[i]) + ", the file says " +
                                           NumberText(expected[i]) + "; do not use it"};
      }
    }
    return Status::Ok();
  }
};

Policy::Policy(std::unique_ptr<State> state) : state_(std::move(state)) {}
Policy::~Policy() = default;
Policy::Policy(Policy&&) noexcept = default;
Policy& Policy::operator=(Policy&&) noexcept = default;

Result<Policy> Policy::Create(PolicyData data, std::int64_t max_rows) {
  if (max_rows < 1) return DoesNotFit("a policy needs room for at least 1 row, not " + std::to_string(max_rows));
  Result<nn::Network> network = nn::Network::Create(data.network);
  if (!network.ok()) return network.status();
  Result<ActionHead> head = ActionHead::Create(Layout::Of(data.action_space), data.heads);
  if (!head.ok()) return head.status();
  data.heads = head->specs();
  data.network = network->spec();
  const std::int64_t features = data.observation_space.flat_size();
  if (data.network.inputs.size() != 1 || data.network.inputs[0].size != features) {
    return DoesNotFit("the policy's network must have one input of " + std::to_string(features) + " features for " +
                      data.observation_space.ToString());
  }
  if (data.network.outputs.empty() || network->output_size(0) != head->size()) {
    return DoesNotFit("the policy's network must put out " + std::to_string(head->size()) + " numbers first, for " +
                      data.action_space.ToString());
  }
  if (static_cast<std::int64_t>(data.parameters.size()) != network->parameter_count() ||
      static_cast<std::int64_t>(data.log_std.size()) != head->log_std_size()) {
    return DoesNotFit("the policy has " + std::to_string(data.parameters.size()) + " parameters, its network needs " +
                      std::to_string(network->parameter_count()));
  }
  const ObservationNormaliser& normaliser = data.normaliser;
  for (const std::vector<float>* numbers : std::initializer_list<const std::vector<float>*>{
           &data.parameters, &data.log_std, &normaliser.mean, &normaliser.scale}) {
    if (!std::all_of(numbers->begin(), numbers->end(), [](float p) { return std::isfinite(p); }))
      return Status{StatusCode::kNonFinite, "the policy has a parameter that is NaN or infinite; do not use it"};
  }
  if (normaliser.active() && (static_cast<std::int64_t>(normaliser.mean.size()) != features ||
                              normaliser.scale.size() != normaliser.mean.size() || !(normaliser.clip > 0.0f))) {
    return DoesNotFit("the policy's normaliser has " + std::to_string(normaliser.mean.size()) + " means, " +
                      std::to_string(normaliser.scale.size()) + " scales and clip " + NumberText(normaliser.clip) +
                      "; it needs " + std::to_string(features) + " of each and a clip above 0");
  }
  return Policy(std::make_unique<State>(std::move(data), std::move(*head), std::move(*network), max_rows));
}

Result<Policy> Policy::Load(const std::string& path, std::int64_t max_rows) {
  const Result<ModelFile> file = ModelFile::Load(path);
  if (!file.ok()) return file.status();
  Result<Policy> policy = FromFile(*file, max_rows);
  if (!policy.ok()) return Status{policy.status().code(), "'" + path + "': " + policy.status().message()};
  return policy;
}

Result<Policy> Policy::FromBytes(std::span<const std::byte> bytes, std::int64_t max_rows) {
  const Result<ModelFile> file = ModelFile::Parse(bytes);
  if (!file.ok()) return file.status();
  return FromFile(*file, max_rows);
}

Result<Policy> Policy::FromFile(const ModelFile& file, std::int64_t max_rows) {
  std::vector<SelfTestPair> selftest;
  Result<PolicyData> data = ReadPolicy(file, &selftest);
  if (!data.ok()) return data.status();
  Result<Policy> policy = Create(std::move(*data), max_rows);
  if (!policy.ok()) return policy.status();
  CONSAC_RETURN_IF_ERROR(policy->state_->RunSelfTest(file, selftest));
  return policy;
}

const PolicyData& Policy::data() const {
  return state_->data;
}
const Layout& Policy::observation_layout() const {
  return state_->observation;
}
const Layout& Policy::action_layout() const {
  return state_->action;
}

Status Policy::Fits(const BehaviourSpec& behaviour) const {
  CONSAC_RETURN_IF_ERROR(CompareSpaces("observation", state_->data.observation_space, behaviour.observation_space));
  return CompareSpaces("action", state_->data.action_space, behaviour.action_space);
}

void Policy::Act(const std::byte* observations, const std::uint8_t* masks, std::int64_t rows, ActionMode mode, Rng& rng,
                 std::byte* actions) {
  Act({.observations = observations, .masks = masks, .rows = rows}, mode, rng, actions);
}

void Policy::Act(const ActRows& call, ActionMode mode, Rng& rng, std::byte* actions) {
  CONSAC_ASSERT(call.rows >= 0 && call.rows <= state_->max_rows);
  const std::int64_t rows = std::clamp<std::int64_t>(call.rows, 0, state_->max_rows);
  const bool explores = mode == ActionMode::kSample && !state_->exploration.empty();
  nn::RecurrentRows recurrent;
  SlotNoise noise;
  if (!state_->states.empty() || explores) {
    const auto outside = [&](std::int32_t slot) { return slot < 0 || slot >= state_->max_rows; };
    const bool fits = call.slots == nullptr || std::none_of(call.slots, call.slots + rows, outside);
    CONSAC_ASSERT(fits);
    if (fits && !state_->states.empty()) recurrent = {state_->states.data(), call.slots, call.begins};
    if (fits && explores) noise = state_->Explore(call, rows, rng);
  }
  EncodeFeatures(state_->observation, call.observations, rows, state_->features.data());
  const float* head = state_->Run(rows, recurrent);
  state_->head.Select(head, state_->data.log_std.data(), call.masks, rows, mode, rng, state_->raw.data(), nullptr,
                      noise);
  state_->head.Write(state_->raw.data(), rows, actions);
}

void Policy::Visit(Archive& archive) {
  archive("slots", std::span<float>(state_->states));
  if (state_->exploration.empty()) return;
  archive("exploration", std::span<float>(state_->exploration));
  archive("exploration_lasts", std::span<std::int64_t>(state_->exploration_lasts));
}

Status Policy::MakeRoom(std::int64_t max_rows) {
  if (max_rows <= state_->max_rows) return Status::Ok();
  Result<Policy> larger = Create(state_->data, max_rows);
  if (!larger.ok()) return larger.status();
  std::copy(state_->states.begin(), state_->states.end(), larger->state_->states.begin());
  std::copy(state_->exploration.begin(), state_->exploration.end(), larger->state_->exploration.begin());
  std::copy(state_->exploration_lasts.begin(), state_->exploration_lasts.end(),
            larger->state_->exploration_lasts.begin());
  *this = std::move(*larger);
  return Status::Ok();
}

bool Policy::recurrent() const {
  return !state_->states.empty();
}

std::span<const float> Policy::head() const {
  return {state_->evaluator.output(0), static_cast<std::size_t>(state_->last_rows * state_->head.size())};
}

ModelFile Policy::ToFile(std::uint64_t seed) const {
  const std::vector<float> questions = state_->Questions(seed);
  const std::vector<float> answers = state_->Answers(questions);
  ModelFile file;
  WritePolicy(state_->data, {{"test/0/in", "test/0/out", kSelfTestTolerance}}, &file);
  file.tensors.insert_or_assign("test/0/in",
                                Tensor::OfFloats(questions, {kSelfTestRows, state_->observation.feature_count}));
  file.tensors.insert_or_assign("test/0/out", Tensor::OfFloats(answers, {kSelfTestRows, state_->head.size()}));
  return file;
}

}  // namespace consac
