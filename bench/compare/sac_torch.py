#!/usr/bin/env python3
"""A hand-written SAC of PyTorch on Pendulum beside `consac bench`'s: 256x256 networks, batch 256, one update a step, one core, in
turn, processor time. The loop has no library between it and torch: one replay of tensors, fused Adam, targets that follow by foreach.
Both count updates, each with the step before it; the steps that only fill the replay take no time that would show.

    .venv/bin/python bench/compare/sac_torch.py build/release/cli/consac
"""
import sys
import time

import torch
from torch import nn

from in_turn import PAIRS, bench_row, in_turn, medians

torch.set_num_threads(1)
STEPS, STARTS, WIDTH, BATCH, GAMMA, TAU = 600, 100, 256, 256, 0.99, 0.005


def mlp(inputs, outputs):
    return nn.Sequential(nn.Linear(inputs, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, outputs))


def draw(actor, seen):
    mean, log_std = actor(seen).chunk(2, -1)
    log_std = log_std.clamp(-20, 2)
    noise = torch.randn_like(mean)
    action = torch.tanh(mean + log_std.exp() * noise)
    likelihood = -0.5 * noise.square() - log_std - 0.9189385 - torch.log(1 - action.square() + 1e-6)
    return action, likelihood.sum(-1, keepdim=True)


def pendulum(state, torque):
    """One step of Gymnasium's Pendulum-v1; state is (angle, velocity)."""
    angle, velocity = state
    turned = (angle + torch.pi) % (2 * torch.pi) - torch.pi
    cost = turned**2 + 0.1 * velocity**2 + 0.001 * torque**2
    velocity = min(max(velocity + (15 * float(torch.sin(torch.tensor(angle))) + 3 * torque) * 0.05, -8), 8)
    return (angle + velocity * 0.05, velocity), -cost


def theirs():
    """Updates/s of one training."""
    torch.manual_seed(1)
    actor, critics, targets = mlp(3, 2), [mlp(4, 1), mlp(4, 1)], [mlp(4, 1), mlp(4, 1)]
    for critic, target in zip(critics, targets):
        target.load_state_dict(critic.state_dict())
    learned = [p for critic in critics for p in critic.parameters()]
    following = [p for target in targets for p in target.parameters()]
    log_alpha = torch.zeros(1, requires_grad=True)
    optimisers = [torch.optim.Adam(p, 3e-4, fused=True) for p in (actor.parameters(), learned, [log_alpha])]
    seen, after = torch.zeros(STEPS, 3), torch.zeros(STEPS, 3)
    acted, paid = torch.zeros(STEPS, 1), torch.zeros(STEPS, 1)
    state, start = (0.1, 0.0), 0.0
    look = lambda s: torch.tensor([torch.cos(torch.tensor(s[0])), torch.sin(torch.tensor(s[0])), s[1]])
    for step in range(STEPS):
        if step == STARTS:
            start = time.process_time()
        seen[step] = look(state)
        with torch.no_grad():
            acted[step] = draw(actor, seen[step : step + 1])[0]
        state, paid[step, 0] = pendulum(state, 2 * float(acted[step]))
        after[step] = look(state)
        if step < STARTS:
            continue
        rows = torch.randint(0, step + 1, (BATCH,))
        s, a, r, n = seen[rows], acted[rows], paid[rows], after[rows]
        drawn, likelihood = draw(actor, s)
        alpha = log_alpha.exp().detach()
        alpha_loss = -(log_alpha * (likelihood.detach() - 1.0)).mean()
        with torch.no_grad():
            a2, l2 = draw(actor, n)
            joined = torch.cat((n, a2), -1)
            wanted = r + GAMMA * (torch.minimum(targets[0](joined), targets[1](joined)) - alpha * l2)
        joined = torch.cat((s, a), -1)
        critic_loss = 0.5 * sum(nn.functional.mse_loss(critic(joined), wanted) for critic in critics)
        optimisers[1].zero_grad(set_to_none=True)
        critic_loss.backward()
        optimisers[1].step()
        for p in learned:
            p.requires_grad_(False)
        joined = torch.cat((s, drawn), -1)
        actor_loss = (alpha * likelihood - torch.minimum(critics[0](joined), critics[1](joined))).mean()
        optimisers[0].zero_grad(set_to_none=True)
        actor_loss.backward()
        optimisers[0].step()
        for p in learned:
            p.requires_grad_(True)
        optimisers[2].zero_grad(set_to_none=True)
        alpha_loss.backward()
        optimisers[2].step()
        with torch.no_grad():
            torch._foreach_lerp_(following, learned, TAU)
    return (STEPS - STARTS) / (time.process_time() - start)


if __name__ == "__main__":
    pairs = in_turn(lambda: bench_row(sys.argv[1], "sac256"), theirs)
    mine, other, ratio = medians([(1e3 * row["value"], updates) for (row, _), updates in pairs])
    print(f"torch {torch.__version__}, {pairs[0][0][1]}, processor time, the median of {PAIRS} pairs\n")
    print("| SAC, 256x256, batch 256 | consac updates/s | PyTorch updates/s | ratio |\n|---|---|---|---|")
    print(f"| one update a step | {mine:,.0f} | {other:,.0f} | {ratio:.2f}x |")
