#!/usr/bin/env python3
"""Writes spec/protocol2_session.md: one whole session of protocol 2, byte by byte, and one with parameters, statistics and groups. Their RESULTs are those of
the cases of these names in spec/conformance/protocol2/results.json, so that every judge of RESULTs judges them too. `--check` writes nothing."""
import json
import math
import pathlib
import struct
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "spec/protocol2_session.md"
CASES = ROOT / "spec/conformance/protocol2/results.json"
NAMES = {1: "HELLO", 2: "WELCOME", 3: "CONFIGURE", 4: "SPEC", 5: "RESET", 6: "STEP", 7: "RESULT", 8: "ERROR", 10: "BYE", 11: "PING", 12: "PONG"}
FROM_SERVER = {2, 4, 7, 8, 12}
SESSION, SECOND = 1, 2
PARTS = {1: "final rows", 2: "infos", 4: "statistics", 8: "rewards of groups"}
STATES = {24: "first (8), takes part (16)", 16: "takes part (16)", 29: "terminated (1), final row (4), first (8), takes part (16)"}

INTRODUCTION = """# One session of protocol 2, byte by byte

Made by `tools/protocol2_session.py`; a test keeps it true. The world: two environments of one agent each, which sees a `dict` of a
`discrete` (3 kinds) and a `box` of two numbers, and has three actions, of which RESULT says which are legal. A row of observations has
12 bytes, one of actions 4, one of masks 3. `C` is the trainer, `S` the engine; `R`... are rules of [protocol2.md](protocol2.md). RELABEL is not in it:
section 13 there has its tables. Below it stands [a session with parameters, statistics and groups](#a-session-with-parameters-statistics-and-groups).
"""


def floats(*values):
    return struct.pack(f"<{len(values)}f", *values)


def hex_of(data):
    return " ".join(f"{byte:02x}" for byte in data)


class Page:
    """Frames as lines: bytes on the left, what they say on the right."""

    def __init__(self):
        self.lines, self.frames = [INTRODUCTION], []

    def say(self, text):
        self.lines.append(text + "\n")

    def frame(self, kind, request, pieces, session=SESSION):
        """A frame whose payload is `pieces`, each (bytes, note)."""
        payload = b"".join(data for data, _ in pieces)
        header = [(b"\xc0NSC", "magic"), (struct.pack("<H", kind), f"type {kind}: {NAMES[kind]}"), (bytes(2), "flags"),
                  (struct.pack("<I", len(payload)), f"{len(payload)} bytes of payload"), (bytes(4), "no CRC"),
                  (struct.pack("<Q", request), f"request {request}" if request else "no request"),
                  (struct.pack("<I", session), f"session {session}"), (bytes(4), "reserved")]
        self.frames.append(b"".join(data for data, _ in header) + payload)
        self.lines.append("```")
        self.lines.append(f"{'S -> C' if kind in FROM_SERVER else 'C -> S'}   {NAMES[kind]}")
        at = 0
        for number, (data, note) in enumerate(header + pieces):
            if number == len(header):
                at = 0
                self.lines.append("payload")
            if note == "JSON":
                self.lines.append(f"{at:5}  {data.decode()}")
            else:
                for begin in range(0, max(len(data), 1), 12):
                    self.lines.append(f"{at + begin:5}  {hex_of(data[begin:begin + 12]):35}  {note if begin == 0 else ''}".rstrip())
            at += len(data)
        self.lines.append("```\n")

    def message(self, kind, request, value, session=SESSION):
        self.frame(kind, request, [(json.dumps(value, separators=(",", ":")).encode(), "JSON")], session)

    def text(self):
        return "\n".join(self.lines)


