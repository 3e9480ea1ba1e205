"""consac.policy: models of the C++ trainer act alike here, and what is no sound model is refused."""
import hashlib
import json
import struct

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import consac.network
import consac.policy
from consac import wire
from consac.layout import Layout, space_to_json
from consac.policy import ACTIVATIONS, ModelDamaged, ModelError, ModelForeign, ModelMisfit, ModelTooNew, Policy, load_policies, load_policy, read_model
from program import PROGRAM, needs_program, run

TRAINED = {"road-v0": [], "cartpole-v1": ["net_arch=[dict(pi=[8], vf=[8])]"], "pendulum-v1": ["norm_obs=true"], "maze-v0": ["act_fun=relu"], "reach3-v0": ["norm_obs=true"],
           "pixel-catch-v0": ["algorithm=dqn", "policy=LnCnnPolicy", "dueling=true", "buffer_size=2000"], "identity-multibinary-v0": []}

KEYS = spaces.Dict({"b": spaces.Box(-1, 1, (2, 2), np.float32), "a": spaces.Discrete(3, start=-1),
                    "t": spaces.Tuple([spaces.MultiDiscrete([2, 3]), spaces.MultiBinary(3), spaces.Box(0, 255, (3,), np.uint8)])})
ACTIONS = spaces.Dict({"jump": spaces.Discrete(2, start=1), "keys": spaces.MultiDiscrete([3, 2]), "lamps": spaces.MultiBinary(2), "move": spaces.Box(-0.5, 0.5, (2,), np.float32)})


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    folder, paths = tmp_path_factory.mktemp("runs"), {}
    for world, settings in TRAINED.items():
        extra = [text for setting in settings for text in ("--set", setting)]
        done = run([PROGRAM, "train", world, "--steps", "1024", "--name", world, "--dir", folder, "--no-tensorboard", "--seed", "3", *extra])
        assert done.returncode == 0, done.stdout + done.stderr
        paths[world] = folder / world / "model.consac"
    return paths


# ---- a writer, so that the reader is not tested with itself

def model_bytes(spec, tensors, **metadata):
    header, data = {}, b""
    for name in sorted(tensors):
        piece = tensors[name].tobytes()
        header[name] = {"dtype": wire.NAMES[tensors[name].dtype], "shape": list(tensors[name].shape), "data_offsets": [len(data), len(data) + len(piece)]}
        data += piece
    text = spec if isinstance(spec, str) else json.dumps(spec)
    header["__metadata__"] = {"format": "consac", "consac.version": "1", "consac.spec": text, "consac.sha256": hashlib.sha256(text.encode() + data).hexdigest()} | metadata
    raw = json.dumps(header).encode()
    raw += b" " * (-len(raw) % 8)
    return struct.pack("<Q", len(raw)) + raw + data


def features_of(space):
    return gymnasium.spaces.utils.flatdim(space)


def listed(space):
    """A space's JSON with every bound of a box written out, as spec/model_file.md has it."""
    value = space_to_json(space)
    boxes = [value]
    for box in boxes:
        boxes += [child["space"] for child in box.get("spaces", [])]
        if box["type"] == "box":
            count = int(np.prod(box["shape"]))
            box.update({side: box[side] if isinstance(box[side], list) else [box[side]] * count for side in ("low", "high")})
    return value


def head_name(space):
    return "gaussian" if isinstance(space, spaces.Box) else "bernoulli" if isinstance(space, spaces.MultiBinary) else "categorical"


