"""Stable Baselines3: its checker, and ConsacVecEnv against its DummyVecEnv."""
import warnings

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: its tests did not run")
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import DummyVecEnv, VecCheckNan, VecMonitor

import consac
from consac.serve import Server

LIMITS = {"CartPole-v1": 25, "Pendulum-v1": 20}


@pytest.fixture
def serve():
    servers = []

    def start(name, envs):
        server = Server(lambda: gymnasium.make(name, max_episode_steps=LIMITS[name]), envs).start()
        servers.append(server)
        return f"tcp://127.0.0.1:{server.port}"

    yield start
    for server in servers:
        server.close()


@pytest.mark.parametrize("name", LIMITS)
def test_check_env(name, serve):
    env = consac.make(serve(name, 1), protocol=2)
    with warnings.catch_warnings():
        warnings.simplefilter("error" if name == "CartPole-v1" else "ignore")
        check_env(env)
    env.close()


@pytest.mark.parametrize("name", LIMITS)
def test_it_is_dummy_vec_env(name, serve):
    ours = consac.ConsacVecEnv(serve(name, 3))
    theirs = DummyVecEnv([lambda: gymnasium.make(name, max_episode_steps=LIMITS[name])] * 3)
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    ours.seed(5)
    theirs.seed(5)
    assert (ours.reset() == theirs.reset()).all()
    ours.action_space.seed(1)
    kinds = set()
    for _ in range(200):
        actions = np.array([ours.action_space.sample() for _ in range(3)])
        mine, expected = ours.step(actions), theirs.step(actions)
        for a, b in zip(mine[:3], expected[:3]):
            assert a.dtype == b.dtype and (a == b).all()
        for a, b in zip(mine[3], expected[3]):
            assert a.keys() == b.keys()
            assert a["TimeLimit.truncated"] is bool(b["TimeLimit.truncated"])
            if "terminal_observation" in b:
                kinds.add(a["TimeLimit.truncated"])
                assert (a["terminal_observation"] == b["terminal_observation"]).all()
    assert True in kinds and (name == "Pendulum-v1" or False in kinds)
    ours.close()
    ours.close()


def test_ppo_trains_over_it(serve):
    env = VecCheckNan(VecMonitor(consac.ConsacVecEnv(serve("CartPole-v1", 4))), raise_exception=True)
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=2, seed=1).learn(512)
    assert len(model.ep_info_buffer) > 5
    env.close()


def test_evaluate_policy_takes_our_policies():
    from stable_baselines3.common.evaluation import evaluate_policy

    from consac.policy import Policy, read_model
    from model_files import make, model_bytes

    pole = gymnasium.make("CartPole-v1")
    policy = Policy(read_model(model_bytes(*make(observation=pole.observation_space, action=pole.action_space))))
    rewards, lengths = evaluate_policy(policy, pole, n_eval_episodes=3, return_episode_rewards=True, warn=False)
    assert len(rewards) == 3 and rewards == lengths and min(rewards) >= 8
