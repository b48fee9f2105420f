#!/usr/bin/env python3
"""Compares standfast's physics with MuJoCo's, on the same robot and the same machine, as ratios.

The script makes a throwaway Python environment with MuJoCo in a temporary folder, and builds the robot for MuJoCo from
the URDF and the settings in assets/: links, rotors, joint stops, box soles, friction and the servo law of
src/sim/servo.rs. It checks that both are the same robot, and then runs both sides in turn, on one thread:

1. the time of a physics step, standing and lying after a fall: `cargo bench` for the plant, `mj_step` for MuJoCo
   (wall clock of the fastest batch of steps, which other work on the machine disturbs least; the plant's step has its
   servos and contact wrenches in it, MuJoCo's has not);
2. simulated seconds per CPU second while the robot stands: `standfast run` against a loop in Python;
3. trials of the standard campaign per CPU second: `standfast run standard --gains hold --threads 1` against the Python
   loop that one would write first (servos in numpy, a push of 50 ms, a judge; no noise, variations or records);
4. for how many pushes both come to the same outcome, so that it is seen to be the same physics.

It needs Python 3.11, cargo, and a package registry with MuJoCo. All that it writes it removes at the end, but for what
cargo builds.
"""

import argparse
import csv
import json
import os
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import venv
import xml.etree.ElementTree as xml
from pathlib import Path

if sys.version_info < (3, 11):
    sys.exit("Python 3.11 or newer is needed")
import tomllib

PROJECT = Path(__file__).resolve().parents[2]
ROBOT = "ut-mu2"
GRAVITY = 9.81
PUSH_S = 0.05
# Steps of MuJoCo that are timed together.
BATCH = 20
BENCH = ["cargo", "bench", "--locked", "--bench", "layers"]
# The robots are the same if they differ by no more than this, relatively.
TOLERANCE = 1e-4
# Under its weight the robot sinks into the ground by some hundredths of a millimetre, which depends on the contacts'
# stiffness: its COM may be lower by this much (m).
SINKS_M = 1e-4
# Time constant of MuJoCo's contacts (s), which makes them nearly rigid.
SOLREF_S = 0.004


def main():
    arguments = parse_arguments()
    if arguments.inside:
        return compare(arguments)
    # When it is told to end, it still removes its folder.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("terminated"))
    with tempfile.TemporaryDirectory(prefix="standfast-peer-") as folder:
        environment = Path(folder) / "environment"
        tell("making a Python environment with MuJoCo ...")
        venv.create(environment, with_pip=True)
        python = environment / "bin" / "python"
        call([python, "-m", "pip", "install", "--quiet", arguments.mujoco, "numpy"], "MuJoCo cannot be installed")
        program = arguments.program
        tell("building standfast and its benchmark ...")
        if program is None:
            call(["cargo", "build", "--release", "--locked"], "standfast cannot be built", cwd=PROJECT)
            program = target_folder() / "release" / "standfast"
        call([*BENCH, "--no-run"], "the benchmark cannot be built", cwd=PROJECT)
        # This file bears the name of the package that it imports, so its folder must not be searched (-P).
        inside = [python, "-P", __file__, *sys.argv[1:], "--program", program, "--inside", folder]
        single = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
        return subprocess.run(inside, env=os.environ | single).returncode


def parse_arguments():
    what, _, how = __doc__.partition("\n\n")
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=what, epilog=how, formatter_class=raw)
    parser.add_argument("--program", type=Path, help="the program standfast; without it, cargo builds it")
    parser.add_argument("--mujoco", default="mujoco", help="what pip installs, such as mujoco==3.3.0 [%(default)s]")
    parser.add_argument("--rounds", type=int, default=5, help="rounds, in each of which both sides run [%(default)s]")
    parser.add_argument("--trials", type=int, default=25, help="trials in a round [%(default)s]")
    parser.add_argument("--pushes", type=int, default=100, help="pushes whose outcomes are compared [%(default)s]")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for name in ("rounds", "trials", "pushes"):
        if getattr(arguments, name) < 1:
            parser.error(f"--{name} = {getattr(arguments, name)}: accepted: 1 or more")
    if arguments.program is not None:
        arguments.program = arguments.program.resolve()
        if not os.access(arguments.program, os.X_OK):
            parser.error(f"--program = {arguments.program}: is not a program")
    return arguments


