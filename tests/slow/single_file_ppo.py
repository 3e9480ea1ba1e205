"""PPO in one file that reads from top to bottom, in CleanRL's manner, for any gymnasium.vector environment with a flat Box
observation and Discrete actions. It knows nothing of CONSAC: ecosystem_proofs.py hands it our vector environment.

Source: Schulman et al. 2017, arXiv:1707.06347; the details of Huang et al. 2022, "The 37 Implementation Details of PPO"."""
import dataclasses

import numpy as np
import torch
from torch import nn


@dataclasses.dataclass
class Settings:
    """Hyperparameters; the defaults are RL Baselines3 Zoo's for CartPole-v1."""

    total_steps: int = 100_000
    seed: int = 1
    num_steps: int = 32  # of each environment per update
    learning_rate: float = 1e-3  # goes to 0 linearly
    gamma: float = 0.98
    gae_lambda: float = 0.8
    epochs: int = 20
    minibatch: int = 256
    clip: float = 0.2  # goes to 0 linearly
    entropy: float = 0.0
    value: float = 0.5
    max_grad_norm: float = 0.5


def layer(inputs: int, outputs: int, std: float = np.sqrt(2)) -> nn.Linear:
    linear = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(linear.weight, std)
    nn.init.zeros_(linear.bias)
    return linear


class Agent(nn.Module):
    def __init__(self, observations: int, actions: int):
        super().__init__()
        self.critic = nn.Sequential(layer(observations, 64), nn.Tanh(), layer(64, 64), nn.Tanh(), layer(64, 1, std=1.0))
        self.actor = nn.Sequential(layer(observations, 64), nn.Tanh(), layer(64, 64), nn.Tanh(), layer(64, actions, std=0.01))

    def value_of(self, observations):
        return self.critic(observations).squeeze(-1)

    def act(self, observations, actions=None):
        """Actions, their log probabilities, entropies and the states' values."""
        distribution = torch.distributions.Categorical(logits=self.actor(observations))
        if actions is None:
            actions = distribution.sample()
        return actions, distribution.log_prob(actions), distribution.entropy(), self.value_of(observations)


def learn(envs, settings: Settings, progress=lambda steps, mean_return: None) -> Agent:
    """Trains on `envs`, which must begin the next episode within the step that ends one (AutoresetMode.SAME_STEP)."""
    torch.manual_seed(settings.seed)
    shuffle = np.random.default_rng(settings.seed)
    width, length = envs.num_envs, settings.num_steps
    agent = Agent(int(np.prod(envs.single_observation_space.shape)), int(envs.single_action_space.n))
    optimizer = torch.optim.Adam(agent.parameters(), lr=settings.learning_rate, eps=1e-5)

    observations = torch.zeros((length, width) + envs.single_observation_space.shape)  # [T, N, ...]
    actions = torch.zeros((length, width), dtype=torch.long)
    log_probs, rewards, ends, values = (torch.zeros((length, width)) for _ in range(4))
    running, returns = np.zeros(width), []

    now = torch.as_tensor(envs.reset(seed=settings.seed)[0], dtype=torch.float32)
    updates = settings.total_steps // (length * width)
    for update in range(updates):
        left = 1.0 - update / updates
        optimizer.param_groups[0]["lr"] = left * settings.learning_rate

        # Rollout.
        for step in range(length):
            observations[step] = now
            with torch.no_grad():
                actions[step], log_probs[step], _, values[step] = agent.act(now)
            after, reward, terminated, truncated, infos = envs.step(actions[step].numpy())
            now = torch.as_tensor(after, dtype=torch.float32)
            rewards[step] = torch.as_tensor(reward, dtype=torch.float32)
            over = terminated | truncated
            ends[step] = torch.as_tensor(over, dtype=torch.float32)
            for i in np.flatnonzero(truncated & ~terminated):  # the episode was cut, it did not end: what it was still worth
                with torch.no_grad():
                    final = torch.as_tensor(np.asarray(infos["final_obs"][i], np.float32))
                    rewards[step, i] += settings.gamma * agent.value_of(final)
            running += reward
            returns.extend(running[over])
            running[over] = 0.0

        # Generalised advantages, backwards.
        with torch.no_grad():
            advantages, follows, ahead = torch.zeros_like(rewards), agent.value_of(now), 0.0
            for step in reversed(range(length)):
                goes_on = 1.0 - ends[step]
                delta = rewards[step] + settings.gamma * follows * goes_on - values[step]
                advantages[step] = ahead = delta + settings.gamma * settings.gae_lambda * goes_on * ahead
                follows = values[step]
            targets = advantages + values

        # Epochs of minibatches.
        flat = observations.flatten(0, 1), actions.flatten(), log_probs.flatten(), advantages.flatten(), targets.flatten()
        for _ in range(settings.epochs):
            order = shuffle.permutation(length * width)
            for begin in range(0, len(order), settings.minibatch):
                rows = torch.as_tensor(order[begin : begin + settings.minibatch])
                seen, done, before, advantage, target = (part[rows] for part in flat)
                _, log_prob, entropy, value = agent.act(seen, done)
                ratio = (log_prob - before).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                clipped = ratio.clamp(1 - left * settings.clip, 1 + left * settings.clip)
                loss = -torch.min(advantage * ratio, advantage * clipped).mean() - settings.entropy * entropy.mean()
                loss = loss + settings.value * (target - value).square().mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), settings.max_grad_norm)
                optimizer.step()

        if update % max(1, updates // 5) == 0 or update + 1 == updates:
            progress((update + 1) * length * width, float(np.mean(returns[-100:])) if returns else 0.0)
    return agent