def make(observation=spaces.Box(-1, 1, (3,), np.float32), action=spaces.Discrete(3), activations=("tanh",), normalise=False, seed=1):
    """Specification and tensors of a random policy; the self-test's answers come from the formulas of spec/model_file.md."""
    rng = np.random.default_rng(seed)
    size, outputs = features_of(observation), features_of(action)
    tensors, blocks, source, width = {}, [], "obs", size
    for index, activation in enumerate((*activations, "linear")):
        out = outputs if index == len(activations) else 5
        name = f"pi/{index}"
        tensors[f"{name}/w"], tensors[f"{name}/b"] = rng.normal(size=(out, width)).astype(np.float32), rng.normal(size=out).astype(np.float32)
        blocks.append({"op": "dense", "in": source, "out": name, "name": name, "in_size": width, "out_size": out, "act": activation})
        source, width = name, out
    leaves = Layout.of(action).leaves
    deviations = sum(int(np.prod(leaf.shape)) for leaf in leaves if isinstance(leaf.space, spaces.Box))
    if deviations:
        tensors["pi/log_std"] = rng.normal(size=deviations).astype(np.float32)
    interface = {"behaviour": "default", "observation": listed(observation), "action": listed(action),
                 "heads": [{"leaf": "/".join(map(str, leaf.path)), "type": head_name(leaf.space)} for leaf in leaves]}
    asked = rng.normal(size=(4, size)).astype(np.float32) * 2
    x = asked.astype(np.float64)
    if normalise:
        tensors["norm/obs/mean"], tensors["norm/obs/scale"] = rng.normal(size=size).astype(np.float32), rng.uniform(0.5, 2, size).astype(np.float32)
        interface["normalise"] = {"mean": "norm/obs/mean", "scale": "norm/obs/scale", "clip": 1.5}
        x = np.clip((x - tensors["norm/obs/mean"]) * tensors["norm/obs/scale"], -1.5, 1.5)
    plain = {"linear": lambda v: v, "tanh": np.tanh, "relu": lambda v: v * (v > 0), "sigmoid": lambda v: 1 / (1 + np.exp(-v)), "elu": lambda v: np.where(v > 0, v, np.exp(v) - 1),
             "leaky_relu": lambda v: np.where(v > 0, v, 0.01 * v), "silu": lambda v: v / (1 + np.exp(-v)), "softplus": lambda v: np.log(1 + np.exp(v))}
    for block in blocks:
        x = plain[block["act"]](x @ tensors[f"{block['name']}/w"].T + tensors[f"{block['name']}/b"])
    tensors["test/0/in"], tensors["test/0/out"] = asked, x.astype(np.float32)
    spec = {"kind": "policy", "requires": sorted({"dense"} | {head_name(leaf.space) for leaf in leaves}), "producer": {"name": "test", "version": "1"}, "interface": interface,
            "graph": {"inputs": [{"name": "obs", "size": size}], "blocks": blocks, "outputs": [source]}, "selftest": [{"in": "test/0/in", "out": "test/0/out", "tol": 1e-5}]}
    return spec, tensors


def policy_of(*arguments, **named):
    return Policy(read_model(model_bytes(*make(*arguments, **named))))


MODELS = {"all activations": dict(activations=tuple(ACTIVATIONS)), "nested": dict(observation=KEYS, action=ACTIONS, normalise=True),
          "discrete": dict(observation=spaces.Discrete(4, start=2), action=spaces.MultiDiscrete([2, 3])), "bits": dict(observation=spaces.MultiBinary(3), action=spaces.MultiBinary(2)),
          "image": dict(observation=spaces.Box(0, 255, (4, 4, 3), np.uint8), action=spaces.Box(-1, 1, (2,), np.float32))}


# ---- against C++

@needs_program
@pytest.mark.parametrize("world", TRAINED)
def test_answers_as_cpp_does(trained, world):
    policy, file = load_policy(trained[world]), read_model(trained[world].read_bytes())
    assert policy.selftest_error <= 1e-6
    asked, answers = file.tensors["test/0/in"], file.tensors["test/0/out"]
    if not isinstance(policy.observation_space, spaces.Discrete):
        assert np.abs(policy.logits(asked.reshape(len(asked), *policy.observation_space.shape)) - answers).max() <= 1e-6
    observation = policy.observation_space.sample()
    assert policy.action_space.contains(policy.act(observation)) and policy.action_space.contains(policy.act(observation, deterministic=False))


@needs_program
@pytest.mark.parametrize("name", MODELS)
def test_cpp_takes_these_models_too(tmp_path, name):
    path = tmp_path / "model.consac"
    path.write_bytes(model_bytes(*make(**MODELS[name])))
    done = run([PROGRAM, "inspect", path])
    assert done.returncode == 0 and "reproduced" in done.stdout, done.stdout + done.stderr


@needs_program
def test_a_checkpoint_is_no_policy(trained):
    checkpoint = next((trained["road-v0"].parent / "checkpoints").iterdir())
    with pytest.raises(ModelForeign, match="checkpoint"):
        load_policy(checkpoint)


@needs_program
def test_damage_at_every_byte(trained):
    data = trained["cartpole-v1"].read_bytes()
    header = 8 + struct.unpack_from("<Q", data)[0]
    rng = np.random.default_rng(1)
    for at in (*range(header), *range(header, len(data), 7)):
        for bit in range(8) if at < header else [int(rng.integers(8))]:
            changed = bytearray(data)
            changed[at] ^= 1 << bit
            with pytest.raises(ModelError) as told:
                Policy(read_model(bytes(changed)))
            assert "\n" not in str(told.value)
    for size in (*range(0, header, 5), *range(header, len(data), 11)):
        with pytest.raises(ModelError):
            read_model(data[:size])
    with pytest.raises(ModelDamaged):
        read_model(data + b"\0")


# ---- acting

@pytest.mark.parametrize("name", MODELS)
def test_flattens_as_gymnasium(name):
    policy = policy_of(**MODELS[name])
    for seed in range(20):
        policy.observation_space.seed(seed)
        observation = policy.observation_space.sample()
        expected = gymnasium.spaces.flatten(policy.observation_space, observation)
        assert np.allclose(policy.flatten(observation), expected) and policy.flatten(observation).dtype == np.float32
        for deterministic in (True, False):
            assert policy.action_space.contains(policy.act(observation, deterministic))


