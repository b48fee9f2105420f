"""The loop held by Python. `python3 loop.py NAME` runs one test with the program that STANDFAST_PROGRAM names; without a name it
runs all. It needs no numpy, and takes it if it is there."""

import glob
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

import standfast
from standfast import _exchange, _program
from standfast._exchange import numpy

SHORT = {"episode.horizon_s": 1.6, "push.start_s": 0.2, "episode.judge.standing_time_s": 0.2}
ARGUMENTS = dict(campaign="smoke", trials=4, replays=0, quiet=True, untried=True, set=SHORT)


class Hold:
    """Stiff joints, as the built-in `hold`."""

    def __init__(self, hello):
        self.home, self.slots, self.calls = hello["robot"]["home"], hello["slots"], 0

    def tick_batch(self, rows):
        self.calls += 1
        assert rows.n == len(rows.q) == len(rows.new) and 1 <= rows.count <= rows.n
        assert [bool(new) for new in rows.new[: rows.count]] == [time_s == 0.0 for time_s in rows.time_s[: rows.count]]
        command = {part: [list(self.home[part]) for _ in range(rows.n)] for part in ("q_ref", "tau_ff")}
        self.change(rows, command)
        return command

    def change(self, rows, command):
        pass


class Memory(Hold):
    """A memory of each episode, as a recurrent network has it: a filtered rate of the trunk moves the ankles."""

    def __init__(self, hello):
        super().__init__(hello)
        names = [joint["name"] for joint in hello["robot"]["joints"]]
        self.ankles = [at for at, name in enumerate(names) if "ankle_flexion" in name]
        assert len(self.ankles) == 2, names
        self.memory = [0.0] * hello["slots"]

    def change(self, rows, command):
        for row in range(rows.n):
            slot = rows.slot[row]
            before = 0.0 if rows.new[row] else self.memory[slot]
            self.memory[slot] = 0.9 * before + 0.1 * float(rows.gyro[row][1])
            for ankle in self.ankles:
                command["q_ref"][row][ankle] += 0.02 * self.memory[slot]


class MemoryOfOne(standfast.Controller):
    """The same for one episode."""

    def reset(self, seed):
        assert seed > 0
        self.memory = 0.0

    def tick(self, sensed):
        self.memory = 0.9 * self.memory + 0.1 * sensed["gyro"][1]
        q = list(self.home)
        for at, name in enumerate(self.joints):
            if "ankle_flexion" in name:
                q[at] += 0.02 * self.memory
        return {"q_ref": q, "tau_ff": self.robot["home"]["tau_ff"]}


def rows_of(result, controller):
    """The rows of a controller, without its name and the column on second runs."""
    trials = result.trials
    at = [row for row, name in enumerate(trials["controller"]) if name == controller]
    assert at
    return {name: [column[row] for row in at] for name, column in trials.items() if name not in ("controller", "repeats")}


def nothing_is_left():
    """No file of the exchange and no program, once it has had a moment to end."""
    assert glob.glob(tempfile.gettempdir() + "/standfast-*") == []
    assert subprocess.run(["pgrep", "-P", str(os.getpid())], stdout=subprocess.PIPE).stdout.split() == []


def raises(kind, words, controller, **more):
    began = time.monotonic()
    try:
        standfast.run({"mine": controller}, **{**ARGUMENTS, **more})
    except kind as error:
        assert words in str(error), error
    else:
        raise AssertionError(f"{kind} was expected")
    assert time.monotonic() - began < 60
    nothing_is_left()
    assert glob.glob("standfast-results/*") == []


def test_rows_are_the_same_for_any_threads_and_batch():
    expected = None
    for threads, batch in [(1, 1), (2, 8), (1, 64), (2, 64)]:
        given = {"mine": Hold, "memory": Memory, "one": MemoryOfOne, "hold": None}
        result = standfast.run(given, batch=batch, threads=threads, **ARGUMENTS)
        hold, mine, memory, one = (rows_of(result, name) for name in ("hold", "mine", "memory", "one"))
        assert hold == mine and memory == one and memory != hold
        expected = expected or (hold, memory)
        assert expected == (hold, memory), (threads, batch)
        assert [controller["not_repeated"] for controller in result.summary["controllers"]] == [0] * 4
    nothing_is_left()


