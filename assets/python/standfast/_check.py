"""What to know of a controller before anybody pushes it: whether it stands, repeats, and answers to each row by itself."""

from __future__ import annotations

import html
import json
import math
import random
import struct
from typing import Any, Sequence

from ._exchange import PARTS, Rows, prepared
from ._program import _named, _options, _Program

#: Episodes that are compared, and ticks of each.
EPISODES = 8
TICKS = 5


def check(
    controller: Any,
    *,
    robot: str | None = None,
    batch: int = 64,
    timeout_s: float = 60.0,
    quiet: bool = True,
    **options: Any,
) -> "Check":
    """Tries a controller that `run` takes. The robot stands three times without a push, as in `standfast check`. Then the object
    is asked for the same rows alone, with others, and in other places of the batch: its answers have to be the same to the bit,
    since which episodes meet in a call differs from run to run.

    Further options are those of `standfast check --help`: `campaign="standard"`, `set`.
    """
    with _Program(_named(controller), None, batch, timeout_s, quiet) as program:
        text = program.run(["check", *program.controllers, "--json", *_options(robot=robot, **options)], [0, 100])
        problems = None
        if program.connections:
            connection = program.connections[0]
            given = program.given[connection.hello["name"], connection.hello["version"]]
            problems = dependence(given, connection.hello, Rows(connection.hello, connection.last))
        return Check(json.loads(text), problems)


class Check:
    """What was found. `summary` is what `standfast check --json` prints; `dependence` says how the answer to a row depends on
    other rows or on earlier episodes, and is empty if it does not. It is None for a controller of the program, which has no rows."""

    def __init__(self, summary: dict, dependence: list | None) -> None:
        self.summary, self.dependence = summary, dependence

    @property
    def is_good(self) -> bool:
        """Whether the robot stands, the controller repeats, and its rows are independent."""
        return self.summary["is_good"] and not self.dependence

    def __repr__(self) -> str:
        found = self.summary
        lines = [f"{found['controller']}: {found['outcome']} without a push, {1000 * found['tick_s']:.2f} ms a tick"]
        if found["fall_cause"]:
            lines.append(f"WARNING: {found['fall_cause']}")
        for key, words in [("differs_in_a_second_episode", "in a second episode"), ("differs_started_anew", "made anew")]:
            if found[key] is not None:
                lines.append(f"WARNING: {words}, its command differs from {found[key]} s on")
        if self.dependence is not None:
            lines += [f"WARNING: {problem}" for problem in self.dependence] or ["its answer to a row depends on that row alone"]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self))}</pre>"


def dependence(given: Any, hello: dict, seen: Rows) -> list:
    """How the answers of a controller to rows depend on anything but these rows and those before in their episodes, in words.
    `seen` has a row of the standing robot, around which the rows are drawn."""
    joints, controller = len(hello["robot"]["joints"]), prepared(given, hello)
    count = min(EPISODES, hello["batch"])
    draw = random.Random(0)
    # Each with its seed and its rows.
    episodes = [(1 + episode, [_near(seen, draw, tick * hello["period_s"]) for tick in range(TICKS)]) for episode in range(count)]

    def answers(chosen: list, places: Sequence[int], others: bool) -> list:
        """The commands of these episodes, which have these rows of the batch."""
        found: list = [[] for _ in places]
        for tick in range(TICKS):
            of_row = {place: (seed, rows[tick]) for (seed, rows), place in zip(chosen, places)}
            filling = [episodes[row % count][1][0] for row in range(hello["batch"])]
            rows = _rows(hello, of_row, tick == 0, filling if others else None)
            commands = _commands(controller.answer(rows, joints), hello["batch"], joints)
            for episode, place in enumerate(places):
                found[episode].append(commands[place])
        return found

    alone = []
    for episode in episodes:
        alone += answers([episode], [0], False)
        difference = _difference(alone[-1:], answers([episode], [0], False))
        if difference:
            return [
                f"asked twice for the same episode, its answer differs ({difference}): it draws random numbers, or does not forget "
                "an episode where `new` says that another one begins"
            ]
    last = hello["batch"] - 1
    ways = [
        ("with other episodes in the batch", list(range(count)), False),
        ("with the whole batch full", list(range(count)), True),
        ("in other places of the batch", [last - episode for episode in range(count)], True),
    ]
    problems = []
    for words, places, others in ways:
        difference = _difference(alone, answers(episodes, places, others))
        if difference:
            problems.append(f"{words}, its answer to a row differs from that to the row alone ({difference})")
    return problems


def _near(seen: Rows, draw: random.Random, time_s: float) -> list:
    """A row near that of the standing robot."""
    row = [float(number) for number in seen.all[0]]
    for name, column in seen._columns.items():
        for at in range(column["offset"], column["offset"] + column["size"]):
            row[at] = time_s if name == "time_s" else row[at] + draw.uniform(-0.1, 0.1) * max(1.0, abs(row[at]))
        if name == "orientation":
            at = slice(column["offset"], column["offset"] + column["size"])
            length = math.sqrt(sum(number * number for number in row[at]))
            row[at] = [number / length for number in row[at]]
    return row


def _rows(hello: dict, of_row: dict, is_new: bool, others: list | None) -> Rows:
    """A batch with these rows, given as seed and readings by their places, which are their slots, too. The other rows are
    episodes of their own, or filled up."""
    batch, trash = hello["batch"], hello["slots"] - 1
    filled = next(iter(of_row.values()))[1]
    words, readings = [], []
    for place in range(batch):
        if place in of_row:
            seed, row = of_row[place]
            words += [place, place, int(is_new), seed]
        elif others:
            row = others[place]
            words += [batch + place, batch + place, 1, batch + place]
        else:
            row = filled
            words += [2**64 - 1, trash, 1, 0]
        readings += row
    count = batch if others else max(of_row) + 1
    frame = struct.pack(f"<Q{len(words)}Q{len(readings)}d", count, *words, *readings)
    return Rows(hello, bytearray(frame))


def _commands(frame: bytes, rows: int, joints: int) -> list:
    """For each row the bytes of its command, or the words with which its episode fails."""
    bits, length = struct.unpack_from("<II", frame)
    text, at, parts = frame[8 : 8 + length], 8 + length, []
    for bit in range(len(PARTS)):
        if bits >> bit & 1:
            parts.append([frame[at + 8 * joints * row : at + 8 * joints * (row + 1)] for row in range(rows)])
            at += 8 * joints * rows
        else:
            # What it means to leave this part out.
            parts.append([struct.pack("<d", math.nan if PARTS[bit] in ("kp", "kd") else 0.0) * joints] * rows)
    failed = json.loads(text)["failed"] if text else {}
    return [failed.get(str(row), b"".join(part[row] for part in parts)) for row in range(rows)]


def _difference(expected: list, found: list) -> str:
    """The largest difference in words; empty if all is the same to the bit."""
    if expected == found:
        return ""
    largest = 0.0
    for one, other in zip(sum(expected, []), sum(found, [])):
        if isinstance(one, str) or isinstance(other, str) or len(one) != len(other):
            if one != other:
                return "other parts of the command"
            continue
        numbers = [struct.unpack(f"<{len(one) // 8}d", part) for part in (one, other)]
        largest = max([largest, *(abs(a - b) for a, b in zip(*numbers))])
    return f"by up to {largest:.3g}" if largest else "in the sign of a zero, or in what is no number"
