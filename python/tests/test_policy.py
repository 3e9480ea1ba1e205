"""consac.policy: models of the C++ trainer act alike here."""
import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import consac.network
import consac.policy
from consac.policy import ModelDamaged, ModelMisfit, ModelTooNew, Policy, load_policy, read_model
from model_files import KEYS, MODELS, TRAINED, listed, make, model_bytes, policy_of
from program import PROGRAM, needs_program, run


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


def state_noise(squashed=False, action=spaces.Box(np.array([-2, 0], np.float32), np.array([2, 1], np.float32)), **members):
    """A model whose noise follows its one hidden layer of five."""
    spec, tensors = make(action=action)
    kind = "squashed_sde_gaussian" if squashed else "sde_gaussian"
    spec["interface"]["heads"] = [{"leaf": "", "type": kind, "std": "pi/log_std", "features": 5, **members}]
    spec["requires"] = ["dense", "concatenation", kind]
    blocks, hidden, out = spec["graph"]["blocks"], *(block["out"] for block in spec["graph"]["blocks"][-2:])
    blocks[-1]["out"] = "mean"
    blocks.append({"op": "concatenation", "in": ["mean", hidden], "out": out, "name": out, "in_size": 7, "out_size": 7, "act": "linear"})
    tensors["pi/log_std"] = np.linspace(-1, 0.5, 5 if members.get("full_std") is False else 10).astype(np.float32)
    asked = tensors["test/0/in"]
    first, last = blocks[0]["name"], blocks[1]["name"]
    phi = np.tanh(asked @ tensors[f"{first}/w"].T + tensors[f"{first}/b"])
    tensors["test/0/out"] = np.concatenate([phi @ tensors[f"{last}/w"].T + tensors[f"{last}/b"], phi], 1).astype(np.float32)
    return spec, tensors


@pytest.mark.parametrize("squashed", [False, True])
def test_noise_that_follows_the_state_is_an_agents_own(squashed):
    spec, tensors = state_noise(squashed, clip_mean=0.5, sample_freq=3)
    policy, rng = Policy(read_model(model_bytes(spec, tensors))), np.random.default_rng(1)
    seen = np.array([0.1, -0.2, 0.3], np.float32)
    mean = np.clip(policy.logits(seen).astype(np.float64), -0.5, 0.5)
    assert policy.logits(seen).shape == (2,)
    expected = [2 * np.tanh(mean[0]), 0.5 + 0.5 * np.tanh(mean[1])] if squashed else np.clip(mean, [-2, 0], [2, 1])
    assert np.allclose(policy.act(seen), expected, atol=1e-6)
    two = np.stack([seen, seen])
    drawn = [policy.act(two, False, rng=rng, slots=[4, 9]) for _ in range(4)]
    assert (drawn[0] == drawn[1]).all() and (drawn[0] == drawn[2]).all() and (drawn[0] != drawn[3]).any(), "for three actions"
    assert (drawn[0][0] != drawn[0][1]).any()
    again = policy.act(two, False, rng=rng, slots=[4, 9], begins=[True, False])
    assert (again[0] != drawn[3][0]).any() and (again[1] == drawn[3][1]).all()


@pytest.mark.parametrize("members", [{}, {"full_std": False}, {"use_expln": True}])
def test_noise_that_follows_the_state_has_the_variance_that_the_model_says(members):
    spec, tensors = state_noise(action=spaces.Box(-50, 50, (2,), np.float32), **members)
    policy, rng = Policy(read_model(model_bytes(spec, tensors))), np.random.default_rng(1)
    seen = np.array([0.1, -0.2, 0.3], np.float32)
    drawn = policy.act(np.repeat(seen[None], 6000, 0), False, rng=rng).astype(np.float64)
    phi = np.tanh(tensors["pi/0/w"] @ seen + tensors["pi/0/b"]).astype(np.float64)
    log_std = tensors["pi/log_std"].astype(np.float64).reshape(5, -1)
    sigma = np.where(log_std > 0, np.log1p(log_std.clip(0)) + 1, np.exp(log_std)) if "use_expln" in members else np.exp(log_std)
    assert np.allclose(drawn.std(0), np.sqrt((phi ** 2) @ (sigma ** 2)), rtol=0.05)
    assert np.allclose(drawn.mean(0), policy.logits(seen), atol=0.05 * drawn.std())


def test_heads_that_follow_the_state_and_cannot_be_are_refused():
    for change in ({"features": 6}, {"features": 0}, {"features": "5"}, {"features": None}, {"clip_mean": -1}, {"full_std": 1}, {"sample_freq": 2.5}):
        spec, tensors = state_noise()
        spec["interface"]["heads"][0] |= change
        with pytest.raises(ModelDamaged):
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