def test_a_network_gives_the_same_rows_for_any_threads():
    if not numpy:
        print("left out: there is no numpy")
        return

    class Network:
        """A recurrent network, whose matrix products have the shape of the batch."""

        def __init__(self, hello):
            draw, joints = numpy.random.default_rng(3), len(hello["robot"]["joints"])
            self.home = numpy.array(hello["robot"]["home"]["q_ref"])
            width = 2 * joints + 3
            self.weights = [draw.normal(size=size, scale=0.1) for size in ((width, 96), (96, 96), (96, joints))]
            self.memory = numpy.zeros((hello["slots"], 96))

        def tick_batch(self, rows):
            self.memory[rows.slot[rows.new]] = 0.0
            seen = numpy.concatenate([rows.q - self.home, rows.dq, rows.gyro], axis=1)
            hidden = numpy.tanh(seen @ self.weights[0] + self.memory[rows.slot] @ self.weights[1])
            self.memory[rows.slot] = hidden
            assert numpy.asarray(rows, dtype="float32").shape == rows.all.shape == (rows.n, seen.shape[1] + 20)
            return (self.home + 0.02 * hidden @ self.weights[2]).astype("float32")

    runs = [standfast.run({"mine": Network}, threads=threads, batch=batch, **ARGUMENTS) for threads in (1, 2, 8) for batch in (1, 8, 64)]
    of_batch = [[rows_of(run, "mine") for run in runs[batch::3]] for batch in range(3)]
    for rows in of_batch:
        assert rows[0] == rows[1] == rows[2]
    assert standfast.check(Network, set=SHORT).dependence == []


def test_batches_are_full():
    counts = []

    class Counting(Hold):
        def change(self, rows, command):
            assert len({int(slot) for slot in rows.slot[: rows.count]}) == rows.count
            assert all(slot == self.slots - 1 for slot in rows.slot[rows.count :]) and all(rows.new[rows.count :])
            counts.append(rows.count)

    standfast.run({"mine": Counting}, **{**ARGUMENTS, "trials": 24}, batch=8, threads=1)
    assert sum(counts) / len(counts) > 6, sum(counts) / len(counts)


def test_an_exception_reaches_the_caller():
    class Raises(Hold):
        def change(self, rows, command):
            if self.calls > 20:
                raise KeyError("no such gain")

    class Unmade:
        def __init__(self):
            raise ImportError("no torch")

        def tick_batch(self, rows):
            pass

    raises(KeyError, "no such gain", Raises)
    raises(ImportError, "no torch", Unmade)
    raises(TypeError, "serves one episode alone", MemoryOfOne.__new__(MemoryOfOne))
    raises(TypeError, "makes something without tick_batch and tick", dict)


def test_another_shape_is_said():
    class Fewer(Hold):
        def tick_batch(self, rows):
            return [self.home["q_ref"][:3]] * rows.n

    class Nothing(Hold):
        def tick_batch(self, rows):
            return {"torque": 1.0}

    raises(ValueError, "tick_batch returned q_ref of shape (64, 3); accepted: (64, 20)", Fewer)
    raises(ValueError, "tick_batch returned torque; accepted: q_ref and", Nothing)


def test_gains_may_be_left_out_in_a_row():
    class Gains(MemoryOfOne):
        def reset(self, seed):
            super().reset(seed)
            self.seed = seed

        def tick(self, sensed):
            of_joint = [[joint["kp"], joint["kd"]] for joint in self.robot["joints"]]
            return {**super().tick(sensed), "gains": of_joint if self.seed % 2 else None}

    result = standfast.run({"mine": Gains, "one": MemoryOfOne}, **{**ARGUMENTS, "trials": 12})
    assert rows_of(result, "mine") == rows_of(result, "one")
    assert standfast.check(Gains, set=SHORT).dependence == []


def test_a_tick_without_angles_is_said():
    class Returns(MemoryOfOne):
        returned = None

        def tick(self, sensed):
            return self.returned

    for returned, words in [(None, "nothing"), ({"q_reff": [0.0]}, "q_reff"), ({"q_ref": [0.0], "kp": [1.0]}, "q_ref, kp")]:
        Returns.returned = returned
        raises(ValueError, f"tick returned {words}; accepted: q_ref and", Returns)


def test_an_object_with_a_memory_is_asked_for_many_runs():
    class Lazy(Memory):
        def __init__(self):
            self.calls, self.memory, self.slots = 0, None, None

        def tick_batch(self, rows):
            if self.memory is None:
                super().__init__(HELLO)
                self.memory = [0.0] * rows.slots
            return super().tick_batch(rows)

    class Greeted(Memory):
        def __init__(self, hello):
            super().__init__(hello)
            HELLO.update(hello)

    HELLO = {}
    mine = Lazy()
    mine.lock = threading.Lock()
    raises(TypeError, "Lazy cannot be copied", mine)
    mine.lock = None
    result = standfast.run({"one": Greeted, "mine": mine, "other": mine}, **ARGUMENTS)
    assert rows_of(result, "mine") == rows_of(result, "other") == rows_of(result, "one")