def tell(text):
    print(text, file=sys.stderr, flush=True)


def call(command, problem, **options):
    """The standard output of a command. If it fails, this script ends with `problem` and what the command said."""
    command = [str(word) for word in command]
    try:
        done = subprocess.run(command, capture_output=True, text=True, **options)
    except OSError as error:
        sys.exit(f"{problem}: {command[0]}: {error}")
    if done.returncode != 0:
        sys.exit(f"{problem}: `{' '.join(command)}` ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return done.stdout


def target_folder():
    metadata = call(["cargo", "metadata", "--format-version", "1", "--no-deps"], "no cargo project", cwd=PROJECT)
    return Path(json.loads(metadata)["target_directory"])


# Standfast


class Standfast:
    """The program, and its benchmark of the plant."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def __call__(self, *words):
        return call([self.program, *words], "standfast failed", cwd=self.folder)

    def run_cpu_s(self, trials, seed, *words):
        """CPU time of a campaign on one thread: of the whole program, from its start to its end."""
        with tempfile.TemporaryDirectory(dir=self.folder) as out:
            before = children_cpu_s()
            self("run", "standard", "--gains", "hold", "--threads", "1", "--trials", str(trials),
                 "--seed", str(seed), "--replays", "0", "--out", f"{out}/result", *words)
            return children_cpu_s() - before

    def step_s(self):
        """Time of a physics step, standing and fallen: the mean of the fastest sample."""
        with tempfile.TemporaryDirectory(dir=self.folder) as out:
            steps = [*BENCH, "--", "physics step/(standing|fallen)"]
            call(steps, "the benchmark failed", cwd=PROJECT, env=os.environ | {"CRITERION_HOME": out})
            times = {}
            for file in Path(out).rglob("new/benchmark.json"):
                samples = json.loads((file.parent / "sample.json").read_text())
                name = json.loads(file.read_text())["full_id"].removeprefix("physics step/")
                times[name] = min(ns / count for ns, count in zip(samples["times"], samples["iters"])) * 1e-9
            return times["standing"], times["fallen"]

    def survives(self, impulse_n_s, heading_deg):
        words = f"--gains=hold --impulse={impulse_n_s} --heading={heading_deg} --duration={PUSH_S} --json".split()
        return json.loads(self("push", *words))["outcome"] == "Recovered"

    def at_rest(self):
        """COM height (m) and vertical contact force (N) after two seconds of standing."""
        trace = self.folder / "trace.csv"
        self("push", "--gains=hold", "--impulse=0", "--horizon=2", f"--trace={trace}")
        with open(trace) as file:
            last = list(csv.DictReader(file))[-1]
        return float(last["com_z_m"]), float(last["contact_force_z_n"])


def children_cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


# MuJoCo


class Peer:
    """The robot in MuJoCo, at home on level ground, with servos that hold its posture as gain set `hold` does."""

    def __init__(self, episode):
        import mujoco
        import numpy

        self.mj, self.np = mujoco, numpy
        self.episode, self.dt = episode, episode["physics_step_s"]
        settings = tomllib.loads((PROJECT / f"assets/robots/{ROBOT}.toml").read_text())
        soles = [f"{settings['soles'][side]}/0" for side in ("left", "right")]
        servo = {joint: group for group in settings["servos"] for joint in group["joints"]}
        self.model = self.compile(settings["friction"], servo, soles)
        self.data = mujoco.MjData(self.model)
        names = [self.model.joint(i).name for i in range(1, self.model.njnt)]
        column = lambda key: numpy.array([servo[name][key] for name in names])
        self.kp, self.kd, self.torque = column("kp_n_m_rad"), column("kd_n_m_s_rad"), column("torque_n_m")
        self.full, self.none = column("full_torque_speed_rad_s"), column("no_torque_speed_rad_s")
        self.q_ref = numpy.array([settings["home_rad"].get(name, 0.0) for name in names])
        self.trunk = self.model.body(settings["trunk"]).id
        self.may_touch = numpy.zeros(self.model.ngeom, bool)
        self.may_touch[[self.model.geom(name).id for name in ["ground", *soles]]] = True
        self.stand(soles)

    def compile(self, friction, servo, soles):
        """The model from the URDF: the root gets a floating joint, and each collision a name, `link/number`."""
        urdf = xml.parse(PROJECT / f"assets/robots/{ROBOT}.urdf").getroot()
        children = {joint.find("child").get("link") for joint in urdf.findall("joint")}
        for link in urdf.findall("link"):
            for visual in link.findall("visual"):
                link.remove(visual)
            for number, collision in enumerate(link.findall("collision")):
                collision.set("name", f"{link.get('name')}/{number}")
            if link.get("name") not in children:
                root = link.get("name")
        xml.SubElement(urdf, "link", name="world")
        base = xml.SubElement(urdf, "joint", name="base", type="floating")
        xml.SubElement(base, "parent", link="world")
        xml.SubElement(base, "child", link=root)
        spec = self.mj.MjSpec.from_string(xml.tostring(urdf, encoding="unicode"))
        spec.option.timestep, spec.option.gravity = self.dt, [0, 0, -GRAVITY]
        spec.option.cone = self.mj.mjtCone.mjCONE_ELLIPTIC
        spec.worldbody.add_geom(name="ground", type=self.mj.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
        for geom in spec.geoms:
            geom.condim, geom.friction[0], geom.solref = 3, friction, [SOLREF_S, 1]
            # Everything collides with the ground, and of the links only the soles with each other.
            geom.contype, geom.conaffinity = {"ground": (1, 0)}.get(geom.name, (2, 3) if geom.name in soles else (0, 1))
        for joint in spec.joints:
            joint.solref_limit = [SOLREF_S, 1]
            if joint.name in servo:
                joint.armature = servo[joint.name]["rotor_inertia_kg_m2"]
        return spec.compile()

    def stand(self, soles):
        """Places the robot at home, the soles on the ground and the origin between them, and finds the joint torques
        that carry its weight there."""
        mj, np, model, data = self.mj, self.np, self.model, self.data
        data.qpos[7:] = self.q_ref
        mj.mj_forward(model, data)
        geoms = [model.geom(name).id for name in soles]
        faces = [data.geom_xpos[g] - data.geom_xmat[g].reshape(3, 3)[:, 2] * model.geom_size[g][2] for g in geoms]
        data.qpos[:3] -= (faces[0] + faces[1]) / 2
        self.home = data.qpos.copy()
        mj.mj_forward(model, data)
        faces = [face - (faces[0] + faces[1]) / 2 for face in faces]
        self.com = data.subtree_com[self.trunk].copy()
        self.push_origin = data.xmat[self.trunk].reshape(3, 3).T @ (self.com - data.xpos[self.trunk])
        torque, jacobian = data.qfrc_bias.copy(), np.zeros((3, model.nv))
        right = (faces[0][1] - self.com[1]) / (faces[0][1] - faces[1][1])
        for geom, face, share in zip(geoms, faces, (1 - right, right)):
            mj.mj_jac(model, data, jacobian, None, np.array([self.com[0], face[1], 0.0]), model.geom_bodyid[geom])
            torque -= jacobian.T @ np.array([0.0, 0.0, share * self.mass() * GRAVITY])
        self.tau_ff = torque[6:]

    def mass(self):
        return float(self.model.body_mass.sum())

    def reset(self):
        self.mj.mj_resetData(self.model, self.data)
        self.data.qpos[:] = self.home

    def drive(self):
        """The servo law for the next step, as in src/sim/servo.rs. MuJoCo integrates damping implicitly, too."""
        np, q, dq = self.np, self.data.qpos[7:], self.data.qvel[6:]
        constant = self.kp * (self.q_ref - q) + self.tau_ff
        wanted = constant - self.kd * dq
        available = self.torque * np.clip((self.none - np.abs(dq)) / (self.none - self.full), 0, 1)
        forward = np.where(dq > 0, available, self.torque)
        backward = np.where(dq < 0, available, self.torque)
        limited = (wanted > forward) | (wanted < -backward)
        self.data.qfrc_applied[6:] = np.where(limited, np.clip(wanted, -backward, forward), constant)
        self.model.dof_damping[6:] = np.where(limited, 0, self.kd)

    def push(self, force):
        """A force (N) for the next step at the trunk, on a line through the COM of the home posture."""
        data, body = self.data, self.trunk
        point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ self.push_origin
        data.xfrc_applied[body, :3] = force
        data.xfrc_applied[body, 3:] = self.np.cross(point - data.xipos[body], force)

    def trial(self, impulse_n_s, heading_deg, start_s, decided=True):
        """Whether the robot stands still after this push. Unless `decided`, it runs to the horizon."""
        np, data, judge = self.np, self.data, self.episode["judge"]
        angle = np.radians(heading_deg)
        force = np.array([np.cos(angle), np.sin(angle), 0.0]) * impulse_n_s / PUSH_S
        first, last = round(start_s / self.dt), round((start_s + PUSH_S) / self.dt)
        every = round(self.episode["control_period_s"] / self.dt)
        since, stands = 0, False
        self.reset()
        for step in range(round(self.episode["horizon_s"] / self.dt)):
            self.drive()
            if first <= step < last:
                self.push(force)
            elif step == last:
                data.xfrc_applied[:] = 0
            self.mj.mj_step(self.model, data)
            if step % every:
                continue
            upright = data.xmat[self.trunk, 8]
            low = data.subtree_com[self.trunk, 2] < judge["fallen_com_height_ratio"] * self.com[2]
            touches = not self.may_touch[data.contact.geom].all()
            if decided and (low or touches or upright < np.cos(np.radians(judge["fallen_tilt_deg"]))):
                return False
            self.mj.mj_subtreeVel(self.model, data)
            slow = np.linalg.norm(data.subtree_linvel[self.trunk]) <= judge["standing_com_speed_m_s"]
            still = step >= last and slow and upright >= np.cos(np.radians(judge["standing_tilt_deg"]))
            since = since if still else step + 1
            stands = (step + 1 - since) * self.dt >= judge["standing_time_s"]
            if decided and stands:
                return True
        return bool(stands)

    def at_rest(self):
        """COM height (m) and vertical contact force (N) after two seconds of standing."""
        self.reset()
        self.steps_s(2.0)
        self.mj.mj_forward(self.model, self.data)
        wrench, force = self.np.zeros(6), 0.0
        for i in range(self.data.ncon):
            self.mj.mj_contactForce(self.model, self.data, i, wrench)
            force += wrench[0]
        return float(self.data.subtree_com[self.trunk, 2]), force

    def steps_s(self, duration_s):
        """Time of a step over this simulated time: the mean of the fastest batch."""
        batches = []
        for _ in range(round(duration_s / self.dt / BATCH)):
            spent = 0.0
            for _ in range(BATCH):
                self.drive()
                start = time.perf_counter()
                self.mj.mj_step(self.model, self.data)
                spent += time.perf_counter() - start
            batches.append(spent / BATCH)
        return min(batches)

    def step_s(self):
        """Time of a physics step, standing and fallen."""
        self.reset()
        standing = self.steps_s(4.0)
        self.trial(6.0, 0.0, 0.0, decided=False)
        assert self.data.subtree_com[self.trunk, 2] < 0.5 * self.com[2], "a robot that should have fallen stands"
        return standing, self.steps_s(4.0)

    def trials_cpu_s(self, trials, **options):
        start = time.process_time()
        for trial in trials:
            self.trial(*trial, **options)
        return time.process_time() - start


# The comparison


def compare(arguments):
    campaign = tomllib.loads((PROJECT / "assets/campaigns/standard.toml").read_text())
    episode, push = campaign["episode"], campaign["push"]
    standfast, peer = Standfast(arguments.program, arguments.inside), Peer(episode)
    print(f"MuJoCo {peer.mj.__version__}, {ROBOT}, physics step {1e3 * episode['physics_step_s']:g} ms")
    check_same_robot(standfast, peer)

    random = peer.np.random.default_rng(1)
    draw = lambda count: [
        (random.uniform(*push["impulse_n_s"]["uniform"]), random.uniform(*push["heading_deg"]["uniform"]))
        for _ in range(count)
    ]
    standing = ["--set", "push.impulse_n_s=0", "--set", "episode.end_early=false"]
    simulated_s, start_s = arguments.trials * episode["horizon_s"], push["start_s"]
    rounds = []
    for number in range(arguments.rounds):
        tell(f"round {number + 1} of {arguments.rounds} ...")
        steps = zip(standfast.step_s(), peer.step_s())
        still = [(0.0, 0.0, start_s)] * arguments.trials
        seconds = standfast.run_cpu_s(arguments.trials, number, *standing), peer.trials_cpu_s(still, decided=False)
        trials = [(*one, start_s) for one in draw(arguments.trials)]
        campaigns = standfast.run_cpu_s(arguments.trials, number), peer.trials_cpu_s(trials)
        rounds.append([*steps, seconds, campaigns])

    # Each row: a name, a unit, and the figure of a side from its time.
    print(f"\n{'':46}{'standfast':>12}{'MuJoCo':>12}{'ratio':>9}{'from':>9}{'to':>7}")
    per_cpu_s = lambda amount: lambda spent: amount / spent
    for row, (name, figure) in enumerate([
        ("a physics step, standing on two soles (us)", lambda spent: 1e6 * spent),
        ("a physics step, lying after a fall (us)", lambda spent: 1e6 * spent),
        ("simulated seconds per CPU second, standing", per_cpu_s(simulated_s)),
        ("trials of `standard` with `hold` per CPU second", per_cpu_s(arguments.trials)),
    ]):
        sides = [[figure(one[row][side]) for one in rounds] for side in (0, 1)]
        ratios = [ours / theirs for ours, theirs in zip(*sides)]
        ours, theirs, ratio = (statistics.median(values) for values in (*sides, ratios))
        print(f"{name:<47}{ours:>11.3g}{theirs:>12.3g}{ratio:>9.2f}{min(ratios):>9.2f}{max(ratios):>7.2f}")
    print(f"Medians of {arguments.rounds} rounds; the ratio is standfast's figure over MuJoCo's.\n")

    tell(f"outcomes of {arguments.pushes} pushes ...")
    outcomes = [(*one, standfast.survives(*one), peer.trial(*one, 0.5)) for one in draw(arguments.pushes)]
    same = [ours for _, _, ours, theirs in outcomes if ours == theirs]
    print(f"The same outcome of `hold` after {len(same)} of {len(outcomes)} pushes "
          f"({100 * len(same) / len(outcomes):.1f} %): both recover from {sum(same)} and fall after {same.count(False)}.")
    for impulse_n_s, heading_deg, ours, theirs in outcomes:
        if ours != theirs:
            only = "standfast" if ours else "MuJoCo"
            print(f"  {impulse_n_s:.2f} N s at {heading_deg:.0f} degrees: it recovers only in {only}")
    return 0


def check_same_robot(standfast, peer):
    """Prints what must agree, and ends the script if it does not."""
    model = json.loads(standfast("model", ROBOT, "--json"))
    (height, force), (peer_height, peer_force) = standfast.at_rest(), peer.at_rest()
    print(f"\n{'The same robot?':<46}{'standfast':>12}{'MuJoCo':>12}{'difference':>12}")
    home, wrong = model["home"]["com_height_m"], []
    for name, ours, theirs, accepted in [
        ("mass (kg)", model["mass_kg"], peer.mass(), TOLERANCE),
        ("height of the COM at home (m)", home, float(peer.com[2]), TOLERANCE),
        ("the same after standing for 2 s (m)", height, peer_height, SINKS_M / home),
        ("force of the ground after 2 s (N)", force, peer_force, TOLERANCE),
    ]:
        difference = theirs / ours - 1
        print(f"{name:<46}{ours:>12.5f}{theirs:>12.5f}{difference:>12.1e}")
        if not abs(difference) <= accepted:
            wrong.append(f"{name}: accepted: a difference of up to {accepted:.1g}")
    if wrong:
        sys.exit("not the same robot: " + "; ".join(wrong))


if __name__ == "__main__":
    sys.exit(main())