def result_pieces(blocks):
    """A RESULT of the world above, as results.json cuts it, with notes."""
    head, rows, rewards, states, masks, *rest = [bytes.fromhex(block) for block in blocks]
    parts, ticks = struct.unpack("<II", head)
    notes = [(head[:4], "parts " + ", ".join(f"{part}: {name}" for part, name in PARTS.items() if parts & part) if parts else "parts: none"),
             (head[4:], f"the engine took {ticks / 1e4:g} ms" if ticks else "time: it does not say")]
    for slot in range(2):
        row = rows[12 * slot:12 * slot + 12]
        notes += [(row[:4], f"observation of slot {slot}: kind {struct.unpack('<i', row[:4])[0]}"), (row[4:], "pos {}, {}".format(*map("{:g}".format, struct.unpack("<2f", row[4:]))))]
    for slot in range(2):
        notes.append((rewards[8 * slot:8 * slot + 8], f"reward of slot {slot}: {struct.unpack_from('<d', rewards, 8 * slot)[0]:g}"))
    notes += [(states[slot:slot + 1], f"state of slot {slot}: {states[slot]}: {STATES[states[slot]]}") for slot in range(2)]
    notes.append((states[2:], "padding to a multiple of 8"))
    for slot in range(2):
        mask = masks[3 * slot:3 * slot + 3]
        notes.append((mask, f"mask of slot {slot}: legal are {', '.join(str(i) for i, legal in enumerate(mask) if legal)}"))
    notes.append((masks[6:], "padding"))
    if parts & 1:
        final = rest.pop(0)
        notes += [(final[:4], f"final row, of slot 0: kind {struct.unpack('<i', final[:4])[0]}"), (final[4:12], "pos {}, {}".format(*map("{:g}".format, struct.unpack("<2f", final[4:12])))),
                  (final[12:], "padding")]
    if parts & 8:
        paid = rest.pop(0)
        notes += [(paid[8 * env:8 * env + 8], f"paid to the group in environment {env}: {struct.unpack_from('<d', paid, 8 * env)[0]:g}") for env in range(2)]
    for part in (4, 2):
        if parts & part:
            block = rest.pop(0)
            length = struct.unpack_from("<I", block)[0]
            notes += [(block[:4], f"{length} bytes of {PARTS[part]}"), (block[4:4 + length], "JSON")]
            if len(block) > 4 + length:
                notes.append((block[4 + length:], "padding"))
    return notes


def step_pieces(actions, parameters=()):
    """`parameters`: of environment 0, then of environment 1; (name, value), None leaves it as it was set."""
    notes = [(struct.pack("<II", 4, 0), "flags 4: parameters; a word of 0") if parameters else (bytes(8), "two words of 0"), (b"\1\1", "both environments are stepped"), (bytes(6), "padding")]
    notes += [(struct.pack("<i", action), f"action of slot {slot}: {action}") for slot, action in enumerate(actions)]
    for index, (name, value) in enumerate(parameters):
        said = "NaN, which leaves it as it was set" if value is None else f"{value:g}"
        notes.append((struct.pack("<d", math.nan if value is None else value), f"{name} of environment {index * 2 // len(parameters)}: {said}"))
    return notes


def make():
    cases = json.loads(CASES.read_text())
    spec = dict(cases["specs"]["two"], training_length=100000, model_name="two")
    answers = answers_of(cases, "the session of protocol2_session.md")
    page = Page()
    page.say("The trainer connects and speaks first. HELLO's limit of 4096 bytes holds until WELCOME (R4).")
    page.message(1, 0, {"protocol": [2, 2], "client": "page 1.0", "capabilities": ["render"], "max_frame": 67108864}, 0)
    page.message(2, 0, {"protocol": 2, "server": "page 1.0", "session": SESSION, "resume": "", "capabilities": [], "max_frame": 67108864})
    page.say("No capability is agreed, and a lost connection is the end: `resume` is empty. Requests are numbered from 1.")
    page.message(3, 1, {"autoreset": "same_step"})
    page.message(4, 1, spec)
    page.say("RESET of both environments, with seeds. The answer has first observations: state 24, reward 0 (R65, R66).")
    page.frame(5, 2, [(struct.pack("<II", 1, 0), "flags 1: seeds; a word of 0"), (b"\1\1", "both environments are reset"), (bytes(6), "padding"),
                      (struct.pack("<q", 42), "seed of environment 0: 42"), (struct.pack("<q", 43), "seed of environment 1: 43")])
    page.frame(7, 2, result_pieces(answers[0]))
    page.say("PING may come at any time, from either end, and is no request.")
    page.frame(11, 0, [(b"hi", "any bytes, at most 64")])
    page.frame(12, 0, [(b"hi", "the same")])
    page.say("A step. Slot 0 may do 0 or 1, slot 1 anything.")
    page.frame(6, 3, step_pieces([1, 2]))
    page.frame(7, 3, result_pieces(answers[1]))
    page.say("An action that there is not: the request is refused, nothing is stepped, its number is used up (R14, R44).")
    page.frame(6, 4, step_pieces([1, 7]))
    page.message(8, 4, {"code": "OUT_OF_RANGE", "severity": "request", "message": "the action of slot 1 is 7, outside 0 to 2", "env": 1})
    page.say("A step that ends the episode of environment 0. With `same_step` its row is the next episode's first already, and the last "
             "observation follows as final row; what its last step has to tell is in `final_infos`.")
    page.frame(6, 5, step_pieces([1, 2]))
    page.frame(7, 5, result_pieces(answers[2]))
    page.say("Enough. The engine forgets the session and closes.")
    page.frame(10, 0, [])
    say_second(page, cases)
    return page