def test_what_is_complete_is_kept():
    class Raises(Hold):
        made = 0

        def __init__(self, hello):
            super().__init__(hello)
            Raises.made += 1
            if Raises.made > 1:
                raise KeyError("in a replay")

    for out in (None, "there"):
        Raises.made = 0
        try:
            standfast.run({"mine": Raises}, **{**ARGUMENTS, "replays": 1}, out=out)
        except KeyError:
            pass
        (summary,) = pathlib.Path(".").glob("there/summary.json" if out else "standfast-results/*/summary.json")
        shutil.rmtree(summary.parent)


def test_errors_of_a_connection_are_raised():
    class Closed(Hold):
        def change(self, rows, command):
            raise error("of the robot's server")

    for error in (ConnectionResetError, TimeoutError):
        raises(error, "of the robot's server", Closed)
    # A folder that was not there can be taken again.
    raises(TimeoutError, "of the robot's server", Closed, out="new")
    assert not os.path.exists("new")


def test_the_greeting_is_given_to_who_takes_it():
    hello = {"robot": 1}

    class Optional:
        def __init__(self, path="policy.pt", hello=None):
            self.got = (path, hello)

        def tick_batch(self, rows):
            pass

    class Path(Optional):
        def __init__(self, path="policy.pt"):
            self.got = path

    class Called:
        def __call__(self, readings):
            return self

    assert _exchange.prepared(Optional, hello).controller.got == ("policy.pt", hello)
    assert _exchange.prepared(Path, hello).controller.got == "policy.pt"
    assert _exchange.prepared(lambda greeting: Path(greeting), hello).controller.got == hello
    raises(TypeError, "Called has no tick_batch", Called())


def test_a_command_that_is_no_number_ends_its_episode_alone():
    class Nan(Hold):
        def change(self, rows, command):
            for row in range(rows.n):
                if rows.time_s[row] > 0.3 and int(rows.seed[row]) % 2:
                    command["q_ref"][row][3] = float("nan")

    seeds = set()

    class Gives(MemoryOfOne):
        def reset(self, seed):
            super().reset(seed)
            self.seed = seed
            seeds.add(seed)

        def tick(self, sensed):
            return {"error": "enough"} if sensed["time_s"] > 0.3 and self.seed % 2 else super().tick(sensed)

    result = standfast.run({"mine": Nan, "gives": Gives}, **{**ARGUMENTS, "trials": 12})
    odd = sum(seed % 2 for seed in seeds)
    assert 0 < odd < 12
    for controller, words in zip(result.summary["controllers"], ["q_ref[3] = NaN: is not a command", "gives: gives up: enough"]):
        assert controller["failed"] == odd, controller
        assert any(words in cause["cause"] for cause in controller["fall_causes"]), controller["fall_causes"]


def test_a_long_call_meets_the_timeout():
    class Slow(Hold):
        def change(self, rows, command):
            if self.calls > 20:
                time.sleep(2.0)

    raises(standfast.StandfastError, "mine: gave no answer within 0.5 s", Slow, timeout_s=0.5)


def test_ctrl_c_ends_the_run():
    class Interrupted(Hold):
        def change(self, rows, command):
            if self.calls == 50:
                threading.Timer(0.2, os.kill, [os.getpid(), signal.SIGINT]).start()

    raises(KeyboardInterrupt, "", Interrupted, trials=3000)


def test_with_a_version_a_run_goes_on():
    class Counting(Hold):
        made = 0

        def __init__(self, hello):
            super().__init__(hello)
            Counting.made += 1

    first = standfast.run({"mine": Counting}, version="1", **ARGUMENTS)
    assert Counting.made == 1 and first.folder == pathlib.Path("standfast-results/smoke"), first.folder
    again = standfast.run({"mine": Counting}, version="1", **ARGUMENTS)
    assert Counting.made == 1 and again.folder == first.folder and again.trials == first.trials
    other = standfast.run({"mine": Counting}, version="2", **ARGUMENTS)
    assert Counting.made == 2 and other.folder != first.folder


def test_another_process_says_that_the_object_is_gone():
    result = standfast.run({"mine": Hold}, **ARGUMENTS)
    command = [_program.program(), "replay", str(result.folder), "--trial=0", "--controller=mine", "--replay=page.html"]
    alone = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    told = " ".join(alone.stderr.split())
    assert alone.returncode == 2 and "this controller was an object of another process, of Python: __main__.Hold" in told, told
    # A later call has other objects.
    file = result.folder / "inputs/controllers/mine.toml"
    try:
        standfast.push({"mine": Hold, "other": str(file)})
    except LookupError as error:
        assert "not the present one" in str(error)
    else:
        raise AssertionError("it was asked")


