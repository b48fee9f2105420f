"""The exchange with the program: rows of readings come in, rows of commands go out.

A frame of readings is a u64, the number of rows that count; four u64 for each row (episode, slot, whether the episode is new,
seed); and the readings of each row as f64. A frame of commands is two u32, its parts as bits and the length of a text; the text,
which is JSON; and each part as f64, a row for each row of readings. All is little-endian, and every frame has as many rows as the
greeting says. A row whose `kp` and `kd` are all NaN keeps the gains of the servos.
"""

from __future__ import annotations

import array
import copy
import functools
import inspect
import json
import math
import socket
import struct
import sys
import traceback
from typing import Any, Callable

try:
    import numpy
except ImportError:
    numpy = None

VERSION = 1
#: The parts of a command, in the order of their bits.
PARTS = ("q_ref", "dq_ref", "tau_ff", "kp", "kd")
WORDS = ("episode", "slot", "new", "seed")


class Rows:
    """The readings of many episodes, one row for each: arrays of numpy, or lists if there is no numpy.

    `all` has every reading, a float64 array `[n, width]`; `q`, `dq`, `orientation` (w, x, y, z), `gyro`, `accelerometer`,
    `left_force`, `left_moment`, `right_force`, `right_moment` and `time_s` are its columns, with the units of `units`.

    There are always `n` rows, since a matrix product may depend on their number; the first `count` are of episodes, and the
    others are filled up. `slot` numbers the open episodes: a memory of the shape `[slots, ...]` is read by `memory[rows.slot]`
    and written by `memory[rows.slot] = ...`. `new` says which episodes begin here, whose memory has to be reset. `seed` is that
    of the episode, the same in every run; `episode` counts the episodes, in an order that differs from run to run.
    """

    def __init__(self, hello: dict, frame: bytearray) -> None:
        self.n: int = hello["batch"]
        self.slots: int = hello["slots"]
        self.count: int = struct.unpack_from("<Q", frame)[0]
        self._columns: dict = hello["columns"]
        self._width: int = hello["width"]
        self._frame = frame

    @property
    def units(self) -> dict:
        """The unit of each reading, by its name."""
        return {name: column["unit"] for name, column in self._columns.items()}

    def __len__(self) -> int:
        return self.n

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        made = numpy.asarray(self.all, dtype=dtype)
        return made.copy() if copy and made is self.all else made

    def __getattr__(self, name: str) -> Any:
        # What is not asked for is not made. Nothing is there yet in a copy that is being made.
        if "_columns" not in self.__dict__:
            raise AttributeError(name)
        if name == "all":
            value = _floats(self._frame, 8 + 32 * self.n, self.n, self._width)
        elif name == "_words":
            value = _words(self._frame, self.n)
        elif name == "new":
            words = self._words
            value = words[:, 2] != 0 if numpy else [row[2] != 0 for row in words]
        elif name == "slot":
            words = self._words
            value = words[:, 1].astype("int64") if numpy else [row[1] for row in words]
        elif name in WORDS:
            words, at = self._words, WORDS.index(name)
            value = words[:, at] if numpy else [row[at] for row in words]
        elif name.startswith("_") or name not in self._columns:
            raise AttributeError(f"rows have no {name!r}; accepted: all, count, new, slot, episode, seed, " + ", ".join(self._columns))
        else:
            column = self._columns[name]
            begin, end = column["offset"], column["offset"] + column["size"]
            if name == "time_s":
                value = self.all[:, begin] if numpy else [row[begin] for row in self.all]
            else:
                value = self.all[:, begin:end] if numpy else [row[begin:end] for row in self.all]
        setattr(self, name, value)
        return value


def _floats(frame: bytearray, offset: int, rows: int, columns: int) -> Any:
    if numpy:
        return numpy.frombuffer(frame, "<f8", rows * columns, offset).reshape(rows, columns)
    flat = struct.unpack_from(f"<{rows * columns}d", frame, offset)
    return [list(flat[row * columns : (row + 1) * columns]) for row in range(rows)]


def _words(frame: bytearray, rows: int) -> Any:
    if numpy:
        return numpy.frombuffer(frame, "<u8", 4 * rows, 8).reshape(rows, 4)
    flat = struct.unpack_from(f"<{4 * rows}Q", frame, 8)
    return [flat[4 * row : 4 * row + 4] for row in range(rows)]


class Batched:
    """An object with `tick_batch`."""

    def __init__(self, controller: Any) -> None:
        self.controller = controller

    def answer(self, rows: Rows, joints: int) -> bytes:
        """The frame of commands for these rows. Raises ValueError if the answer has another shape."""
        answer = self.controller.tick_batch(rows)
        return frame_of(answer, rows.n, joints)


