#!/usr/bin/env python3
"""What a search for better numbers gains per CPU time: `standfast tune`, pycma and a random search, with as many episodes.

    python3 -m pip install cma
    python3 benches/tune_peers.py [--program target/release/standfast] -- ARGUMENTS OF tune

Everything after `--` goes to `standfast tune`. The peers search the same numbers in the same ranges, run their candidates by
`standfast run` with fresh trials in every generation, and all three are judged by the final campaign of `tune`.
"""

import argparse
import json
import math
import os
import random
import resource
import subprocess
import tempfile
import tomllib
from pathlib import Path

import cma

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--program", default="target/release/standfast")
parser.add_argument("tune", nargs="+", metavar="ARGUMENT")
args = parser.parse_args()
scratch = Path(tempfile.mkdtemp())


def children_s():
    """CPU time of all commands so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def tune():
    """Runs the search of `tune`. Returns the CPU time up to its final campaign."""
    command = [args.program, "tune", *args.tune, "--out", scratch / "tune"]
    search_s = 0.0
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as program:
        for line in program.stderr:
            if line.startswith("judges "):
                fields = Path(f"/proc/{program.pid}/stat").read_text().rsplit(")", 1)[1].split()
                search_s = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    assert program.returncode == 0 and search_s > 0.0, "tune failed, or proposed nothing"
    return search_s


tune_s = tune()
tuned = json.loads((scratch / "tune/tune.json").read_text())
numbers, episodes = tuned["tunables"], tuned["searched"]
final = scratch / "tune" / tuned["verdicts"][0]["folder"]
proposed = (scratch / "tune/proposed.toml").read_text()


def is_by_ratios(number):
    low, high = number["range"]
    return low > 0 and high >= 3 * low


def value(number, share):
    low, high = number["range"]
    share = min(max(share, 0.0), 1.0)
    return low * (high / low) ** share if is_by_ratios(number) else low + (high - low) * share


def share(number):
    low, high = number["range"]
    now = number["now"]
    return math.log(now / low) / math.log(high / low) if is_by_ratios(number) else (now - low) / (high - low)


def toml(item):
    if isinstance(item, dict):
        return "{" + ", ".join(f"{key} = {toml(inner)}" for key, inner in item.items()) + "}"
    if isinstance(item, list):
        return "[" + ", ".join(map(toml, item)) + "]"
    return json.dumps(item)


def write(shares, name):
    """The proposed gain set with other values."""
    tree = tomllib.loads(proposed)
    for number, one in zip(numbers, shares):
        at, *keys = [tree, *number["key"].split(".")]
        for key in keys[:-1]:
            at = at[int(key)] if isinstance(at, list) else at.setdefault(key, {})
            if at == {}:
                at.update({"place": [0.0, 0.0], "zmp": [0.0, 0.0], "tilt": [0.0, 0.0]})
        last = keys[-1]
        at[int(last) if isinstance(at, list) else last] = float(value(number, one))
    tree["name"] = name
    path = scratch / f"{name}.toml"
    path.write_text("".join(f"{key} = {toml(item)}\n" for key, item in tree.items()))
    return path


def rates(paths, seed, count, out):
    """How often each recovers from the same `count` pushes."""
    gains = [word for path in paths for word in ("--controller", str(path))]
    command = [args.program, "run", final / "campaign.toml", "--seed", str(seed), "--trials", str(count), *gains]
    command += ["--replays", "0", "--untried", "--out", scratch / out]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    sets = json.loads((scratch / out / "summary.json").read_text())["controllers"]
    return [one["success_rate"] for one in sets]


now = [share(number) for number in numbers]
# The first spread of tune's samples.
spread = min(0.4 / math.sqrt(len(now)), 0.3)


def by_cma(count=48):
    """pycma as it comes, with the noise left to its recombination."""
    options = {"bounds": [0, 1], "verbose": -9, "seed": 1}
    search, spent = cma.CMAEvolutionStrategy(now, spread, options), 0
    while spent + search.popsize * count <= episodes:
        samples = search.ask()
        paths = [write(sample, f"c{i}") for i, sample in enumerate(samples)]
        found = rates(paths, 1000 + search.countiter, count, f"cma-{search.countiter}")
        search.tell(samples, [-rate for rate in found])
        spent += search.popsize * count
    return search.result.xfavorite


def at_random(count=48):
    """Candidates around the present values; the better half goes on with twice the trials, until one is left."""

    def cost(candidates):
        return 0 if candidates < 2 else candidates * count + 2 * cost(candidates // 2)

    draw = random.Random(1)
    candidates = max(n for n in range(2, episodes // count + 1) if cost(n) <= episodes)
    left = [[one + draw.gauss(0, spread) for one in now] for _ in range(candidates)]
    k = 0
    while len(left) > 1:
        paths = [write(sample, f"r{i}") for i, sample in enumerate(left)]
        found = rates(paths, 5000 + k, count * 2**k, f"random-{k}")
        order = sorted(range(len(left)), key=lambda i: -found[i])
        left = [left[i] for i in order[: len(left) // 2]]
        k += 1
    return left[0]


searches, used_s = {"standfast tune": scratch / "tune/proposed.toml"}, {"standfast tune": tune_s}
for name, search in {"pycma": by_cma, "random": at_random}.items():
    before_s = children_s()
    searches[name] = write(search(), name)
    used_s[name] = children_s() - before_s
trials = tuned["verdicts"][0]["trials"]
before = 100 * tuned["verdicts"][0]["recovered"][0] / trials
print(f"{tuned['controller']}: {before:.1f} % of {trials} trials; after {episodes} episodes each:")
for name, rate in zip(searches, rates(searches.values(), tuned["final_seed"], trials, "judged")):
    gained = 100 * rate - before
    each = f"{used_s[name] / 60 / gained:.1f} min a point" if gained > 0 else "nothing gained"
    print(f"  {name:14} {100 * rate:5.1f} % ({gained:+.1f})  {used_s[name] / 60:6.1f} min of CPU time, {each}")