def test_a_check_finds_rows_that_depend_on_others():
    class Mean(Hold):
        def change(self, rows, command):
            mean = sum(row[0] for row in rows.q) / rows.n
            for row in command["q_ref"]:
                row[0] += 0.001 * mean

    class Place(Hold):
        def change(self, rows, command):
            command["q_ref"][-1][0] += 1e-15

    class Forgets(Memory):
        def change(self, rows, command):
            rows.new = [False] * rows.n
            super().change(rows, command)

    for controller, words in [(Memory, None), (MemoryOfOne, None), (Mean, "in the batch"), (Place, "other places"), (Forgets, "does not forget")]:
        found = standfast.check(controller, set=SHORT)
        told = " ".join(found.dependence)
        assert (words is None) == (not told) and (words or "") in told, (controller, told)
        assert found.is_good == (words is None), (controller, repr(found))


def test_push_limit_and_pages():
    pushed = standfast.push(Memory, impulse=1.0)
    assert standfast.check("catch", set=SHORT).dependence is None
    assert pushed.outcome == "Recovered" and len(pushed.trace["time_s"]) > 500 and "<svg" in pushed._repr_html_()
    # With gains of its own, and by numbers of another kind.
    class Soft(Hold):
        def tick_batch(self, rows):
            command = super().tick_batch(rows)
            command["gains"] = [[[30.0, 1.0]] * len(self.home["q_ref"])] * rows.n
            return command

    soft = standfast.push({"soft": Soft}, impulse=1.0)
    assert soft.trace["com_x_m"] != pushed.trace["com_x_m"]
    result = standfast.run({"mine": Hold, "catch": None}, **ARGUMENTS)
    page = result._repr_html_()
    assert page.startswith("<iframe srcdoc=") and "&lt;h1&gt;" in page and len(page) < 300_000, len(page)
    assert "mine" in repr(result) and set(result.rates) == {"mine", "catch"}
    asked = dict(campaign="nominal", headings=2, precision=2.0, replicas=0, quiet=True, untried=True)
    limits, others = (standfast.limit({"mine": Hold}, batch=batch, **asked) for batch in (1, 8))
    assert [row["heading_deg"] for row in limits.rows] == [0.0, 180.0] and limits.rows == others.rows
    assert all(1.5 < row["impulse50_n_s"] < 4.0 for row in limits.rows) and "<svg" in limits._repr_html_()
    nothing_is_left()


def test_numbers_of_any_kind_are_taken():
    class Tensor:
        """As one of torch, on a graphics card."""

        def __init__(self, rows):
            self.rows, self.shape = rows, (len(rows), len(rows[0]))

        def detach(self):
            return self

        def cpu(self):
            return self.rows

    plain = [[1, 2.5], [3, 4]]
    frame = _exchange.frame_of(plain, 2, 2)
    assert frame[8:] == b"".join(bytearray(__import__("struct").pack("<d", number)) for row in plain for number in row)
    if numpy:
        assert _exchange.frame_of(numpy.array(plain, dtype="float32"), 2, 2) == frame
        assert _exchange.frame_of(Tensor(plain), 2, 2) == frame


def test_examples_do_what_they_say():
    if not numpy:
        print("left out: there is no numpy")
        return
    root = pathlib.Path(__file__).parents[2]
    readme, guide = ((root / file).read_text() for file in ("assets/python/README.md", "src/guide/process.md"))
    blocks = [re.findall(r"```python\n(.*?)```", text, re.S) for text in (readme, guide)]
    (example,) = [block for block in blocks[0] if "tick_batch" in block]
    assert example in blocks[1]
    names = {}
    exec(example, names)
    # The one with a memory learns from what it sees, so it is not the same as without.
    trials = names["result"].trials
    assert len(trials["trial"]) == 30 and set(trials["controller"]) == {"mine", "catch"}
    assert standfast.check(names["Mine"]).is_good


def main(names):
    # Without libraries for tables, which may be there or not.
    _program._library = lambda: None
    tests = {name: test for name, test in globals().items() if name.startswith("test_")}
    for name in names or tests:
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as temporary:
            os.chdir(folder)
            tempfile.tempdir = temporary
            tests[name]()
            os.chdir("/")
            tempfile.tempdir = None
            print(name, "is fine", flush=True)


main(sys.argv[1:])