class OnePerEpisode:
    """Objects with `tick`, one for each open episode. One with `reset` is used again for a later episode."""

    def __init__(self, make: Callable[[], Any], first: Any) -> None:
        self.make, self.spare, self.of_slot = make, [first], {}

    def answer(self, rows: Rows, joints: int) -> bytes:
        """As that of `Batched`."""
        zeros, own = [0.0] * joints, [math.nan] * joints
        parts: dict = {part: [own if part in ("kp", "kd") else zeros] * rows.n for part in PARTS}
        used, failed = {"q_ref"}, {}
        readings = rows.all.tolist() if numpy else rows.all
        for row in range(rows.count):
            slot = int(rows.slot[row])
            if rows.new[row]:
                self.of_slot[slot] = self._new(slot, int(rows.seed[row]))
            command = self.of_slot[slot].tick(_sensed(rows, readings[row]))
            if not isinstance(command, dict):
                command = {"q_ref": command}
            if "error" in command:
                failed[row] = f"gives up: {command['error']}"[:1000]
                continue
            command = {key: value for key, value in command.items() if value is not None}
            unknown = set(command) - {*PARTS, "gains", "phase", "numbers"}
            if unknown or "q_ref" not in command or ("kp" in command) != ("kd" in command):
                raise ValueError(
                    f"tick returned {', '.join(map(str, command)) or 'nothing'}; accepted: q_ref and, if wanted, dq_ref, tau_ff, "
                    "gains or both kp and kd, and phase and numbers, which are not kept"
                )
            gains = command.pop("gains", None)
            if gains is not None:
                command["kp"], command["kd"] = [pair[0] for pair in gains], [pair[1] for pair in gains]
            for part in PARTS:
                if part in command:
                    numbers = [float(number) for number in command[part]]
                    if len(numbers) != joints:
                        raise ValueError(f"tick returned {len(numbers)} numbers of {part}; accepted: {joints}, one for each joint")
                    parts[part][row] = numbers
                    used.add(part)
        return frame_of({part: parts[part] for part in PARTS if part in used}, rows.n, joints, failed)

    def _new(self, slot: int, seed: int) -> Any:
        controller = self.of_slot.get(slot)
        if controller is None or not hasattr(controller, "reset"):
            controller = self.spare.pop() if self.spare else self.make()
        if hasattr(controller, "reset"):
            controller.reset(seed)
        return controller


def _sensed(rows: Rows, reading: list) -> dict:
    """A row as the readings of `Controller.tick`."""
    sensed: dict = {"type": "tick", "time_s": reading[0], "left": {}, "right": {}}
    for name, column in rows._columns.items():
        side, _, kind = name.partition("_")
        numbers = reading[column["offset"] : column["offset"] + column["size"]]
        if side in ("left", "right"):
            sensed[side][kind] = numbers
        elif name != "time_s":
            sensed[name] = numbers
    return sensed


def frame_of(answer: Any, rows: int, joints: int, failed: dict | None = None) -> bytes:
    """A frame of commands: of an array `[rows, joints]`, which is `q_ref`, or of a dict of arrays."""
    if not isinstance(answer, dict):
        answer = {"q_ref": answer}
    answer = {key: value for key, value in answer.items() if value is not None}
    if "gains" in answer:
        gains = answer.pop("gains")
        shape = _shape(gains)
        if shape != (rows, joints, 2):
            raise ValueError(f"tick_batch returned gains of shape {shape}; accepted: {(rows, joints, 2)}, stiffness and damping")
        answer["kp"], answer["kd"] = (
            (_array(gains)[..., i] if numpy else [[pair[i] for pair in row] for row in gains]) for i in (0, 1)
        )
    unknown = sorted(set(answer) - set(PARTS))
    if unknown or "q_ref" not in answer or ("kp" in answer) != ("kd" in answer):
        raise ValueError(
            f"tick_batch returned {', '.join(map(str, answer)) or 'nothing'}; accepted: q_ref and, if wanted, dq_ref, tau_ff, "
            "and gains or both kp and kd"
        )
    bits, blocks = 0, []
    for bit, part in enumerate(PARTS):
        if part not in answer:
            continue
        bits |= 1 << bit
        blocks.append(_block(part, answer[part], rows, joints))
    text = json.dumps({"failed": failed}).encode() if failed else b""
    return b"".join([struct.pack("<II", bits, len(text)), text, *blocks])


def error_frame(error: BaseException) -> bytes:
    """A frame that says why there are no commands."""
    text = json.dumps({"error": last_line(error)}).encode()
    return struct.pack("<II", 0, len(text)) + text


def last_line(error: BaseException) -> str:
    """The last line of a traceback."""
    return traceback.format_exception_only(type(error), error)[-1].strip()[:1000]


def _array(value: Any) -> Any:
    # A tensor may need a gradient, or lie on a graphics card.
    if hasattr(value, "detach"):
        value = value.detach().cpu()
    return numpy.asarray(value, dtype="<f8")


def _shape(value: Any) -> tuple:
    if hasattr(value, "shape"):
        return tuple(value.shape)
    shape: list = []
    while hasattr(value, "__len__") and not isinstance(value, (str, bytes)):
        shape.append(len(value))
        value = value[0] if len(value) else 0.0
    return tuple(shape)


