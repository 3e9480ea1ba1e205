"""Our clients against the real engine: `consac serve`, found below CONSAC_BUILD_DIR."""
import contextlib

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import consac
from program import PROGRAM, needs_program, run

pytestmark = needs_program


@pytest.mark.parametrize("world, gym_id", [("cartpole-v1", "CartPole-v1"), ("pendulum-v1", "Pendulum-v1")])
def test_spaces_are_gymnasiums(serve, world, gym_id):
    with consac.make(serve(world)) as env, gymnasium.make(gym_id) as native:
        assert env.action_space == native.action_space
        assert env.observation_space.shape == native.observation_space.shape
        assert np.allclose(env.observation_space.high, native.observation_space.high)


def test_one_seed_one_episode_and_the_time_limit_truncates(serve):
    with consac.make(serve("pendulum-v1")) as env:
        episodes = []
        for _ in range(2):
            observation, _ = env.reset(seed=3)
            episode, truncated = [observation], False
            while not truncated:
                observation, reward, terminated, truncated, _ = env.step(np.array([0.5], np.float32))
                episode.append(observation)
                assert not terminated and isinstance(reward, float)
            episodes.append(np.array(episode))
        assert len(episodes[0]) == 201 and np.array_equal(*episodes)


@pytest.mark.parametrize("world", ["cartpole-v1", "pendulum-v1", "maze-v0"])
@pytest.mark.parametrize("shared_memory", [True, False])
def test_gymnasiums_checker_finds_nothing(serve, world, shared_memory):
    with consac.make(serve(world), shared_memory=shared_memory) as env:
        check_env(env)  # makes a second environment beside the first, so the engine must serve several trainers


def test_trainers_beside_each_other_have_worlds_of_their_own(serve):
    url = serve("pendulum-v1", "--envs", "3", "--trainers", "4")
    everybody = [consac.make_vec(url) for _ in range(4)]
    with pytest.raises(consac.EngineBusy):
        consac.make_vec(url)
    seen = [[envs.reset(seed=5)[0]] for envs in everybody]
    for step in range(50):
        for envs, rows in zip(everybody, seen):
            rows.append(envs.step(np.full((3, 1), 0.1 * (step % 7), np.float32))[0])
    assert all(np.array_equal(rows, seen[0]) for rows in seen)
    for envs in everybody:
        envs.close()
    consac.make_vec(url).close()  # there is room again


@pytest.mark.parametrize("mode", list(gymnasium.vector.AutoresetMode))
def test_vectors_of_every_mode(serve, mode):
    with contextlib.closing(consac.make_vec(serve("cartpole-v1", "--envs", "5"), autoreset_mode=mode)) as envs:
        observations, _ = envs.reset(seed=7)
        rng, ended = np.random.default_rng(1), np.zeros(5, bool)
        for _ in range(200):
            if mode == gymnasium.vector.AutoresetMode.DISABLED and ended.any():
                observations, _ = envs.reset(options={"reset_mask": ended})
            observations, rewards, terminated, truncated, infos = envs.step(rng.integers(0, 2, 5))
            if mode == gymnasium.vector.AutoresetMode.NEXT_STEP:
                assert (rewards[ended] == 0).all() and (rewards[~ended] == 1).all()
            if mode == gymnasium.vector.AutoresetMode.SAME_STEP and (terminated | truncated).any():
                assert (infos["_final_obs"] == (terminated | truncated)).all()
            ended = terminated | truncated
        assert envs.single_observation_space.contains(observations[0])


def test_text_protocol_1(serve):
    with consac.make(serve("road-v0", "--protocol", "text1")) as env:
        observation, _ = env.reset()
        for _ in range(60):
            observation, reward, terminated, truncated, _ = env.step(1)
            assert reward in (0.0, 1.0)


def test_an_action_that_is_none_is_refused_and_the_session_goes_on(serve):
    with consac.make(serve("cartpole-v1")) as env:
        env.reset(seed=1)
        with pytest.raises(Exception, match="7|OUT_OF_RANGE|action"):
            env.step(7)
        env.step(1)


def test_an_access_token_is_asked_for(serve):
    url = serve("road-v0", "--token", "sesame")
    with pytest.raises(consac.ConsacError, match="token"):
        consac.make(url)
    consac.make(url, token="sesame").close()


def test_a_model_of_ours_acts_in_our_engine(serve, tmp_path):
    done = run([PROGRAM, "train", "road-v0", "--steps", "6000", "--name", "walker", "--dir", tmp_path, "--no-tensorboard", "--json"])
    assert done.returncode == 0, done.stderr
    policy = consac.load_policy(tmp_path / "walker/model.consac")
    with consac.make(serve("road-v0")) as env:
        observation, _ = env.reset(seed=5)
        rewards = []
        for _ in range(200):
            observation, reward, terminated, truncated, _ = env.step(policy.act(observation))
            rewards.append(reward)
            if terminated or truncated:
                observation, _ = env.reset()
        assert np.mean(rewards) > 0.5
