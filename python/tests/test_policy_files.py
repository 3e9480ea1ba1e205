"""consac.policy: what is no sound model is refused, and runs are loaded by their folders."""
import json
import struct

import numpy as np
import pytest
from gymnasium import spaces

from consac.layout import Layout
from consac.policy import ModelDamaged, ModelError, ModelForeign, ModelMisfit, ModelTooNew, Policy, load_policies, load_policy, read_model
from model_files import ACTIONS, make, model_bytes, policy_of
from program import PROGRAM, needs_program, run


# ---- against C++

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
    optional = data.index(b"consac.tensors.sha256")
    unread = range(optional, optional + len("consac.tensors.sha256"))  # under another name it is not asked for
    for at in (*range(header), *range(header, len(data), 7)):
        if at in unread:
            continue
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
    (tmp_path / "one/somebodys.consac").write_bytes(b"of his own")
    assert set(load_policies(tmp_path / "one")) == {"default"}
    for name in ("hunt", "../flee", "model"):
        named = spec | {"interface": spec["interface"] | {"behaviour": name}}
        (tmp_path / "several" / f"{name.replace('../', '%2E%2E%2F')}.consac").write_bytes(model_bytes(named, tensors))
    assert set(load_policies(tmp_path / "several")) == {"hunt", "../flee", "model"}
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
                assert "\n" not in str(error) and len(str(error)) < 400
                refused += 1
    assert refused > 200


def test_a_header_with_anything_anywhere_is_refused_in_words(tmp_path):
    good = model_bytes(*make())
    length = struct.unpack_from("<Q", good)[0]
    header, file = json.loads(good[8:8 + length]), tmp_path / "odd.consac"
    for name, entry in header.items():
        for key in entry if name != "__metadata__" else ():
            for value in (None, 1 << 70, "x", ["F32"], [0, 1 << 61, 1 << 61], [[]], {}, [1 << 70, 1 << 70], "7" * 5000, "y" * 5000):
                text = json.dumps(header | {name: entry | {key: value}}).replace('"' + "7" * 5000 + '"', "7" * 5000).encode()
                file.write_bytes(struct.pack("<Q", len(text)) + text + good[8 + length:])
                with pytest.raises(ModelError) as told:
                    load_policy(file)
                assert "\n" not in str(told.value) and len(str(told.value)) < 400


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