def _block(part: str, value: Any, rows: int, joints: int) -> bytes:
    shape = _shape(value)
    if shape == (rows, joints):
        if numpy:
            return _array(value).tobytes()
        if all(len(row) == joints for row in value):
            block = array.array("d", [number for row in value for number in row])
            if sys.byteorder == "big":
                block.byteswap()
            return block.tobytes()
        shape = f"{shape}, with rows of other lengths"
    raise ValueError(
        f"tick_batch returned {part} of shape {shape}; accepted: {(rows, joints)}, a row for each row of readings and a column "
        "for each joint"
    )


def prepared(given: Any, hello: dict) -> Batched | OnePerEpisode:
    """What answers for a controller that the user has given: an object with `tick_batch`, or a class or function that makes
    one with `tick_batch` or `tick`. An object is copied, since slots are numbered for each connection. Raises TypeError for
    anything else."""
    accepted = "an object with tick_batch, or a class or function that makes one with tick_batch or tick"
    if not inspect.isclass(given) and hasattr(given, "tick_batch"):
        try:
            return Batched(copy.deepcopy(given))
        except Exception as error:
            raise TypeError(
                f"{type(given).__name__} cannot be copied ({error}), and it is asked for several runs at once; accepted: its class, "
                "or a function that returns it if it has no memory"
            ) from error
    if not (inspect.isclass(given) or inspect.isroutine(given) or isinstance(given, functools.partial)):
        why = "an object with tick serves one episode alone" if hasattr(given, "tick") else f"{type(given).__name__} has no tick_batch"
        raise TypeError(f"{why}; accepted: {accepted}")

    def make() -> Any:
        made = _made(given, hello)
        if not (hasattr(made, "tick_batch") or hasattr(made, "tick")):
            raise TypeError(f"{given!r} makes something without tick_batch and tick; accepted: {accepted}")
        return made

    first = make()
    return Batched(first) if hasattr(first, "tick_batch") else OnePerEpisode(make, first)


def _made(make: Callable, hello: dict) -> Any:
    """Calls a class or function, with the greeting if it has a parameter named `hello` or one that has to be given."""
    try:
        parameters = inspect.signature(make).parameters
    except (TypeError, ValueError):
        return make(hello)
    if "hello" in parameters and parameters["hello"].kind != inspect.Parameter.POSITIONAL_ONLY:
        return make(hello=hello)
    positional = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    needs_one = any(parameter.kind in positional and parameter.default is parameter.empty for parameter in parameters.values())
    return make(hello) if needs_one else make()


class Connection:
    """A connection of the program, for one prepared controller."""

    def __init__(self, stream: socket.socket) -> None:
        self.stream = stream
        self.hello: dict | None = None
        self.controller: Batched | OnePerEpisode | None = None
        self.last = bytearray()

    def serve(self, given: dict) -> bool:
        """Answers what was sent. Returns False if the program has closed the connection. An exception of the controller
        is told to the program, and raised."""
        return self._greet(given) if self.hello is None else self._answer()

    def _greet(self, given: dict) -> bool:
        line, piece = bytearray(), memoryview(bytearray(1 << 16))
        while not line.endswith(b"\n"):
            count = self._hear(piece)
            if not count:
                return False
            line += piece[:count]
        hello = json.loads(line)
        hello["columns"] = {column["name"]: column for column in hello.pop("observation")}
        hello["width"] = sum(column["size"] for column in hello["columns"].values())
        self.joints = len(hello["robot"]["joints"])
        try:
            if hello["protocol"] != VERSION:
                raise RuntimeError(f"the program speaks version {hello['protocol']} of the exchange; accepted: {VERSION}")
            key = (hello["name"], hello["version"])
            if key not in given:
                raise LookupError(f"{key[0]}: this result was made with an object that is not the present one")
            self.controller = prepared(given[key], hello)
        except BaseException as error:
            self._tell(json.dumps({"error": last_line(error)}).encode() + b"\n")
            raise
        self._tell(json.dumps({"protocol": VERSION}).encode() + b"\n")
        self.hello = hello
        self.size = 8 + hello["batch"] * (32 + 8 * hello["width"])
        return True

    def _answer(self) -> bool:
        assert self.hello is not None and self.controller is not None
        frame = bytearray(self.size)
        view, heard = memoryview(frame), 0
        while heard < self.size:
            count = self._hear(view[heard:])
            if not count:
                return False
            heard += count
        try:
            answer = self.controller.answer(Rows(self.hello, frame), self.joints)
        except BaseException as error:
            self._tell(error_frame(error))
            raise
        self._tell(answer)
        self.last = frame
        return True

    def _hear(self, view: memoryview) -> int:
        try:
            return self.stream.recv_into(view)
        except OSError:
            return 0

    def _tell(self, words: bytes) -> None:
        # Where nobody listens any more, the next that is heard is the end.
        try:
            self.stream.sendall(words)
        except OSError:
            pass
