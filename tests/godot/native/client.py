"""A trainer that answers at once and learns nothing: what engine and wire take by themselves.
client.py PORT SECONDS: steps all environments of the engine, prints agent steps a second."""
import sys
import time

import consac
import numpy as np

environments = consac.make_vec(f"tcp://127.0.0.1:{sys.argv[1]}", protocol=2)
environments.reset(seed=1)
actions = np.zeros((environments.num_envs, *environments.single_action_space.shape), environments.single_action_space.dtype)
start, steps = time.monotonic(), 0
while (passed := time.monotonic() - start) < float(sys.argv[2]):
    environments.step(actions)
    steps += 1
environments.close()
print(round(steps * environments.num_envs / passed))
