"""Agents with goals in the running engine: what they are paid, and what is learned from goals that were not meant, inside
the engine and over protocol 2."""
import pytest

from test_native import ENDED, built, summary, tensors, train  # noqa: F401 (built: the extension must be there)
from test_traps import TRAIN, finished, start

HINDSIGHT = {"replay_buffer_class": "HerReplayBuffer", "net_arch": "[32]", "batch_size": "64", "learning_rate": "2e-3",
             "gamma": "0.9", "train_freq": "1", "learning_starts": "200"}
STEPS = 8000  # of 50 an episode: the last 100 episodes are those behind the first 3,000 steps
LEAST = -25.0  # who does not move has -49, who goes there at once -10


def as_argument(settings):
    return "set=" + ",".join(f"{key}:{value}" for key, value in settings.items())


@pytest.mark.parametrize("place", ["consac train", "inside the engine"])
def test_learning_from_goals_that_were_not_meant(godot, tmp_path, place):
    """Paid 0 where it is there and -1 elsewhere; what is learned without other goals is next to nothing."""
    arguments = [f"steps={STEPS}", "sessions=1", "quit=1", "loop=1"]
    if place == "consac train":
        engine = start(godot, "reaching", "port=0", "protocol=auto", *arguments)
        trainer = train(godot, [engine.port()], tmp_path, "reach", settings=HINDSIGHT, algorithm="sac")
        assert summary(trainer)["steps"] == STEPS
    else:
        engine = start(godot, "reaching", "mode=train", *arguments, "algorithm=sac", as_argument(HINDSIGHT),
                       f"model={tmp_path}/reach.consac")
    said = engine.wait_for(ENDED)
    print(f"reaching, {place}: {said.group(0)}")
    assert engine.finish()[0] == 0
    assert float(said.group(5)) > LEAST


def test_what_goals_pay_is_what_is_told(godot, tmp_path):
    """The engine's own sums are those of the learner and of a recording; a reward beside the goals' is warned of, once."""
    output = finished(start(godot, "reaching", *TRAIN, "steps=200", "loop=1", "set=n_steps:40", f"record={tmp_path}/played.consac",
                            DENSE="true", OWN="0.5"))
    assert output.count("was given a reward of 0.5, but its goals are worth -") == 1, output
    recorded = tensors(tmp_path / "played.consac")
    rewards, goals = (memoryview(recorded[name][2]).cast("f").tolist()
                      for name in ("rewards", "observations/achieved_goal"))
    wanted = memoryview(recorded["observations/desired_goal"][2]).cast("f").tolist()
    assert len(rewards) == 200
    for step in range(49):  # of the first episode: each reward is of the observation that comes next
        apart = [goals[2 * step + 2 + i] - wanted[2 * step + i] for i in (0, 1)]
        assert rewards[step] == pytest.approx(-(apart[0] ** 2 + apart[1] ** 2) ** 0.5, abs=1e-5), step


def test_what_is_wrong_with_goals_is_one_line(godot):
    output = finished(start(godot, "reaching", *TRAIN, "steps=200", NAME='&"wanted"'), 1)
    assert "Reaches, goals: there is no observation 'desired_goal'; add a box of that name" in output.splitlines()[-1], output
