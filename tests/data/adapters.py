"""Observations as the deployments of trainers build them, each written apart from the program, for a linear policy of UT-mu2.

A controller of kind "process". Its parameters name the family, and its law is action = observation * W + b.
"""

import math

import standfast

PERIOD_TICKS = 10


def weight(i, j):
    return 0.02 * math.sin(1.0 + 0.7 * i + 1.3 * j)


def turned_back(quaternion, v):
    """The world's vector v in the axes of the body."""
    w, x, y, z = quaternion
    u = (-x, -y, -z)
    def cross(a, b):
        return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    t = [2 * c for c in cross(u, v)]
    c = cross(u, t)
    return [v[i] + w * t[i] + c[i] for i in range(3)]


def clamp(numbers, most):
    return [max(-most, min(most, number)) for number in numbers]


class Linear(standfast.Controller):
    def __init__(self, hello):
        super().__init__(hello)
        self.command = [0.3, -0.1, 0.2]
        self.family = getattr(self, self.parameters["family"])
        count = len(self.joints)
        self.driven = range(count - self.parameters["driven"], count)

    def reset(self, seed):
        self.ticks = 0
        self.past = {}
        self.phase_of_gait = 0.0
        self.action = [0.0] * len(self.driven)

    def tick(self, sensed):
        if self.ticks % PERIOD_TICKS == 0:
            self.gravity = turned_back(sensed["orientation"], (0.0, 0.0, -1.0))
            self.q = [sensed["q"][j] for j in self.driven]
            self.rel = [sensed["q"][j] - self.home[j] for j in self.driven]
            self.dq = [sensed["dq"][j] for j in self.driven]
            observed = self.family(sensed)
            self.action = [
                sum(weight(i, j) * number for i, number in enumerate(observed)) for j in range(len(self.driven))
            ]
            if "clip" in self.parameters:
                self.action = clamp(self.action, self.parameters["clip"])
        self.ticks += 1
        home = self.robot["home"]
        q_ref, tau_ff = list(self.home), list(home["tau_ff"])
        gains = [[joint["kp"], joint["kd"]] for joint in self.robot["joints"]]
        for i, j in enumerate(self.driven):
            q_ref[j] = self.home[j] + self.parameters["scale"] * self.action[i]
            tau_ff[j] = 0.0
            gains[j] = [80.0, 2.5]
        return {"q_ref": q_ref, "tau_ff": tau_ff, "gains": gains}

    def last(self, name, count, now, before=None):
        """The last `count` values, the oldest first."""
        past = self.past.setdefault(name, [list(now if before is None else before) for _ in range(count)])
        past.append(list(now))
        past.pop(0)
        return past

    def unitree_rl_mjlab(self, sensed):
        """ObservationManager with use_gym_history and scale_first: three frames of all terms; scaled, then clipped."""
        self.phase_of_gait = (self.phase_of_gait + 0.02 / 0.8) % 1.0
        turn = 2 * math.pi * self.phase_of_gait
        terms = [
            clamp([0.5 * rate for rate in sensed["gyro"]], 0.3),
            self.gravity,
            self.command,
            self.rel,
            [0.05 * rate for rate in self.dq],
            self.action,
            [math.sin(turn), math.cos(turn)],
        ]
        frames = self.last("frames", 3, [number for term in terms for number in term])
        return [number for frame in frames for number in frame]

    def mjlab(self, sensed):
        """Terms with a clip before the scale, and a history of two of them."""
        gyro = [0.25 * rate for rate in clamp(sensed["gyro"], 0.4)]
        terms = [
            *self.last("gyro", 4, gyro),
            self.gravity,
            *self.last("dq", 2, [0.1 * rate for rate in self.dq]),
            self.rel,
            self.action,
            self.command,
        ]
        return [number for term in terms for number in term]

    def booster_gym(self, sensed):
        """Policy.inference of its deployment. The clock stands while the command is 0."""
        walks = 1.0 if math.hypot(*self.command) > 1e-5 else 0.0
        turn = 2 * math.pi * math.fmod(sensed["time_s"] * 1.5, 1.0)
        x, y, yaw = self.command
        return [
            *self.gravity,
            *sensed["gyro"],
            x * 2.0 * walks,
            y * 2.0 * walks,
            yaw * walks,
            math.cos(turn) * walks,
            math.sin(turn) * walks,
            *self.rel,
            *[0.1 * rate for rate in self.dq],
            *self.action,
        ]

    def humanoid_gym(self, sensed):
        """sim2sim.py: 15 frames, of which those before the start are 0; Euler angles; everything within 0.5."""
        turn = 2 * math.pi * sensed["time_s"] / 0.64
        w, x, y, z = sensed["orientation"]
        euler = [
            math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
            math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
        vx, vy, yaw = self.command
        frame = clamp(
            [
                math.sin(turn),
                math.cos(turn),
                2 * vx,
                2 * vy,
                yaw,
                *self.rel,
                *[0.05 * rate for rate in self.dq],
                *self.action,
                *sensed["gyro"],
                *euler,
            ],
            0.5,
        )
        frames = self.last("frames", 15, frame, before=[0.0] * len(frame))
        return [number for frame in frames for number in frame]

    def leapp(self, sensed):
        """Raw inputs. The network keeps half of what it kept, and the angular velocity."""
        kept = self.past.get("kept", [0.0] * 3)
        self.past["kept"] = [0.5 * old + rate for old, rate in zip(kept, sensed["gyro"])]
        return [*sensed["orientation"], *sensed["gyro"], *self.command, *sensed["q"], *sensed["dq"], *kept]


standfast.serve(Linear)
