"""Whether what RESULTs say of slots keeps the rules of spec/protocol2.md: states, rewards, masks, discrete values. Their sizes are judged in frames.py;
numbers (R75) are looked for by whoever learns."""
from __future__ import annotations

import numpy as np
from gymnasium import spaces

from . import wire
from .errors import ProtocolError
from .layout import Behaviour

_ENDS, _BEGINS = wire.TERMINATED | wire.TRUNCATED, wire.FIRST | wire.ACTIVE
_IDLE, _RESET, _STEP = 0, 4, 8  # what was asked of a slot's environment; the states 8 and 16 that it had are added, shifted by 3
_PLAYED = _STEP + (wire.ACTIVE >> 3)  # from here on the agent took part


def _rule(asked: int, was: int, state: int, same_step: bool) -> int:
    """The number of the rule that a state breaks, 0 for none."""
    ends, first, active = state & _ENDS, bool(state & wire.FIRST), bool(state & wire.ACTIVE)
    played = asked == _STEP and was & wire.ACTIVE
    if state > 31:
        return 63
    if first and not active:
        return 64
    if not played and state & (_ENDS | wire.FINAL):
        return 65
    if asked == _IDLE:
        return 0 if state == was else 70
    if not played:
        return 66 if active and not first else 0
    if not ends:
        return 0 if state == wire.ACTIVE else 67
    if not same_step:
        return 69 if state & ~_ENDS else 0
    return 68 if first != active or not state & wire.FINAL and state != wire.TRUNCATED else 0


