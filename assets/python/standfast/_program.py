"""The program as functions: it simulates in a process of its own, and asks the objects of this one for their commands."""

from __future__ import annotations

import collections
import csv
import html
import importlib.util
import json
import os
import pathlib
import re
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import tempfile
import time
import uuid
from typing import Any, Mapping, Sequence, Union

from ._exchange import Connection

#: A controller: None for one that the program knows by its key, a name or a file, or an object, class or function.
Controllers = Union[Mapping[str, Any], Sequence[str], str, os.PathLike]


class StandfastError(RuntimeError):
    """The program has ended with an error. `code` is its exit code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


def run(
    controllers: Controllers,
    campaign: str = "standard",
    *,
    robot: str | None = None,
    trials: int | None = None,
    out: str | os.PathLike | None = None,
    version: str | None = None,
    batch: int = 64,
    timeout_s: float = 60.0,
    quiet: bool = False,
    **options: Any,
) -> "Result":
    """Runs a campaign, and returns its result.

    `controllers` are by name: None for a controller that the program knows by this name, a text for another name or a file, or
    an object of this process; with a text, the name is that of what it names, and the key does not count. Such an object has `tick_batch(rows)`, which returns the commands of all rows: an array
    `[n, joints]` of joint angles `q_ref` (rad), or a dict of arrays with `q_ref` and, if wanted, `dq_ref` (rad/s), `tau_ff` (N m),
    and `gains` `[n, joints, 2]` (stiffness, damping) or `kp` and `kd`. A class or a function is called to make one; it may
    take the greeting, a dict with `robot`, `period_s`, `batch` and `slots`. A class with `tick(sensed)` in place of `tick_batch`
    serves one episode; so a `standfast.Controller` can be given. `Rows` says what the rows have.

    An object is copied, since several runs may ask for it at once: replays, and other engines. `phase` and `numbers` of a `tick`
    are not kept.

    `batch` is the number of rows of every call; twice as many episodes are open at once. `timeout_s` is the longest time for a
    call and for those of other objects before it; the first call has 600 s at least. An exception of a controller ends the run, and is raised here; a command that is not finite, or a negative gain, ends
    its episode as failed.

    Nobody sees whether an object changes, so every run begins anew, in a new folder, and `out` has to be one. With `version`, a
    text that you change when the objects change, the same call goes on from where it was interrupted.

    Further options are those of `standfast run --help`: `seed=3`, `until_resolved=True`, `gate=["catch >= hold"]`,
    `set={"push.height_m": 0.05}`.

    Raises StandfastError if the program refuses the input.
    """
    # Without a version nobody can go on with what is not finished.
    removed = version is None and _has_objects(controllers) and (out is None or not os.path.exists(out))
    if removed and out is None:
        out = pathlib.Path("standfast-results") / f"{pathlib.Path(campaign).stem}-{time.strftime('%Y%m%d-%H%M%S')}-{uuid.uuid4().hex[:4]}"
    with _Program(controllers, version, batch, timeout_s, quiet) as program:
        table = program.folder / "trials.csv"
        arguments = ["run", campaign, *program.controllers, "--json", *_options(robot=robot, trials=trials, out=out, **options)]
        if _library() is None:
            arguments += ["--table", str(table)]
        try:
            text = program.run(arguments, [0, 100])
        except BaseException:
            if removed and not (pathlib.Path(out) / "summary.json").exists():
                shutil.rmtree(out, ignore_errors=True)
            raise
        rows = _read_csv(table) if table.exists() else None
    summary = json.loads(text)
    folder = re.search(r"written: (.*?)/report\.html", re.sub(r"\s+", " ", "".join(program.told)))
    if out is None and folder is None:
        raise StandfastError("the program has not said where the result is; accepted: `out`", 0)
    return Result(pathlib.Path(out if out is not None else folder.group(1)), summary, rows)


class Result:
    """The result of a campaign. In a notebook it shows itself.

    `folder` holds its files, `summary` is what `standfast run --json` prints.
    """

    def __init__(self, folder: pathlib.Path, summary: dict, rows: dict | None = None) -> None:
        self.folder, self.summary = folder, summary
        self._trials: Any = rows

    @property
    def trials(self) -> Any:
        """A row for each trial and controller: a table of pandas (with pyarrow) or of polars or, if neither is there, a dict of
        lists. `standfast docs columns` says what the columns mean."""
        if self._trials is None:
            self._trials = _table(self.folder / "trials.parquet")
        return self._trials

    @property
    def verdict(self) -> str:
        """Which controller recovers most often, and what each pair of them says."""
        return "\n".join([self.summary["headline"], *(pair["words"] for pair in self.summary["pairs"])])

    @property
    def rates(self) -> dict:
        """The share of trials from which each controller recovers, by its name."""
        return {controller["name"]: controller["success_rate"] for controller in self.summary["controllers"]}

    @property
    def passes(self) -> bool:
        """Whether all gates pass."""
        return all(gate["passes"] for gate in self.summary["gates"])

    def __repr__(self) -> str:
        lines = [self.verdict]
        for controller in self.summary["controllers"]:
            low, high = (100 * bound for bound in controller["ci95"])
            counts = f"{controller['recovered']}/{controller['trials']}"
            lines.append(f"  {controller['name']}: {counts} recovered, {100 * controller['success_rate']:.1f} % ({low:.1f}-{high:.1f})")
        return "\n".join([*lines, *(f"warning: {warning}" for warning in self.summary["warnings"]), f"report: {self.folder / 'report.html'}"])

    def _repr_html_(self) -> str:
        """The first screen of the report."""
        page = (self.folder / "report.html").read_text(encoding="utf-8")
        parts = [r"<head>.*?</head>", r"<header>.*?</header>", r'<section id="maps">.*?</section>', r'<section id="rates">.*?</section>']
        head, *body = (found.group() if found else "" for found in (re.search(part, page, re.S) for part in parts))
        # What they lead to is not here.
        text = re.sub(r'<a [^>]*href="[^"]*"[^>]*>(.*?)</a>', r"\1", "".join(body), flags=re.S)
        return _framed(f"<!DOCTYPE html><html>{head}<body><div id=page><main>{text}</main></div></body></html>", 720)


def push(
    controller: Any = "catch",
    *,
    impulse: float | None = None,
    heading: float | None = None,
    robot: str | None = None,
    replay: str | os.PathLike | None = None,
    batch: int = 64,
    timeout_s: float = 60.0,
    quiet: bool = True,
    **options: Any,
) -> "Push":
    """Simulates one push of `impulse` (N s) at `heading` (degrees), and returns what happened, with every tick.

    `controller` is one of those that `run` takes, or a dict with one of them by its name. `replay` is the path of a page that
    shows the push in 3D. Further options are those of `standfast push --help`: `campaign="standard"` with `trial=17`, `set`.
    """
    with _Program(_named(controller), None, batch, timeout_s, quiet) as program:
        trace = program.folder / ("trace.csv" if _library() is None else "trace.parquet")
        plot = program.folder / "plot.svg"
        asked = _options(impulse=impulse, heading=heading, robot=robot, replay=replay, trace=trace, plot=plot, **options)
        text = program.run(["push", *program.controllers, "--json", *asked], [0, 1])
        table = _read_csv(trace) if trace.suffix == ".csv" else _table(trace)
        return Push(json.loads(text), table, plot.read_text(encoding="utf-8"))


class Push:
    """One push. `trace` has a row for each tick, `summary` is what `standfast push --json` prints, `plot` is a picture (SVG)."""

    def __init__(self, summary: dict, trace: Any, plot: str) -> None:
        self.summary, self.trace, self.plot = summary, trace, plot

    @property
    def outcome(self) -> str:
        """Recovered, Fell, Broke, Diverged, TimedOut, Survived or Failed."""
        return self.summary["outcome"]

    def __repr__(self) -> str:
        push, cause = self.summary["push"], self.summary["fall_cause"]
        words = f"{self.summary['controller']}: {self.outcome} at {self.summary['end_s']:.2f} s"
        return f"{words}{f' ({cause})' if cause else ''}, push of {push['impulse_n_s']:g} N s at {push['heading_deg']:g} degrees"

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(repr(self))}</p>{self.plot}"


def limit(
    controllers: Controllers,
    campaign: str = "standard",
    *,
    robot: str | None = None,
    out: str | os.PathLike | None = None,
    batch: int = 64,
    timeout_s: float = 60.0,
    quiet: bool = False,
    **options: Any,
) -> "Limits":
    """Finds the largest impulse from which each controller recovers, by heading.

    Each search is one episode after another, so no more rows are asked for at once than there are headings and controllers.
    Further options are those of `standfast limit --help`: `headings=8`, `precision=0.2`, `trials`, `replicas`. Without `out`, no
    files are kept.
    """
    with _Program(controllers, None, batch, timeout_s, quiet) as program:
        folder = pathlib.Path(out) if out is not None else program.folder / "limit"
        asked = _options(robot=robot, out=folder, **options)
        text = program.run(["limit", campaign, *program.controllers, "--json", *asked], [0])
        return Limits(json.loads(text), (folder / "limit.svg").read_text(encoding="utf-8"))


class Limits:
    """The hardest pushes. `summary` is what `standfast limit --json` prints, `plot` is a picture (SVG)."""

    def __init__(self, summary: dict, plot: str) -> None:
        self.summary, self.plot = summary, plot

    @property
    def rows(self) -> list:
        """A dict for each heading and controller: `heading_deg`, `controller`, and what its search has found."""
        return [
            {"heading_deg": heading["heading_deg"], "controller": found["name"], **{key: value for key, value in found.items() if key != "name"}}
            for heading in self.summary["headings"]
            for found in heading["controllers"]
        ]

    def _repr_html_(self) -> str:
        return self.plot


# ----------------------------------------------------------------------------------------------------------------------


class _Program:
    """The program in a process of its own, and the objects that it may ask. Leaving it leaves nothing behind."""

    def __init__(self, controllers: Controllers, version: str | None, batch: int, timeout_s: float, quiet: bool) -> None:
        self.quiet, self.told = quiet, collections.deque(maxlen=200)
        self.version = version
        self.given: dict = {}
        self.connections: list = []
        self._temporary = tempfile.TemporaryDirectory(prefix="standfast-")
        self.folder = pathlib.Path(self._temporary.name)
        try:
            self.controllers = self._files(controllers, version or uuid.uuid4().hex, batch, timeout_s)
        except BaseException:
            self._temporary.cleanup()
            raise

    def __enter__(self) -> "_Program":
        return self

    def __exit__(self, *_: Any) -> None:
        self._temporary.cleanup()

    def _files(self, controllers: Controllers, version: str, batch: int, timeout_s: float) -> list:
        """The options that name the controllers. An object gets a file, which says how to ask for it."""
        if isinstance(controllers, (str, os.PathLike)):
            controllers = [controllers]
        if not isinstance(controllers, Mapping):
            controllers = {os.fspath(name): None for name in controllers}
        options = []
        for number, (key, given) in enumerate(controllers.items()):
            if given is None or isinstance(given, (str, os.PathLike)):
                options.append(f"--controller={key if given is None else os.fspath(given)}")
                continue
            name, at, engine = key.partition("@")
            kind = given if hasattr(given, "__qualname__") else type(given)
            # Strings of JSON are strings of TOML.
            of_engine = version + at + engine
            text = {"kind": "python", "name": name, "object": f"{kind.__module__}.{kind.__qualname__}", "version": of_engine}
            lines = [f"{field} = {json.dumps(value, ensure_ascii=False)}" for field, value in text.items()]
            lines += [f"batch = {int(batch)}", f"timeout_s = {float(timeout_s)!r}"]
            file = self.folder / f"{number}.toml"
            file.write_text("\n".join(lines) + "\n", encoding="utf-8")
            self.given[name, of_engine] = given
            options.append(f"--controller={file}{at}{engine}")
        return options

    def run(self, arguments: list, accepted: list) -> str:
        """Runs the program to its end, and answers for the objects meanwhile. Returns what it prints.

        Raises the exception of an object, and StandfastError if the exit code is not an accepted one."""
        address = str(self.folder / "socket")
        with socket.socket(socket.AF_UNIX) as listener, selectors.DefaultSelector() as selector:
            try:
                listener.bind(address)
            except OSError as error:
                raise OSError(f"{address}: {error}; TMPDIR may name another folder, with a short path") from error
            listener.listen()
            child = subprocess.Popen(
                [program(), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env={**os.environ, "STANDFAST_PYTHON": address},
                # Ctrl-C reaches this process alone, which ends the program.
                start_new_session=True,
            )
            printed: list = []
            try:
                selector.register(listener, selectors.EVENT_READ, None)
                streams = {child.stdout: printed.append, child.stderr: self._tell}
                for stream, take in streams.items():
                    selector.register(stream, selectors.EVENT_READ, take)
                while streams:
                    for key, _ in selector.select():
                        if key.data is None:
                            connection = Connection(listener.accept()[0])
                            self.connections.append(connection)
                            selector.register(connection.stream, selectors.EVENT_READ, connection)
                        elif isinstance(key.data, Connection):
                            if not key.data.serve(self.given):
                                selector.unregister(key.fileobj)
                                key.data.stream.close()
                                key.data.controller = None
                        else:
                            piece = os.read(key.fd, 1 << 16)
                            key.data(piece)
                            if not piece:
                                selector.unregister(key.fileobj)
                                del streams[key.fileobj]
                code = child.wait()
            finally:
                for connection in self.connections:
                    connection.stream.close()
                words = _end(child)
                if self.version:
                    # What is kept.
                    self._tell(words)
        text = b"".join(printed).decode("utf-8", "replace")
        if code not in accepted or not text:
            words = "".join(self.told)
            at = words.rfind("error: ")
            raise StandfastError(words[at + 7 :].strip() if at >= 0 else words.strip() or f"the program ended with code {code}", code)
        return text

    def _tell(self, piece: bytes) -> None:
        text = piece.decode("utf-8", "replace")
        self.told.append(text)
        if not self.quiet:
            sys.stderr.write(text)
            sys.stderr.flush()


def _end(child: subprocess.Popen) -> bytes:
    """Ends the program and all that it has started, if it has not ended: in the way of Ctrl-C, and after a moment by force.
    Returns what it says meanwhile."""
    try:
        if child.poll() is None:
            child.send_signal(signal.SIGINT)
            try:
                return child.communicate(timeout=5)[1]
            except subprocess.TimeoutExpired:
                pass
        return b""
    finally:
        if child.poll() is None:
            try:
                os.killpg(child.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            child.wait()
        for stream in (child.stdout, child.stderr):
            if stream:
                stream.close()


def program() -> str:
    """The path of the program: that of the environment variable STANDFAST_PROGRAM, or the one that was installed with this
    module, or the first one in PATH. Raises FileNotFoundError if there is none."""
    stated = os.environ.get("STANDFAST_PROGRAM")
    installed = pathlib.Path(sysconfig.get_path("scripts")) / "standfast"
    found = stated or (str(installed) if installed.is_file() else shutil.which("standfast"))
    if not found:
        raise FileNotFoundError(f"the program standfast is neither at {installed} nor in PATH; STANDFAST_PROGRAM may name it")
    return found


def _named(controller: Any) -> Controllers:
    if isinstance(controller, (str, os.PathLike, Mapping)):
        return controller
    return {getattr(controller, "__name__", type(controller).__name__): controller}


def _has_objects(controllers: Controllers) -> bool:
    values = controllers.values() if isinstance(controllers, Mapping) else []
    return any(not (value is None or isinstance(value, (str, os.PathLike))) for value in values)


def _options(**options: Any) -> list:
    """Options of the command line: True is an option without a value, a list is given once for each item, and a dict as
    KEY=VALUE."""
    arguments = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            arguments.append(option)
            continue
        if isinstance(value, Mapping):
            value = [f"{key}={_toml(item)}" for key, item in value.items()]
        for item in value if isinstance(value, (list, tuple)) else [value]:
            arguments.append(f"{option}={item}")
    return arguments


def _toml(value: Any) -> str:
    """A value of --set."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return str(value)


def _library() -> str | None:
    """The library for tables: pandas with pyarrow, or polars."""
    there = {name: importlib.util.find_spec(name) is not None for name in ("pandas", "pyarrow", "polars")}
    if there["pandas"] and there["pyarrow"]:
        return "pandas"
    return "polars" if there["polars"] else None


def _table(path: pathlib.Path) -> Any:
    from . import _read

    return _read(path)


def _read_csv(path: pathlib.Path) -> dict:
    """A dict of lists: numbers, or texts in a column that has others, and None where there is no value."""
    with open(path, newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    return {name: _values([row[i] for row in rows]) for i, name in enumerate(names)}


def _values(column: list) -> list:
    for kind in (int, float):
        try:
            return [kind(text) if text else None for text in column]
        except ValueError:
            pass
    words = {"true": True, "false": False, "": None}
    return [words.get(text, text) for text in column]


def _framed(page: str, height: int) -> str:
    """A page within a notebook, whose styles it does not touch."""
    return f'<iframe srcdoc="{html.escape(page)}" style="width: 100%; height: {height}px; border: 0"></iframe>'
