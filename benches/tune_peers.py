#!/usr/bin/env python3
"""What `standfast tune` gains per episode, beside pycma and a random search with the same budget.

    python3 -m pip install cma
    python3 benches/tune_peers.py FOLDER_OF_TUNE [--program target/release/standfast]

FOLDER_OF_TUNE is what `tune` left: its numbers, ranges and budget are read from there, and so are the trials of its final
campaign, by which all are judged. The peers run their candidates by `standfast run`, with fresh trials in every generation.
"""

import argparse
import json
import math
import random
import subprocess
import tempfile
import tomllib
from pathlib import Path

import cma

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("folder", type=Path)
parser.add_argument("--program", default="target/release/standfast")
args = parser.parse_args()
tuned = json.loads((args.folder / "tune.json").read_text())
numbers, scratch = tuned["tunables"], Path(tempfile.mkdtemp())
final = args.folder / tuned["verdicts"][0]["folder"]
episodes, trials = tuned["searched"], tuned["verdicts"][0]["trials"]


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


proposed = (args.folder / "proposed.toml").read_text()


def write(shares, name):
    """A gain set with these shares of the ranges: the proposed one with other values."""
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

    def inline(item):
        if isinstance(item, dict):
            return "{" + ", ".join(f"{key} = {inline(inner)}" for key, inner in item.items()) + "}"
        if isinstance(item, list):
            return "[" + ", ".join(map(inline, item)) + "]"
        return json.dumps(item)

    path = scratch / f"{name}.toml"
    path.write_text("".join(f"{key} = {inline(item)}\n" for key, item in tree.items()))
    return path


def rates(paths, seed, count, out):
    """How often each recovers from the same `count` pushes."""
    gains = [word for path in paths for word in ("--gains", str(path))]
    command = [args.program, "run", str(final / "campaign.toml"), "--seed", str(seed), "--trials", str(count), *gains]
    command += ["--replays", "0", "--untried", "--out", str(scratch / out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    sets = json.loads((scratch / out / "summary.json").read_text())["sets"]
    return [one["success_rate"] for one in sets]


now = [share(number) for number in numbers]


def by_cma(count=48):
    """pycma as it comes, with the noise left to its recombination."""
    options = {"bounds": [0, 1], "verbose": -9, "seed": 1}
    search, spent = cma.CMAEvolutionStrategy(now, 0.4 / math.sqrt(len(now)), options), 0
    while spent + search.popsize * count <= episodes:
        samples = search.ask()
        paths = [write(sample, f"c{i}") for i, sample in enumerate(samples)]
        found = rates(paths, 1000 + search.countiter, count, f"cma-{search.countiter}")
        search.tell(samples, [-rate for rate in found])
        spent += search.popsize * count
    return search.result.xfavorite


def at_random(count=48, near=0.15):
    """Candidates around the present values; the better half goes on with twice the trials, until one is left."""
    draw = random.Random(1)
    rounds = 6
    left = [[one + draw.gauss(0, near) for one in now] for _ in range(episodes // (rounds * count))]
    for k in range(rounds):
        if len(left) > 1:
            paths = [write(sample, f"r{i}") for i, sample in enumerate(left)]
            found = rates(paths, 5000 + k, count * 2**k, f"random-{k}")
            order = sorted(range(len(left)), key=lambda i: -found[i])
            left = [left[i] for i in order[: max(1, len(left) // 2)]]
    return left[0]


peers = {"pycma": by_cma(), "random": at_random()}
paths = [write(shares, name) for name, shares in peers.items()]
before, after = (100 * count / trials for count in tuned["verdicts"][0]["recovered"])
print(f"{tuned['controller']} {before:.1f} %; after {episodes} episodes each:")
print(f"  standfast tune {after:.1f} %")
for name, rate in zip(peers, rates(paths, tuned["final_seed"], trials, "judged")):
    print(f"  {name} {100 * rate:.1f} %")