class Judge:
    """The RESULTs of one session, one after another. Nothing is copied but states."""

    def __init__(self, behaviours: list[Behaviour], autoreset: str):
        self._behaviours = behaviours
        self._table = np.array([[_rule(asked, was << 3, state, autoreset == "same_step") for state in range(256)] for asked in (_IDLE, _RESET, _STEP) for was in range(4)], np.uint8)
        self._environment_of = [np.arange(behaviour.slots) // len(behaviour.agents) for behaviour in behaviours]
        self._seen = (0, [bytes(behaviour.slots) for behaviour in behaviours], False)  # request, states 8 and 16 of each slot, whether anyone takes part
        self._going_on = [bytes([wire.ACTIVE]) * behaviour.slots for behaviour in behaviours]
        self._choices = [_choice_begins(behaviour) for behaviour in behaviours]
        self._discretes = [[(index, *_bounds(leaf.space)) for index, leaf in enumerate(behaviour.observation.leaves) if not isinstance(leaf.space, spaces.Box)] for behaviour in behaviours]

    def judge(self, request: int, rows: list, step: bool, chosen: np.ndarray | None, with_finals: bool) -> bool:
        """Whether an agent takes part now. `rows` as in ResultFrame; `chosen` [environments] were asked for, None: all. ProtocolError names slot, value and rule.
        The answer to one request is judged once, however often it comes."""
        before, finals, now = self._seen, False, []
        if request == before[0]:
            return before[2]
        anyone = False
        for index, said in enumerate(rows):
            states, going_on = said.states, self._going_on[index]
            if step and chosen is None and before[1] is not None and before[1][index] == going_on == states.tobytes():  # by far the most
                anyone = True
                now.append(going_on)
            else:
                if before[1] is not None:
                    self._judge_states(index, said, np.frombuffer(before[1][index], np.uint8), step, chosen)
                anyone = anyone or bool((states & wire.ACTIVE).any())
                finals = finals or bool((states & wire.FINAL).any())
                now.append((states & np.uint8(_BEGINS)).tobytes())
            if said.masks is not None:
                self._judge_masks(index, said.masks, (states & wire.ACTIVE) != 0)
            if self._discretes[index]:
                self._judge_discretes(index, said.observations, np.flatnonzero(states & (_ENDS | wire.ACTIVE)), said, with_finals)
        if finals != with_finals:
            raise ProtocolError("MALFORMED", "a RESULT breaks protocol 2: part 1 and states with 4 do not agree (R61)")
        self._seen = (request, now, anyone)
        return anyone

    def played(self, request: int, step: bool, chosen: np.ndarray | None) -> np.ndarray:
        """[environments] whether somebody took part in the request that is answered; where that is not known, or was judged already, it counts as so."""
        before, count = self._seen, int(self._environment_of[0][-1]) + 1
        if request == before[0]:
            return np.ones(count, bool)
        played = np.full(count, step and before[1] is None)
        for environments, was in zip(self._environment_of, before[1] or []):
            played[environments[np.frombuffer(was, np.uint8) & wire.ACTIVE != 0]] = step
        return played if chosen is None else played & np.asarray(chosen, bool)

    def forget(self) -> None:
        """An answer was lost on its way: the next one is not compared with those before it."""
        self._seen = (0, None, True)

    def _judge_states(self, index: int, said, was: np.ndarray, step: bool, chosen: np.ndarray | None) -> None:
        states, key = said.states, (was >> 3) + np.uint8(_STEP if step else _RESET)
        if chosen is not None:
            key = np.where(np.asarray(chosen, bool)[self._environment_of[index]], key, was >> 3)
        broken = self._table[key, states]
        if broken.any():
            slot = int(broken.argmax())
            raise self._broken(index, slot, broken[slot], f"has state {states[slot]}, before it had {was[slot]}")
        idle = key < _PLAYED
        if said.rewards[idle].any():
            slot = int(np.flatnonzero(idle & (said.rewards != 0))[0])
            raise self._broken(index, slot, 65, f"took no part in this step and has reward {said.rewards[slot]:g}")

    def _judge_masks(self, index: int, masks: np.ndarray, active: np.ndarray) -> None:
        if (masks[active] > 1).any():
            raise self._broken(index, int(np.flatnonzero(active & (masks > 1).any(1))[0]), 71, "has a mask byte that is neither 0 nor 1")
        legal = np.logical_or.reduceat(masks, self._choices[index], axis=1).all(1) | ~active
        if not legal.all():
            raise self._broken(index, int(legal.argmin()), 72, "has no legal action; leave at least one for each choice")

    def _judge_discretes(self, index: int, observations: list, seen: np.ndarray, said, with_finals: bool) -> None:
        for leaf, low, high in self._discretes[index]:
            for slots, values in ((seen, observations[leaf][seen]), (said.final_slots, said.finals[leaf]) if with_finals else (seen[:0], observations[leaf][:0])):
                wrong = ((values < low) | (values > high))
                wrong = wrong.any(axis=tuple(range(1, wrong.ndim)))
                if wrong.any():
                    at = int(wrong.argmax())
                    raise self._broken(index, int(slots[at]), 73, f"has {values[at]} of {'/'.join(map(str, self._behaviours[index].observation.leaves[leaf].path)) or 'its observation'}, outside its space")

    def _broken(self, index: int, slot: int, rule: int, what: str) -> ProtocolError:
        return ProtocolError("MALFORMED", f"a RESULT breaks protocol 2: slot {slot} of {self._behaviours[index].name!r} {what} (R{rule})")


def _bounds(space) -> tuple:
    """Smallest and largest value of a space of whole numbers."""
    if isinstance(space, spaces.Discrete):
        return int(space.start), int(space.start + space.n) - 1
    return (0, space.nvec - 1) if isinstance(space, spaces.MultiDiscrete) else (0, 1)


def _choice_begins(behaviour: Behaviour) -> list[int]:
    """Where the mask of each choice begins in a mask row."""
    begins, at = [], 0
    for leaf in behaviour.action.leaves:
        space = leaf.space
        counts = [int(space.n)] if isinstance(space, spaces.Discrete) else space.nvec.ravel().tolist() if isinstance(space, spaces.MultiDiscrete) else \
            [2] * int(np.prod(leaf.shape)) if isinstance(space, spaces.MultiBinary) else []
        for count in counts:
            begins.append(at)
            at += count
    return begins
