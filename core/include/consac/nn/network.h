#pragma once
// A network as data: blocks in execution order over named values, and one flat arena of parameters. The same
// description is written into the model file, run forward here (in trainer and game alike) and backward in
// learn/grad. Parameters are stored canonically: dense weight [out, in] row-major, then bias [out], block by block.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/rng.h"
#include "consac/base/status.h"
#include "consac/nn/attributes.h"

namespace consac::nn {

/// Element-wise function after a dense block. Names as in the model file: "linear", "tanh", "relu", ...
enum class Activation : std::uint8_t { kLinear, kTanh, kRelu, kSigmoid, kElu, kLeakyRelu, kSilu, kSoftplus };
/// "tanh" and so on.
std::string_view NameOf(Activation activation);
/// The reverse; the error lists what is known.
Result<Activation> ParseActivation(std::string_view name);

/// How a block's weight starts.
enum class Init : std::uint8_t { kOrthogonal, kXavierUniform, kUniformFanIn, kZeros };

/// Sizes of one row of a value, row-major: {64} features, {height, width, channels} of an image.
using Shape = std::vector<std::int64_t>;
/// Numbers in a row of that shape; 1 for an empty one.
std::int64_t SizeOf(const Shape& shape);

/// One block of a network. `op` names a row of the table in nn/ops.cpp, which says how many inputs it has and what its
/// attributes mean. A size of 0 is filled in by Network::Create.
struct Block {
  std::string op = "dense";         ///< which operation
  std::vector<std::string> inputs;  ///< values it reads, in the op's order
  std::string output;               ///< value it writes
  std::string name;                 ///< parameter prefix in the model file: "pi/0" -> "pi/0/w", "pi/0/b"
  std::int64_t in_size = 0;         ///< features of the inputs together
  std::int64_t out_size = 0;        ///< features of the output; a dense block must say it
  Activation activation = Activation::kLinear;
  Init init = Init::kOrthogonal;  ///< of the weight; biases start at 0 (kUniformFanIn: as PyTorch)
  float gain = 1.0f;              ///< factor of the initial weight
  Attributes attributes = {};     ///< what else the op wants to know; the model file keeps all of it
  std::string shares = {};        ///< the block before it whose parameters it uses; empty: it has its own
  friend bool operator==(const Block&, const Block&) = default;
};

/// A named value of known size.
struct Port {
  std::string name;       ///< value name
  std::int64_t size = 0;  ///< features
  Shape shape = {};       ///< of a row; empty: {size}
  friend bool operator==(const Port&, const Port&) = default;
};

/// The whole description: a directed graph without loops; blocks stand in execution order.
struct NetworkSpec {
  std::vector<Port> inputs;          ///< given by the caller
  std::vector<Block> blocks;         ///< in execution order
  std::vector<std::string> outputs;  ///< values the caller reads: "pi", "vf"
  friend bool operator==(const NetworkSpec&, const NetworkSpec&) = default;
};

/// A block with what its place in the network adds.
struct PlacedBlock : Block {
  std::vector<Shape> in_shapes;         ///< of its inputs
  Shape out_shape;                      ///< of its output
  std::int64_t parameter_offset = 0;    ///< first of its parameters in the arena
  std::int64_t parameter_count = 0;     ///< how many
  std::shared_ptr<const void> details;  ///< what the op made of the attributes, for itself
};

/// A parameter tensor inside the arena.
struct Parameter {
  std::string name;                 ///< "pi/0/w"
  std::vector<std::int64_t> shape;  ///< [out, in] or [out]
  std::int64_t offset = 0;          ///< first element in the arena
  std::int64_t count = 0;           ///< elements
};

struct Op;
class PackedNetwork;

/// A checked NetworkSpec that can be run. Immutable and shareable between threads; memory is the Evaluator's.
class Network {
 public:
  /// Checks names, shapes and order, and fills in what follows from them; the error names the block.
  static Result<Network> Create(NetworkSpec spec);

  /// The description, every size filled in.
  const NetworkSpec& spec() const { return spec_; }
  /// The blocks with their shapes and parameters, in execution order.
  std::span<const PlacedBlock> blocks() const { return blocks_; }
  /// Floats in the arena.
  std::int64_t parameter_count() const { return parameter_count_; }
  /// Tensors in arena order.
  std::span<const Parameter> parameters() const { return parameters_; }
  /// Width of output `index`.
  std::int64_t output_size(std::size_t index) const;

  /// Writes initial parameters, [parameter_count].
  void Initialise(Rng& rng, std::span<float> parameters) const;

 private:
  using Places = std::map<std::string_view, std::size_t>;
  Status PlaceParameters(PlacedBlock& block, const Op& op, const Places& places);
  Status CheckParameterNames() const;

  NetworkSpec spec_;
  std::vector<PlacedBlock> blocks_;
  std::vector<Parameter> parameters_;
  std::vector<std::int64_t> output_sizes_;
  std::int64_t parameter_count_ = 0;
};

/// What goes from step to step of a network with a state: its slots' states, and where episodes begin.
struct RecurrentRows {
  float* state = nullptr;                ///< [slots, state_size] read and written; null: zeros, and nothing is kept
  const std::int32_t* slots = nullptr;   ///< [rows] whose state each row is; null: row r is slot r
  const std::uint8_t* begins = nullptr;  ///< [rows] 1: an episode begins, its state is zero; null: nowhere
};

/// A network with its parameters packed for the kernels: what acts. Forward never allocates or locks. One per thread
/// that acts, since it holds the activations; several may share one packing.
class Evaluator {
 public:
  /// Rows that go through all layers together, so that they stay in cache.
  static constexpr std::int64_t kRowsTogether = 64;

  /// Room for `max_rows` rows. Copies what it needs of `network`.
  Evaluator(const Network& network, std::int64_t max_rows);
  /// Runs with the parameters that `packed` holds: those of another evaluator, a target network, a frozen player.
  Evaluator(std::shared_ptr<const PackedNetwork> packed, std::int64_t max_rows);
  ~Evaluator();
  Evaluator(Evaluator&&) noexcept;
  Evaluator& operator=(Evaluator&&) noexcept;

  /// Packs `parameters` ([parameter_count], canonical order). Cost: one pass over them. Only where the packing is its
  /// own; otherwise who owns it loads it.
  void Load(std::span<const float> parameters);
  /// Runs `rows` <= max_rows rows. inputs[i] is [rows, inputs[i].size] row-major. The results stay readable by
  /// output() until the next call. Row r's result does not depend on the other rows, bit for bit.
  void Forward(std::span<const float* const> inputs, std::int64_t rows, const RecurrentRows& recurrent = {});
  /// Runs only what output `index` needs: the actor without the critic, whose state stays as it is.
  void ForwardTo(std::size_t index, std::span<const float* const> inputs, std::int64_t rows,
                 const RecurrentRows& recurrent = {});
  /// Output `index` of the last Forward: [rows, output_size(index)] row-major, densely packed.
  const float* output(std::size_t index) const;
  /// Floats that a slot keeps from one step to the next; 0 where no block has a state.
  std::int64_t state_size() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace consac::nn