def answers_of(cases, name):
    return [answer["result"] for case in cases["cases"] if case["name"] == name for answer in case["answers"]]


def say_second(page, cases):
    """Parameters, statistics and groups."""
    answers = answers_of(cases, "the second session of protocol2_session.md")
    spec = dict(cases["specs"]["squad"], training_length=100000, model_name="squad",
                parameters=[{"name": "gravity", "default": 9.8, "low": 0, "high": 20, "description": "m/s^2"}, {"name": "level", "default": 1}])
    page.say("## A session with parameters, statistics and groups")
    page.say("The same world, in which something can be set, numbers are noted and the agent is in a group (sections 14 to 16). Whoever takes this session up names the "
             "three capabilities again (R27).")
    capabilities = ["parameters", "statistics", "groups"]
    page.message(1, 0, {"protocol": [2, 2], "client": "page 1.0", "capabilities": ["render", *capabilities], "max_frame": 67108864}, 0)
    page.message(2, 0, {"protocol": 2, "server": "page 1.0", "session": SECOND, "resume": "4f1d", "capabilities": capabilities, "max_frame": 67108864}, SECOND)
    page.message(3, 1, {}, SECOND)
    page.message(4, 1, spec, SECOND)
    page.say("The first RESET without flag 4: every value is its default (R104).")
    page.frame(5, 2, [(bytes(8), "flags: none; a word of 0"), (b"\1\1", "both environments are reset"), (bytes(6), "padding")], SECOND)
    page.frame(7, 2, result_pieces(answers[0]), SECOND)
    page.say("A step that sets values for the episodes that come: 2 environments of 2 parameters each. The episodes under way hear nothing of it (R103). Its RESULT tells what was noted, "
             "and what the group was paid; the agents' rewards hold that already.")
    page.frame(6, 3, step_pieces([1, 2], [("gravity", 12.5), ("level", None), ("gravity", None), ("level", 3)]), SECOND)
    page.frame(7, 3, result_pieces(answers[1]), SECOND)
    page.say("A value beyond its bound: nothing is set, nothing is stepped (R102).")
    page.frame(6, 4, step_pieces([1, 2], [("gravity", 5), ("level", None), ("gravity", 25), ("level", None)]), SECOND)
    page.message(8, 4, {"code": "OUT_OF_RANGE", "severity": "request", "message": "gravity of environment 1 is 25, at most 20", "env": 1}, SECOND)
    page.say("The episode of environment 0 ends. The next one, whose first row this is, has a gravity of 12.5; what was refused is forgotten.")
    page.frame(6, 5, step_pieces([1, 2]), SECOND)
    page.frame(7, 5, result_pieces(answers[2]), SECOND)
    page.frame(10, 0, [], SECOND)


def main():
    text = make().text()
    if "--check" in sys.argv:
        if PAGE.read_text() != text:
            sys.exit(f"{PAGE} is not what {pathlib.Path(__file__).name} makes; run it")
        return
    PAGE.write_text(text)


if __name__ == "__main__":
    main()
