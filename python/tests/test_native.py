"""consac.native: models that act by the library of consac.h do what they do with numpy, and numpy acts where there is none."""
import copy
import os
import pathlib

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import consac.native
from consac.policy import ModelMisfit, Policy, load_policy, read_model
from model_files import MODELS, TRAINED, make, model_bytes
from program import needs_program

LIBRARY = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", "")) / "engines/c" / consac.native.NAME


@pytest.fixture
def library(monkeypatch):
    monkeypatch.setenv("CONSAC_LIBRARY", str(LIBRARY))


@pytest.fixture
def no_library(monkeypatch):
    monkeypatch.setenv("CONSAC_LIBRARY", "")


def pair(path):
    """A model file's policies of both backends."""
    data = path.read_bytes() if isinstance(path, pathlib.Path) else path
    model = consac.native.load_model(data)
    assert model is not None
    policies = Policy(read_model(data), model), Policy(read_model(data))
    assert [policy.backend for policy in policies] == ["native", "numpy"]
    return policies


def alike(space, one, other):
    assert space.contains(one) and np.allclose(spaces.flatten(space, one), spaces.flatten(space, other), atol=1e-5), (one, other)


@needs_program
@pytest.mark.parametrize("name", MODELS)
def test_both_backends_do_the_same(library, name):
    native, plain = pair(model_bytes(*make(**MODELS[name])))
    native.observation_space.seed(4)
    observations = [native.observation_space.sample() for _ in range(30)]
    for observation in observations:
        alike(native.action_space, native.act(observation), plain.act(observation))
    many = gymnasium.vector.utils.concatenate(native.observation_space, observations, gymnasium.vector.utils.create_empty_array(native.observation_space, len(observations)))
    batched = gymnasium.vector.utils.batch_space(native.action_space, len(observations))
    actions = list(gymnasium.vector.utils.iterate(batched, native.act(many)))
    for observation, action in zip(observations, actions):
        alike(native.action_space, action, native.act(observation))


@needs_program
@pytest.mark.parametrize("world", TRAINED)
def test_trained_models_do_the_same(library, trained, world):
    native, plain = pair(pathlib.Path(trained[world]))
    native.observation_space.seed(1)
    for _ in range(50):
        observation = native.observation_space.sample()
        alike(native.action_space, native.act(observation), plain.act(observation))


@needs_program
def test_masks_and_refusals_are_the_same(library):
    native, plain = pair(model_bytes(*make(**MODELS["discrete"])))
    for seed in range(20):
        rng = np.random.default_rng(seed)
        mask = np.concatenate([rng.permutation([1, 0]), rng.permutation([1, 1, 0])]).astype(np.int8)
        observation = 2 + seed % 4
        assert native.act(observation, mask=mask).tolist() == plain.act(observation, mask=mask).tolist()
    bad_box = model_bytes(*make())
    for policy in pair(bad_box):
        for observation, mask in ((np.array([0.0, np.nan, 0.0], np.float32), None), (np.zeros(4, np.float32), None), (np.zeros(3), [0, 0, 0])):
            with pytest.raises(ModelMisfit, match="NaN or infinity|of shape|without any legal"):
                policy.act(observation, mask=mask)


@needs_program
def test_what_no_row_holds_is_numpys(library):
    native, plain = pair(model_bytes(*make(**MODELS["image"])))
    between = np.full((4, 4, 3), 0.5)
    alike(native.action_space, native.act(between), plain.act(between))
    alike(native.action_space, native.act(between.astype(np.int64) + 300), plain.act(between.astype(np.int64) + 300))


@needs_program
def test_draws_come_from_the_generator_that_is_given(library):
    native, plain = pair(model_bytes(*make()))
    observation = np.zeros(3, np.float32)
    drawn = [[policy.act(observation, False, rng=np.random.default_rng(i)) for i in range(40)] for policy in (native, plain)]
    assert drawn[0] == drawn[1] and len(set(map(int, drawn[0]))) > 1


@needs_program
def test_copies_are_models_of_their_own(library):
    native, _ = pair(model_bytes(*make()))
    observation = np.ones(3, np.float32)
    other = copy.deepcopy(native)
    assert other.backend == "native" and other._native._handle.value != native._native._handle.value
    assert other.act(observation) == native.act(observation)


def test_numpy_acts_where_there_is_no_library(no_library, tmp_path):
    (tmp_path / "model.consac").write_bytes(model_bytes(*make()))
    policy = load_policy(tmp_path)
    assert policy.backend == "numpy" and policy.action_space.contains(policy.act(np.ones(3, np.float32)))


def test_a_library_that_is_none_is_told_of_once(monkeypatch, tmp_path, caplog):
    (tmp_path / "libconsac.so").write_bytes(b"no library")
    (tmp_path / "model.consac").write_bytes(model_bytes(*make()))
    monkeypatch.setenv("CONSAC_LIBRARY", str(tmp_path / "libconsac.so"))
    assert [load_policy(tmp_path).backend for _ in range(2)] == ["numpy", "numpy"]
    assert [record.getMessage().split(":")[0] for record in caplog.records] == ["acting with numpy"]


@needs_program
def test_a_model_that_the_library_refuses_is_numpys(library):
    assert consac.native.load_model(b"no model") is None


# ---- as a model of Stable Baselines3

def test_predict_is_what_evaluate_policy_calls(no_library):
    policy = Policy(read_model(model_bytes(*make())))
    observations = np.random.default_rng(1).normal(size=(5, 3)).astype(np.float32)
    actions, state = policy.predict(observations, state="as given", episode_start=np.ones(5, bool), deterministic=True)
    assert state == "as given" and actions.tolist() == policy.act(observations).tolist()
    masks = np.tile([0, 1, 0], (5, 1))
    assert policy.predict(observations, action_masks=masks)[0].tolist() == [1] * 5
