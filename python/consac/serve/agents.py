"""Environments with several agents, in PettingZoo's parallel form."""
from __future__ import annotations

from consac.wire import ACTIVE, FINAL, FIRST, TERMINATED, TRUNCATED

from .batch import Batch
from .infos import check_info
from .refusal import Refusals
from .rows import Rows
from .world import World


class AgentBatch(Batch):
    """Environments with several agents, in PettingZoo's parallel form."""

    def __init__(self, world: World, envs: list, first_seed: int | None, warn, failures: Refusals):
        super().__init__(world, envs, first_seed, warn, failures)
        self.place, self.first_slot, total = {}, [], 0
        for rows in self.parts:
            self.first_slot.append(total)
            total += rows.behaviour.slots
            for place, agent in enumerate(rows.behaviour.agents):
                self.place[world.ids[agent]] = (len(self.first_slot) - 1, place)
        self.ended: list[set] = [set() for _ in envs]  # agents whose episode is over

    def _slot(self, env: int, agent) -> tuple[Rows, int, int]:
        part, place = self.place[agent]
        rows = self.parts[part]
        slot = env * len(rows.behaviour.agents) + place
        return rows, slot, self.first_slot[part] + slot

    def _begin(self, env: int, seed, options) -> None:
        observations, infos = self._reset(env, seed, options)
        check_info(infos, "what it gave as infos")
        for agent in self.place:
            rows, slot, number = self._slot(env, agent)
            rows.rewards[slot] = 0
            rows.states[slot] = FIRST | ACTIVE if agent in observations else 0
            if agent in observations:
                self._show(rows, slot, number, observations[agent], infos.get(agent) or {}, self.infos)
        self.ended[env] = set()
        self.over[env] = False

    def _show(self, rows: Rows, slot: int, number: int, observation, info: dict, infos: list) -> None:
        rows.write(slot, observation)
        if info:
            self._keep(number, info, infos, f"the info of {rows.behaviour.agents[slot % len(rows.behaviour.agents)]}")
        rows.write_mask(slot, info)

    def _advance(self, env: int) -> None:
        actions = {}
        for agent in self.place:
            rows, slot, _ = self._slot(env, agent)
            if rows.states[slot] & ACTIVE:
                actions[agent] = rows.action(slot)
        observations, rewards, terminations, truncations, infos = self.envs[env].step(actions)
        check_info(infos, "what it gave as infos")
        ended_now, seen, going_on, prefixed = [], [], False, len(self.parts) > 1
        for agent in self.place:
            rows, slot, number = self._slot(env, agent)
            terminated, truncated = terminations.get(agent, False), truncations.get(agent, False)
            comes = agent in observations and agent not in actions and agent not in self.ended[env] and not (terminated or truncated)
            took_part = agent in actions or comes
            rows.states[slot] = 0
            reward = rewards.get(agent, 0) if agent in actions else 0  # who comes has done nothing yet
            if reward is None:  # numpy would take it for NaN
                raise TypeError(f"the reward of {agent} is None, which is no number")
            rows.rewards[slot] = reward
            if not took_part:
                continue
            if self.world.statistics:
                self._note(infos.get(agent) or {}, f"{rows.behaviour.name}/" * prefixed)
            if agent in observations:
                self._show(rows, slot, number, observations[agent], infos.get(agent) or {}, seen)
            gone = agent not in observations and not (terminated or truncated)
            if terminated or truncated or gone:
                rows.states[slot] = (TERMINATED if terminated or gone else 0) | (TRUNCATED if truncated else 0)
                self.ended[env].add(agent)
                ended_now.append((rows, slot, number))
            else:
                rows.states[slot] = FIRST | ACTIVE if comes else ACTIVE
                going_on = True
        if self.autoreset != "same_step":
            self.infos += seen
            self.over[env] = not going_on
            return
        last = {number for _, _, number in ended_now}
        self.final_infos += [info for info in seen if info[0] in last]
        for rows, slot, _ in ended_now:
            rows.finals.append((slot, rows.row(slot)))
            rows.states[slot] |= FINAL
        if going_on:
            self.infos += [info for info in seen if info[0] not in last]
            return
        said = [(rows, slot, int(rows.states[slot]), float(rows.rewards[slot])) for rows, slot, _ in ended_now]
        self._begin(env, None, None)
        for rows, slot, state, reward in said:
            rows.states[slot] |= state
            rows.rewards[slot] = reward