@pytest.mark.parametrize("name", MODELS)
def test_many_are_as_one(name):
    policy = policy_of(**MODELS[name])
    batched = gymnasium.vector.utils.batch_space(policy.observation_space, 3)
    many = batched.sample()
    singles = list(gymnasium.vector.utils.iterate(batched, many))
    actions = list(gymnasium.vector.utils.iterate(gymnasium.vector.utils.batch_space(policy.action_space, 3), policy.act(many)))
    for single, action, logits in zip(singles, actions, policy.logits(many)):
        assert np.allclose(policy.logits(single), logits, atol=1e-5)
        assert np.allclose(spaces.flatten(policy.action_space, policy.act(single)), spaces.flatten(policy.action_space, action), atol=1e-6)


def duelling(seed=1):
    """A duelling network of values whose two towers share a layer's parameters."""
    rng, observation, action = np.random.default_rng(seed), spaces.Box(-1, 1, (3,), np.float32), spaces.Discrete(4, start=7)
    shapes = {"advantage/0": (5, 3), "advantage": (4, 5), "value": (1, 5)}
    tensors = {f"{name}/w": rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    tensors |= {f"{name}/b": rng.normal(size=shape[0]).astype(np.float32) for name, shape in shapes.items()}
    blocks = [{"op": "dense", "in": "obs", "out": "advantage/0", "name": "advantage/0", "in_size": 3, "out_size": 5, "act": "relu"},
              {"op": "dense", "in": "obs", "out": "value/0", "name": "value/0", "in_size": 3, "out_size": 5, "act": "tanh", "shares": "advantage/0"},
              {"op": "dense", "in": "advantage/0", "out": "advantage", "name": "advantage", "in_size": 5, "out_size": 4, "act": "linear"},
              {"op": "dense", "in": "value/0", "out": "value", "name": "value", "in_size": 5, "out_size": 1, "act": "linear", "of_tomorrow": {"deep": [1]}},
              {"op": "duelling", "in": ["value", "advantage"], "out": "q", "name": "q", "in_size": 5, "out_size": 4, "act": "linear"}]
    asked = rng.normal(size=(4, 3)).astype(np.float32)
    layer = asked.astype(np.float64) @ tensors["advantage/0/w"].T + tensors["advantage/0/b"]
    advantages, value = np.maximum(layer, 0) @ tensors["advantage/w"].T + tensors["advantage/b"], np.tanh(layer) @ tensors["value/w"].T + tensors["value/b"]
    tensors["test/0/in"], tensors["test/0/out"] = asked, (value + advantages - advantages.mean(1)[:, None]).astype(np.float32)
    spec = {"kind": "policy", "requires": ["dense", "duelling", "q_values", "shared_parameters"], "producer": {"name": "test", "version": "1"},
            "interface": {"behaviour": "default", "observation": listed(observation), "action": listed(action), "heads": [{"leaf": "", "type": "q_values"}]},
            "graph": {"inputs": [{"name": "obs", "size": 3}], "blocks": blocks, "outputs": ["q"]}, "selftest": [{"in": "test/0/in", "out": "test/0/out", "tol": 1e-5}]}
    return spec, tensors


def convolutional(channels_first=False, seed=1):
    """A small network of every kind of block, over an image beside two numbers; the answers come from loops."""
    rng = np.random.default_rng(seed)
    shape = (2, 5, 6) if channels_first else (5, 6, 2)
    observation = spaces.Dict({"eye": spaces.Box(0, 255, shape, np.uint8), "speed": spaces.Box(-1, 1, (2,), np.float32)})
    tensors = {"c/w": rng.normal(size=(3, 3, 2, 2)), "c/b": rng.normal(size=3), "n/scale": rng.normal(size=20), "n/shift": rng.normal(size=20), "pi/w": rng.normal(size=(4, 20)), "pi/b": rng.normal(size=4)}
    tensors = {name: value.astype(np.float32) for name, value in tensors.items()}
    layout = {"layout": "CHW"} if channels_first else {}
    blocks = [{"op": "slice", "in": "obs", "out": "eye", "name": "eye", "in_size": 62, "out_size": 60, "act": "linear", "shape": list(shape), "divide_by": 255},
              {"op": "slice", "in": "obs", "out": "speed", "name": "speed", "in_size": 62, "out_size": 2, "act": "linear", "shape": [2], "offset": 60},
              {"op": "convolution", "in": "eye", "out": "c", "name": "c", "in_size": 60, "out_size": 18, "act": "relu", "kernel": [3, 2], "stride": [2, 2], "filters": 3} | layout,
              {"op": "flatten", "in": "c", "out": "f", "name": "f", "in_size": 18, "out_size": 18, "act": "linear"},
              {"op": "concatenation", "in": ["f", "speed"], "out": "all", "name": "all", "in_size": 20, "out_size": 20, "act": "linear"},
              {"op": "layer_norm", "in": "all", "out": "n", "name": "n", "in_size": 20, "out_size": 20, "act": "tanh", "epsilon": 0.01},
              {"op": "dense", "in": "n", "out": "pi", "name": "pi", "in_size": 20, "out_size": 4, "act": "linear"}]
    asked = np.concatenate([rng.integers(0, 256, (3, 60)), rng.normal(size=(3, 2))], 1).astype(np.float32)
    answers = []
    for row in asked.astype(np.float64):
        image = row[:60].reshape(shape) / 255
        image = image.transpose(1, 2, 0) if channels_first else image
        pixels = [max(0.0, (image[2 * y:2 * y + 3, 2 * x:2 * x + 2] * tensors["c/w"][f]).sum() + tensors["c/b"][f]) for y in range(2) for x in range(3) for f in range(3)]
        everything = np.array([*pixels, *row[60:]])
        normal = (everything - everything.mean()) / np.sqrt(((everything - everything.mean()) ** 2).mean() + 0.01)
        answers.append(tensors["pi/w"] @ np.tanh(normal * tensors["n/scale"] + tensors["n/shift"]) + tensors["pi/b"])
    tensors["test/0/in"], tensors["test/0/out"] = asked, np.array(answers, np.float32)
    action = spaces.Discrete(4)
    spec = {"kind": "policy", "requires": sorted({block["op"] for block in blocks} | {"categorical"}), "producer": {"name": "test", "version": "1"},
            "interface": {"behaviour": "default", "observation": listed(observation), "action": listed(action), "heads": [{"leaf": "", "type": "categorical"}]},
            "graph": {"inputs": [{"name": "obs", "size": 62}], "blocks": blocks, "outputs": ["pi"]}, "selftest": [{"in": "test/0/in", "out": "test/0/out", "tol": 1e-5}]}
    return spec, tensors


@pytest.mark.parametrize("channels_first", [False, True])
def test_every_block_is_what_its_loops_say(channels_first):
    policy = Policy(read_model(model_bytes(*convolutional(channels_first))))
    assert policy.selftest_error < 1e-5 and policy.action_space.contains(policy.act(policy.observation_space.sample()))


@needs_program
@pytest.mark.parametrize("channels_first", [False, True])
def test_cpp_takes_every_block_too(tmp_path, channels_first):
    path = tmp_path / "model.consac"
    path.write_bytes(model_bytes(*convolutional(channels_first)))
    done = run([PROGRAM, "inspect", path])
    assert done.returncode == 0 and "reproduced" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("block,change", [(0, {"offset": 3}), (0, {"shape": []}), (0, {"divide_by": 0}), (1, {"offset": -1}), (2, {"kernel": [6, 2]}), (2, {"stride": [0, 1]}), (2, {"filters": 1.5}),
                                          (2, {"layout": "HCW"}), (2, {"out_size": 17}), (3, {"act": "tanh"}), (4, {"in": []}), (4, {"in": ["f", "nothing"]}), (5, {"epsilon": 0}), (5, {"in_size": 19})])
def test_blocks_that_do_not_fit_are_refused(block, change):
    spec, tensors = convolutional()
    spec["graph"]["blocks"][block] |= change
    with pytest.raises(ModelDamaged, match="block"):
        Policy(read_model(model_bytes(spec, tensors)))


class Sum:
    """A block that remembers: the sum of what it saw since the episode began."""

    inputs, state = 1, 1

    def __init__(self, entry, shapes, floats):
        self.shape = shapes[0]

    def __call__(self, x, state):
        return x + state, x + state


def remembering():
    spec, tensors = make(observation=spaces.Box(0, 1000, (1,), np.float32), action=spaces.Box(0, 1000, (1,), np.float32), activations=())
    spec["graph"]["blocks"] = [spec["graph"]["blocks"][0] | {"op": "test_sum"}]
    spec["requires"] = ["gaussian", "test_sum"]
    tensors["test/0/out"] = tensors["test/0/in"]
    return model_bytes(spec, tensors)


def test_a_model_that_remembers_does_so_for_each_slot(monkeypatch):
    monkeypatch.setitem(consac.network.OPS, "test_sum", Sum)
    monkeypatch.setattr(consac.policy, "FEATURES", consac.policy.FEATURES | {"test_sum"})
    policy = Policy(read_model(remembering()))
    assert policy.recurrent and not policy_of().recurrent
    ones = np.ones((3, 1), np.float32)
    assert [policy.act(ones[0])[0] for _ in range(3)] == [1, 2, 3]
    assert policy.act(ones).ravel().tolist() == [4, 1, 1]
    assert policy.act(ones[:2], slots=[7, 1]).ravel().tolist() == [1, 2]
    assert policy.act(ones, begins=[False, True, False]).ravel().tolist() == [5, 1, 2]
    assert policy.act(ones[0], slots=[7])[0] == 2 and policy.logits(ones[0])[0] == 1 and policy.act(ones[0], slots=[7])[0] == 3
    for wrong in ({"slots": [0, 0, 1]}, {"slots": [0, 1]}, {"slots": [-1, 0, 1]}, {"slots": [0.0, 1.0, 2.0]}, {"slots": [0, 1, 1 << 20]}, {"begins": [True]}, {"begins": ["a", "b", "c"]}):
        with pytest.raises(ModelMisfit, match="expected"):
            policy.act(ones, **wrong)
    assert policy.act(ones).ravel().tolist() == [6, 2, 3]


def test_a_layer_that_remembers_and_is_not_built_in_is_refused_by_name():
    with pytest.raises(ModelTooNew, match="test_sum"):
        Policy(read_model(remembering()))


def test_values_take_the_best_legal_choice():
    policy = Policy(read_model(model_bytes(*duelling())))
    for observation in np.random.default_rng(2).normal(size=(50, 3)).astype(np.float32):
        values = policy.logits(observation)
        assert policy.act(observation) == policy.act(observation, deterministic=False) == 7 + values.argmax()
        mask = np.arange(4) != values.argmax()
        assert policy.act(observation, mask=mask.astype(np.int8)) == 7 + np.argsort(values)[-2]


@needs_program
def test_cpp_takes_values_too(tmp_path):
    path = tmp_path / "model.consac"
    path.write_bytes(model_bytes(*duelling()))
    done = run([PROGRAM, "inspect", path])
    assert done.returncode == 0 and "reproduced" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("kind", ["squashed_gaussian", "deterministic"])
def test_actions_from_minus_one_to_one_are_stretched_to_their_bounds(kind):
    action, numbers = spaces.Box(np.array([-2, 0], np.float32), np.array([2, 1], np.float32)), 4 if kind == "squashed_gaussian" else 2
    spec, tensors = make(action=spaces.Box(-1, 1, (numbers,), np.float32), activations=())
    spec["interface"] |= {"action": listed(action), "heads": [{"leaf": "", "type": kind}]}
    spec["requires"] = ["dense", kind]
    del tensors["pi/log_std"]
    policy = Policy(read_model(model_bytes(spec, tensors)))
    observation = np.array([0.1, -0.2, 0.3], np.float32)
    head = policy.logits(observation).astype(np.float64)
    expected = np.tanh(head[:2]) if kind == "squashed_gaussian" else np.clip(head, -1, 1)
    assert np.allclose(policy.act(observation), [2 * expected[0], 0.5 + 0.5 * expected[1]], atol=1e-6)
    drawn = policy.act(np.repeat(observation[None], 4000, 0), deterministic=False, rng=np.random.default_rng(1))
    assert ((drawn >= action.low) & (drawn <= action.high)).all()
    if kind == "squashed_gaussian":
        inner = np.arctanh(np.clip(drawn[:, 0] / 2, -0.9999999, 0.9999999).astype(np.float64))
        assert abs(np.median(inner) - head[0]) < 0.1 * np.exp(np.clip(head[2], -20, 2)) + 1e-3
    spec["interface"]["action"]["high"] = [None, 1]
    with pytest.raises(ModelDamaged, match="bounds"):
        Policy(read_model(model_bytes(spec, tensors)))


def test_heads_that_do_not_fit_are_refused_and_old_files_need_none():
    for change in ({"type": "q_value"}, {"type": "gaussian"}, {"leaf": "wheel"}):
        spec, tensors = duelling()
        spec["interface"]["heads"][0] |= change
        with pytest.raises(ModelDamaged, match="heads"):
            Policy(read_model(model_bytes(spec, tensors)))
    spec, tensors = make(**MODELS["nested"])
    del spec["interface"]["heads"]
    assert Policy(read_model(model_bytes(spec, tensors))).heads == ["categorical", "categorical", "bernoulli", "gaussian"]
    spec, tensors = duelling()
    spec["graph"]["blocks"][1]["shares"] = "value"
    with pytest.raises(ModelDamaged, match="share"):
        Policy(read_model(model_bytes(spec, tensors)))


def test_drawn_actions_follow_the_distribution():
    policy = policy_of(action=spaces.Dict({"c": spaces.Discrete(3, start=5), "g": spaces.Box(-100, 100, (1,), np.float32), "m": spaces.MultiBinary(1)}))
    observation = np.array([0.1, -0.2, 0.3], np.float32)
    logits = policy.logits(observation).astype(np.float64)
    drawn = policy.act(np.repeat(observation[None], 20000, 0), deterministic=False, rng=np.random.default_rng(1))
    likely = np.exp(logits[:3]) / np.exp(logits[:3]).sum()
    assert np.allclose([(drawn["c"] == 5 + i).mean() for i in range(3)], likely, atol=0.02)
    deviation = np.exp(policy._log_std[0])
    assert abs(drawn["g"].mean() - logits[3]) < 0.05 * deviation + 1e-3 and abs(drawn["g"].std() / deviation - 1) < 0.03
    assert abs(drawn["m"].mean() - 1 / (1 + np.exp(-logits[4]))) < 0.02
    again = policy.act(observation, deterministic=False, rng=np.random.default_rng(7))
    assert all(np.array_equal(again[key], value) for key, value in policy.act(observation, deterministic=False, rng=np.random.default_rng(7)).items())


def test_box_actions_are_clipped():
    spec, tensors = make(action=spaces.Box(-0.01, 0.01, (2,), np.float32))
    policy = Policy(read_model(model_bytes(spec, tensors)))
    for deterministic in (True, False):
        actions = policy.act(np.ones((50, 3), np.float32), deterministic)
        assert np.abs(actions).max() <= np.float32(0.01) and actions.dtype == np.float32


def test_masks():
    policy = policy_of(action=spaces.Discrete(3, start=1))
    observation = np.zeros(3, np.float32)
    best = policy.act(observation)
    mask = np.ones(3, np.int8)
    mask[best - 1] = 0
    assert policy.act(observation, mask=mask) != best
    many = np.zeros((200, 3), np.float32)
    assert best not in policy.act(many, deterministic=False, mask=np.repeat(mask[None], 200, 0))
    both = policy_of(action=spaces.MultiDiscrete([2, 3]))
    assert both.act(observation, mask=(np.array([0, 1], np.int8), np.array([0, 0, 1], np.int8))).tolist() == [1, 2]
    bits = policy_of(action=spaces.MultiBinary(2))
    assert bits.act(observation, mask=[1, 0, 0, 1]).tolist() == [0, 1] and bits.act(observation, mask=[0, 1, 1, 0]).tolist() == [1, 0]
    for bad in ([1, 1], [0, 0, 0], np.ones((2, 3), int), [0.5, 1.0, 1.0]):
        with pytest.raises(ModelMisfit):
            policy.act(observation, mask=bad)


@pytest.mark.parametrize("bad", [np.zeros(2), np.zeros((2, 2, 3)), 5, "abc", None, np.array([0, np.nan, 0]), np.array([0, np.inf, 0]), {"a": 1}])
def test_observations_that_do_not_fit(bad):
    with pytest.raises(ModelMisfit):
        policy_of().act(bad)
    with pytest.raises(ModelMisfit):
        policy_of(observation=KEYS).act(bad)
    with pytest.raises(ModelMisfit):
        policy_of(observation=spaces.Discrete(4, start=1)).act(bad)


# ---- refusals

def changed(change, **named):
    spec, tensors = make(**named)
    change(spec, tensors)
    return model_bytes(spec, tensors)


@pytest.mark.parametrize("change", [
    lambda s, t: s["requires"].append("gru"), lambda s, t: s["requires"].append(7)])
def test_unknown_features_are_refused(change):
    with pytest.raises(ModelTooNew, match="newer"):
        Policy(read_model(changed(change)))


def test_a_newer_format_is_refused_and_unknown_members_are_not():
    with pytest.raises(ModelTooNew):
        read_model(model_bytes(*make(), **{"consac.version": "2"}))
    Policy(read_model(changed(lambda s, t: (s.update(news={"a": [1]}), s["interface"].update(hint="x"), t.update({"vf/extra": np.zeros(2, np.float64)})))))


@pytest.mark.parametrize("change", [
    lambda s, t: t.pop("pi/0/w"), lambda s, t: t.update({"pi/0/w": t["pi/0/w"].T.copy()}), lambda s, t: t.update({"pi/0/b": t["pi/0/b"].astype(np.float64)}),
    lambda s, t: t["pi/0/w"].__setitem__((0, 0), np.nan), lambda s, t: t.update({"pi/0/w": t["pi/0/w"] + 1}), lambda s, t: s["graph"]["blocks"][0].update(act="gelu"),
    lambda s, t: s["graph"]["blocks"][0].update(op="conv"), lambda s, t: s["graph"]["blocks"][0].update(in_size=1 << 60), lambda s, t: s["graph"]["blocks"][0].update(out_size=1 << 60),
    lambda s, t: s["graph"]["blocks"][1].update({"in": "pi/1"}), lambda s, t: s["graph"].update(outputs=["vf"]), lambda s, t: s["graph"].update(outputs=[]),
    lambda s, t: s["graph"]["inputs"][0].update(size=4), lambda s, t: s["graph"].update(blocks=5), lambda s, t: s.pop("graph"), lambda s, t: s.pop("selftest"),
    lambda s, t: s["selftest"][0].update(tol=float("1e999")), lambda s, t: s["selftest"][0].update(out="test/0/in"), lambda s, t: s["selftest"][0].update({"in": "gone"}),
    lambda s, t: s["interface"]["observation"].update(shape=[1 << 50]), lambda s, t: s["interface"]["observation"].update(shape=[-3]), lambda s, t: s["interface"]["observation"].update(type="graph"),
    lambda s, t: s["interface"]["action"].update(n=1 << 60), lambda s, t: s["interface"]["action"].update(n=0), lambda s, t: s["interface"].update(action=None), lambda s, t: s["interface"].update(heads=[]),
    lambda s, t: s["interface"].update(normalise={"mean": "a", "scale": "b", "clip": 1}), lambda s, t: s["interface"].update(normalise={"mean": "pi/0/b", "scale": "pi/0/b", "clip": 0}), lambda s, t: s.update(interface=[])])
def test_inconsistent_models_are_refused(change):
    with pytest.raises(ModelDamaged) as told:
        Policy(read_model(changed(change)))
    assert "\n" not in str(told.value)


def renamed(s, t):
    """Nothing asks a writer to give the normaliser's tensors the names that ours gives."""
    t["input mean"], t["s"] = t.pop("norm/obs/mean"), t.pop("norm/obs/scale")
    s["interface"]["normalise"].update(mean="input mean", scale="s")


@needs_program
@pytest.mark.parametrize("fits, change", [(True, renamed)] + [(False, change) for change in (
    lambda s, t: s["interface"]["normalise"].update(scale=0), lambda s, t: s["interface"]["normalise"].update(mean={}), lambda s, t: s["interface"]["normalise"].update(scale="nix"),
    lambda s, t: s["interface"]["normalise"].pop("scale"), lambda s, t: s["interface"]["normalise"].pop("mean"), lambda s, t: s["interface"].update(normalise=[]),
    lambda s, t: s["graph"].update(outputs="pi/1"), lambda s, t: s["graph"].update(blocks={"a": s["graph"]["blocks"][0], "b": s["graph"]["blocks"][1]}),
    lambda s, t: s["graph"].update(inputs={"a": s["graph"]["inputs"][0]}), lambda s, t: s.update(selftest={"a": s["selftest"][0]}), lambda s, t: s.update(requires={"a": "dense"}))])
def test_both_readers_take_and_refuse_the_same(tmp_path, fits, change):
    path = tmp_path / "model.consac"
    path.write_bytes(changed(change, normalise=True))
    done = run([PROGRAM, "inspect", path])
    assert done.returncode == (0 if fits else 6), done.stdout + done.stderr
    assert fits or str(path) in done.stderr and done.stderr.count("\n") == 1, done.stderr
    if fits:
        load_policy(path)
    else:
        with pytest.raises(ModelDamaged):
            load_policy(path)


def test_foreign_files_are_refused(tmp_path):
    good = model_bytes(*make())
    length = struct.unpack_from("<Q", good)[0]
    header = json.loads(good[8:8 + length])
    rebuilt = lambda text: struct.pack("<Q", len(text)) + text + good[8 + length:]
    name = "pi/0/b"
    for bad in [b"", b"\0" * 7, b"PK\3\4 a zip file", b"\x80\4\x95 a pickle", struct.pack("<Q", 1 << 62) + b"{}", struct.pack("<Q", 2) + b"[]", struct.pack("<Q", 2) + b"{}",
                rebuilt(json.dumps({key: value for key, value in header.items() if key != "__metadata__"}).encode()), rebuilt(json.dumps(header | {"__metadata__": {"format": "pt"}}).encode()),
                rebuilt(b" " + json.dumps(header).encode()), rebuilt(b'{"a":1,' + json.dumps(header)[1:].encode()), rebuilt(b'{"a":' + b"[" * 5000 + b"]" * 5000 + b"," + json.dumps(header)[1:].encode()),
                rebuilt(json.dumps(header)[:-1].encode() + b',"' + name.encode() + b'":' + json.dumps(header[name]).encode() + b"}"),
                rebuilt(json.dumps(header | {name: header[name] | {"data_offsets": [0, 4]}}).encode()), rebuilt(json.dumps(header | {name: header[name] | {"dtype": "F16"}}).encode()),
                rebuilt(json.dumps(header | {"hole": {"dtype": "F32", "shape": [1.0], "data_offsets": [0, 4]}}).encode()), rebuilt(json.dumps(header | {"over": header[name]}).encode()),
                model_bytes("[]", {}), model_bytes("[" * 100000, {}), model_bytes('{"a":NaN}', {}), model_bytes(make()[0] | {"kind": "checkpoint"}, make()[1])]:
        path = tmp_path / "bad.consac"
        path.write_bytes(bad)
        with pytest.raises(ModelError) as told:
            load_policy(path)
        assert "\n" not in str(told.value) and str(path) in str(told.value)
    with pytest.raises(FileNotFoundError):
        load_policy(tmp_path / "none.consac")


# ---- runs and files

def test_a_run_with_one_behaviour_and_with_several(tmp_path):
    spec, tensors = make()
    (tmp_path / "one").mkdir(), (tmp_path / "none").mkdir(), (tmp_path / "several").mkdir()
    (tmp_path / "one/model.consac").write_bytes(model_bytes(spec, tensors))
    assert load_policy(tmp_path / "one").act(np.zeros(3)) == load_policy(str(tmp_path / "one/model.consac")).act(np.zeros(3))
    for name in ("hunt", "../flee"):
        named = spec | {"interface": spec["interface"] | {"behaviour": name}}
        (tmp_path / "several" / f"{name.replace('../', '%2E%2E%2F')}.consac").write_bytes(model_bytes(named, tensors))
    assert set(load_policies(tmp_path / "several")) == {"hunt", "../flee"}
    assert load_policy(tmp_path / "several", behaviour="../flee").behaviour == "../flee"
    for folder, named, why in (("several", {}, "'hunt'.*name one"), ("several", {"behaviour": "fly"}, "no model of the behaviour 'fly'"), ("none", {}, "without a model")):
        with pytest.raises(ModelError, match=why):
            load_policy(tmp_path / folder, **named)
    (tmp_path / "several/copy.consac").write_bytes((tmp_path / "several/hunt.consac").read_bytes())
    with pytest.raises(ModelError, match="second model"):
        load_policies(tmp_path / "several")


@needs_program
def test_a_run_that_the_program_trained_is_loaded_by_its_folder(trained):
    assert load_policy(trained["road-v0"].parent).behaviour == "default"


def test_a_model_with_anything_anywhere_is_refused_in_words(tmp_path):
    """Whatever stands in a specification: it is used, or a ModelError says why not."""
    spec, tensors = make(normalise=True)
    odd = [None, -1, 1 << 70, 10 ** 400, 1.5, float("inf"), "x", [], {}, [1 << 70], [[]], True, "a\nb", {"a": []}]
    paths = []

    def walk(value, path):
        paths.append(path)
        for key, below in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
            walk(below, (*path, key))
    walk(spec, ())
    file, refused = tmp_path / "odd.consac", 0
    for path in paths[1:]:
        for value in odd:
            changed = json.loads(json.dumps(spec))
            at = changed
            for key in path[:-1]:
                at = at[key]
            at[path[-1]] = value
            file.write_bytes(model_bytes(changed, tensors))
            try:
                load_policy(file)
            except ModelError as error:
                assert "\n" not in str(error) and len(str(error)) < 3000
                refused += 1
    assert refused > 200


def test_a_header_with_anything_anywhere_is_refused_in_words(tmp_path):
    good = model_bytes(*make())
    length = struct.unpack_from("<Q", good)[0]
    header, file = json.loads(good[8:8 + length]), tmp_path / "odd.consac"
    for name, entry in header.items():
        for key in entry if name != "__metadata__" else ():
            for value in (None, 1 << 70, "x", ["F32"], [0, 1 << 61, 1 << 61], [[]], {}, [1 << 70, 1 << 70], "7" * 5000):
                text = json.dumps(header | {name: entry | {key: value}}).replace('"' + "7" * 5000 + '"', "7" * 5000).encode()
                file.write_bytes(struct.pack("<Q", len(text)) + text + good[8 + length:])
                with pytest.raises(ModelError):
                    load_policy(file)


def test_an_empty_batch_is_an_empty_batch_of_actions():
    assert policy_of().act(np.zeros((0, 3), np.float32)).shape == (0,)
    assert policy_of().act(np.zeros((0, 3), np.float32), mask=np.ones((0, 3), np.int8), deterministic=False).shape == (0,)


def test_a_mask_by_position_is_refused_in_words():
    with pytest.raises(TypeError, match="mask=") as told:
        policy_of().act(np.zeros(3, np.float32), np.ones(3, np.int8))
    assert "truth value" not in str(told.value)


@pytest.mark.parametrize("action", [ACTIONS, spaces.Tuple([spaces.Discrete(3), spaces.MultiBinary(2)]), spaces.MultiBinary(3), spaces.MultiDiscrete([2, 3]), spaces.Discrete(4)])
def test_a_mask_as_sample_takes_it_is_the_same_as_its_flat_row(action):
    from consac.env import mask_value

    policy, rng = policy_of(action=action), np.random.default_rng(1)
    size = Layout.of(action).mask_bytes
    for _ in range(50):
        row, observation = rng.integers(0, 2, size).astype(np.uint8), rng.normal(size=3).astype(np.float32)
        try:
            expected = policy.logits(observation, row)
        except ModelMisfit:
            continue  # nothing is legal
        assert np.array_equal(policy.logits(observation, mask_value(action, row)), expected)
    for bad in ({}, (), {"x": 1}, [np.ones(1)], "abc", [[1], [1, 0]]):
        with pytest.raises(ModelMisfit):
            policy.act(np.zeros(3, np.float32), mask=bad)
