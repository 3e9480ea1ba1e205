"""Stock environments against the same ones served by consac.serve: every step is equal."""
import gymnasium
import pytest
from gymnasium.utils.env_match import check_environments_match

import consac
from consac.serve import Server

STEPS = {"CartPole-v1": 10000, "Pendulum-v1": 10000, "FrozenLake-v1": 10000, "Taxi-v4": 10000, "Blackjack-v1": 10000}


@pytest.mark.parametrize("name", STEPS)
def test_a_served_environment_is_the_stock_one(name):
    if name not in gymnasium.registry:
        name = name.replace("v4", "v3")
    server = Server(lambda: gymnasium.make(name, disable_env_checker=True)).start()
    try:
        stock = gymnasium.wrappers.TransformReward(gymnasium.make(name), float)  # on the wire a reward is f64, whatever its type was
        served = consac.make(f"tcp://127.0.0.1:{server.port}", protocol=2)
        assert served.observation_space == stock.observation_space
        assert served.action_space == stock.action_space
        check_environments_match(stock, served, STEPS.get(name, 10000))
        served.close()
        stock.close()
    finally:
        server.close()
