"""Controllers in Python, on trial in standfast, and the trials of its results as tables.

    import standfast

    class Mine(standfast.Controller):
        def tick(self, sensed):
            return {"q_ref": self.home}

    standfast.serve(Mine)

The guide's chapter process.md says what `sensed` has, and what may be returned. This file needs nothing but Python 3. A copy
of it beside a controller serves without an installation.

    result = standfast.run({"mine": Mine, "catch": None}, trials=200)

asks objects of this process instead, and is there only where the package is installed, as are `push`, `limit` and `check`.
"""

import importlib
import json
import pathlib
import sys

try:
    from ._check import Check, check
    from ._exchange import Rows
    from ._program import Limits, Push, Result, StandfastError, limit, push, run
except ImportError as error:
    # A copy of this file has no files beside it.
    if __package__:
        raise error

PROTOCOL = 1


class Controller:
    """A controller of one robot. `robot` and `parameters` are as the greeting has them, `period_s` is the control period."""

    phase = "standing"

    def __init__(self, hello):
        self.robot = hello["robot"]
        self.period_s = hello["period_s"]
        self.parameters = hello["parameters"]
        self.home = self.robot["home"]["q_ref"]
        self.joints = [joint["name"] for joint in self.robot["joints"]]

    def reset(self, seed):
        """An episode begins. Forget the last one: an episode must depend on its own readings and its seed alone."""

    def tick(self, sensed):
        """The command for these readings: a dict with q_ref and, if wanted, dq_ref, tau_ff, gains, phase, numbers."""
        raise NotImplementedError


def serve(make):
    """Answers standfast until it closes the pipe. `make` gets the greeting and returns a controller."""
    answers = sys.stdout
    # What a controller prints must not get between the answers.
    sys.stdout = sys.stderr
    controller = None
    for line in sys.stdin:
        asked = json.loads(line)
        if asked["type"] == "tick":
            answer = controller.tick(asked)
            answer.setdefault("phase", controller.phase)
        elif asked["type"] == "reset":
            controller.reset(int(asked["seed"]))
            answer = {"type": "ready"}
        else:
            controller = make(asked)
            answer = {"type": "hello", "protocol": PROTOCOL}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def read(folder, library=None):
    """The trials of a result, one row for each trial and controller: a table of pandas (with pyarrow) or of polars.

    `library` is the name of one of them; without it, the first one counts that is installed. `standfast docs columns` says what the
    columns mean, and so do the metadata of the file's own columns.
    """
    file = pathlib.Path(folder) / "trials.parquet"
    if not file.is_file():
        raise FileNotFoundError(f"{file}: no such file; accepted: the folder of a result that `standfast run` has finished")
    return _read(file, library)


def _read(file, library=None):
    problems = []
    for name in [library] if library else ["pandas", "polars"]:
        try:
            return importlib.import_module(name).read_parquet(file)
        except ImportError as error:
            problems.append(f"{name}: {error}")
    raise ImportError(f"{file}: to read it needs pandas with pyarrow, or polars; " + "; ".join(problems))
