//! Pendulum bounds: the largest impulse from which an ideal pendulum with these feet can recover without a footstep,
//! with one, and with any number (Koolen et al. 2012, "Capturability-based analysis and control of legged locomotion");
//! and a ceiling for a robot that can do more than a pendulum.
//!
//! An instantaneous impulse J shifts the divergent component of motion (dcm) by J/(m omega), with mass m and natural
//! frequency omega, from the COM's position at home. The robot can recover if the dcm then lies in a certain set:
//! - **No step**: the hull of both soles.
//! - **One step**: let the robot stand on the sole s + B (centre s, shape B) with its ZMP at p in s + B. (The ZMP may
//!   move; what counts is a mean, which stays in the convex s + B.) After the time T of the step, the dcm is at
//!   `p + e^(omega T) (dcm - p)`. The robot recovers if this lies in the hull of the stance sole and the sole that
//!   lands at s + r, with r in a landing region R: in `s + conv({0} u R) + B`, for the hull of two equal soles is the
//!   segment between their centres, widened by a sole. When a foot crosses in front, this segment is diagonal. With
//!   q = e^(-omega T), and because (1 - q) B + q B = B, the set for the dcm is `s + B + q conv({0} u R)`.
//! - **N steps**: at T the dcm need only be where the sole at s + r can recover with N - 1 more steps:
//!   `C_N = (1 - q) B + q (R + C'_(N-1))`, where the prime is the mirrored reach of the other foot. Expanded,
//!   `C_N = B + q1 R1 + q1 q2 R2' + ... + q1 .. qN conv({0} u RN)`: each footstep may take another region, with the
//!   time of that region. In one dimension and with one region, d_N = (l - r + d_(N-1)) q + r.
//!
//! The set of all impulses is the union of these sets over the sequences of regions. Each is a polygon: the
//! hull of two boxes, without and with the last footstep. The largest J along a heading is found by going through the sequences of at most
//! [`MOST_STEPS`] footsteps in which all footsteps from the second on land in the same region, so that a crossing may
//! come first or follow another footstep. What other sequences bring is not known to be less, but it is shrunk by q1 q2.
//!
//! # The ceiling
//!
//! For the bounds, the COM stays at its height, there is no angular momentum, and the ZMP jumps at once. A robot can do
//! more. The ceiling ([`SteppingPendulum::ceiling_n_s`]) grants it all of the following together, each at its best, and
//! costs nothing for delay, joint limits, or the time to get ready:
//! - **A leap.** The legs push off with k times the weight for a time t, until they are straight
//!   or as fast as their motors turn. A force that passes nearer to the joints can be larger, so k depends on p. From its place at home,
//!   a COM with velocity v then has the dcm `xi = b v/omega - (a - 1) p`, where p is the ZMP in the support S,
//!   a = cosh + sqrt(k) sinh and b = cosh + sinh/sqrt(k), each of omega sqrt(k) t; for k = 1 both are e^(omega t). In the
//!   flight of 2 (k - 1) t that follows, feet travel with the COM, so the dcm stands still against them. The impact of
//!   the landing brakes as much as the push-off does, which counts as a factor a/b (it would be so if the landing feet
//!   were no farther from the COM than at home). So, from the set E after the landing, v/omega is in
//!   `a/b^2 E + (a - 1)/b S`.
//! - **Footsteps in flight.** With both feet pushing off, S is the hull of both soles, and in flight both feet move as far
//!   as their motors move them in that time (the square of its share of a swing's time, times the stride). With one foot
//!   pushing off, S is its sole, and the other foot swings from the beginning: the time of its swing is shortened by t
//!   and the flight. Any number of footsteps follow.
//! - **A flywheel.** The hips turn trunk and arms, of inertia I, by an angle theta with torque tau: first forward, then back.
//!   This moves the dcm by `tau/(m g) (1 - e^(-omega sqrt(I theta/tau)))^2` (Pratt et al. 2006), once.
//! - **Rocking.** A robot that tips over an edge as one stiff body is a pendulum with the inertia m h^2 + I of all of it: it
//!   takes `sqrt(1 + I/(m h^2))` times the impulse. This factor is applied to all of the above.
//!
//! What is not granted: more than one leap, a counter-movement before it, other contacts than the soles, and help by
//! the campaign's slope. For pushes below the COM the ceiling may be passed, since their angular momentum helps.

use crate::geometry::SupportPolygon;
use nalgebra::{Point2, Vector2};
use serde::Serialize;
use std::f64::consts::PI;

/// Largest number of footsteps that is tried: "any number". More would bring less than a thousandth.
pub const MOST_STEPS: usize = 10;
/// Number of footsteps that each may take any region.
const FREE_STEPS: usize = 2;
/// Shares of the largest force above the weight, and of the longest push-off, that are tried for a leap.
const FORCES: [f64; 2] = [0.5, 1.0];
const TIMES: [f64; 6] = [0.15, 0.3, 0.45, 0.6, 0.8, 1.0];

/// Where a foot can land, and the time of its swing (s): smallest and largest offsets from the centre of the stance sole
/// to that of the landing one (m), x forward and y to the side of the swing foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    pub x_m: [f64; 2],
    pub y_m: [f64; 2],
    pub swing_time_s: f64,
}

/// A pendulum on two soles side by side. Both are parallel to x, and the origin is midway between their centres.
#[derive(Debug, Clone, PartialEq)]
pub struct SteppingPendulum {
    pub mass_kg: f64,
    /// Natural frequency (rad/s).
    pub omega: f64,
    /// The COM at rest, where the dcm starts (m).
    pub com: Point2<f64>,
    /// Smallest and largest coordinates of a sole about its centre (m).
    pub sole_x_m: [f64; 2],
    pub sole_y_m: [f64; 2],
    /// Distance between the soles' centres (m).
    pub stance_width_m: f64,
    /// Where a foot can land. Without any there are no footsteps.
    pub regions: Vec<Region>,
}

/// Largest instantaneous impulses along one heading (N s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub no_step_n_s: f64,
    /// With at most one footstep; not less than without.
    pub one_step_n_s: f64,
    /// With any number of footsteps.
    pub n_step_n_s: f64,
}

/// What lets a robot do more than a pendulum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Agility {
    pub com_height_m: f64,
    /// Way by which the legs can lift the COM until they are straight (m).
    pub leg_stroke_m: f64,
    /// Fastest speed at which they can lift it (m/s).
    pub leg_speed_m_s: f64,
    /// Way by which trunk and arms, turned by the hips, can move the dcm fore and aft, and sideways (m).
    pub flywheel_m: [f64; 2],
    /// Inertia of the robot about its COM over that of its mass at COM height, I/(m h^2).
    pub inertia_ratio: f64,
}

/// Places of the ZMP during a push-off that are tried: shares of the way to the edge of the support.
pub const ZMP_SHARES: [f64; 3] = [0.3, 0.7, 1.0];

/// Largest forces with which legs can push off, in weights: both legs, the left one, the right one; for the ZMP at each
/// of [`ZMP_SHARES`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PushOff {
    pub both: [f64; 3],
    pub left: [f64; 3],
    pub right: [f64; 3],
}

/// A box parallel to the axes (m).
#[derive(Debug, Clone, Copy)]
struct Span {
    low: Vector2<f64>,
    high: Vector2<f64>,
}

impl Span {
    fn new([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> Self {
        Self { low: Vector2::new(x0, y0), high: Vector2::new(x1, y1) }
    }

    /// All sums of a point of this box, and `weight` times a point of the other.
    fn plus(self, other: Self, weight: f64) -> Self {
        Self { low: self.low + other.low * weight, high: self.high + other.high * weight }
    }

    fn around(half: Vector2<f64>) -> Self {
        Self { low: -half, high: half }
    }

    /// This box about the same centre, in another size.
    fn scaled(self, share: f64) -> Self {
        let (middle, half) = (0.5 * (self.low + self.high), 0.5 * share * (self.high - self.low));
        Self { low: middle - half, high: middle + half }
    }

    fn corners(&self) -> [Point2<f64>; 4] {
        let (low, high) = (self.low, self.high);
        [low, Vector2::new(high.x, low.y), high, Vector2::new(low.x, high.y)].map(Point2::from)
    }

    /// How far a ray from the origin goes until it leaves the hull of this box and another one (m); 0 if it misses.
    fn farthest(&self, along: Vector2<f64>, other: &Self) -> f64 {
        let hull = SupportPolygon::hull([self.corners(), other.corners()].as_flattened());
        hull.and_then(|hull| hull.distance_along(Point2::origin(), along)).unwrap_or(0.0)
    }
}

/// What comes before the first footstep: the set of dcms so far, and the factor by which it scales what follows.
struct Start {
    set: Span,
    weight: f64,
    /// Time by which the first swing is shortened (s).
    saved_s: f64,
}

impl SteppingPendulum {
    /// The bounds for a heading (degrees; 0 is forward, 90 to the left).
    pub fn bounds(&self, heading_deg: f64) -> Bounds {
        Bounds {
            no_step_n_s: self.at_most_n_s(heading_deg, 0),
            one_step_n_s: self.at_most_n_s(heading_deg, 1),
            n_step_n_s: self.at_most_n_s(heading_deg, MOST_STEPS),
        }
    }

    /// The bound with at most so many footsteps (N s), with the better foot as the first stance foot. Without a footstep
    /// it is m omega d, with d from the COM to the edge of the soles' hull. It is 0 if these footsteps recover from no
    /// impulse in this heading.
    pub fn at_most_n_s(&self, heading_deg: f64, steps: usize) -> f64 {
        let along = direction(heading_deg);
        let mut best = self.both_soles().farthest(along, &self.both_soles());
        for stance in [1.0, -1.0] {
            let start = Start { set: self.sole(stance), weight: 1.0, saved_s: 0.0 };
            self.step(along, &start, -stance, [0, steps], &self.regions, &mut best);
        }
        self.mass_kg * self.omega * best
    }

    /// The ceiling for a heading (N s): see the head of this module.
    pub fn ceiling_n_s(&self, heading_deg: f64, agility: &Agility, push_off: &PushOff) -> f64 {
        let along = direction(heading_deg);
        let flywheel = Span::around(agility.flywheel_m.into());
        let mut best: f64 = 0.0;
        for (share, load) in ZMP_SHARES.into_iter().zip(push_off.both) {
            for leap in self.leaps(agility, load) {
                let shift = Span::around(self.in_flight(leap.flight_s));
                let before = |set: Span| {
                    let support = self.both_soles().scaled(share);
                    flywheel.plus(set.plus(shift, 1.0), leap.after).plus(support, leap.during)
                };
                let stands = before(self.both_soles());
                best = best.max(stands.farthest(along, &stands));
                for stance in [1.0, -1.0] {
                    let start = Start { set: before(self.sole(stance)), weight: leap.after, saved_s: 0.0 };
                    self.step(along, &start, -stance, [0, MOST_STEPS], &self.regions, &mut best);
                }
            }
        }
        for (stance, loads) in [(1.0, push_off.left), (-1.0, push_off.right)] {
            for (share, load) in ZMP_SHARES.into_iter().zip(loads) {
                for leap in self.leaps(agility, load) {
                    let sole = self.sole(stance);
                    let set = flywheel.plus(sole, leap.after).plus(sole.scaled(share), leap.during);
                    let start = Start { set, weight: leap.after, saved_s: leap.push_off_s + leap.flight_s };
                    self.step(along, &start, -stance, [0, MOST_STEPS], &self.regions, &mut best);
                }
            }
        }
        self.mass_kg * self.omega * best * (1.0 + agility.inertia_ratio).sqrt()
    }

    /// Goes through the sequences of footsteps, of which `done` are done and `most` are the most, and raises `best` (m)
    /// to the farthest dcm. The next one is to the side `side`, in one of `regions`.
    fn step(
        &self,
        along: Vector2<f64>,
        start: &Start,
        side: f64,
        [done, most]: [usize; 2],
        regions: &[Region],
        best: &mut f64,
    ) {
        if done == most {
            return;
        }
        for region in regions {
            let time_s = (region.swing_time_s - start.saved_s).max(0.0);
            let weight = start.weight * (-self.omega * time_s).exp();
            let [y0, y1] = region.y_m.map(|y| side * y);
            let places = Span::new(region.x_m, [y0.min(y1), y0.max(y1)]);
            let next = Start { set: start.set.plus(places, weight), weight, saved_s: 0.0 };
            *best = best.max(start.set.farthest(along, &next.set));
            let regions = if done + 1 < FREE_STEPS { &self.regions[..] } else { std::slice::from_ref(region) };
            self.step(along, &next, -side, [done + 1, most], regions, best);
        }
    }

    /// The sole of the left foot (1) or the right one (-1), seen from the COM.
    fn sole(&self, foot: f64) -> Span {
        let at = Vector2::new(0.0, 0.5 * foot * self.stance_width_m) - self.com.coords;
        Span::new(self.sole_x_m.map(|x| x + at.x), self.sole_y_m.map(|y| y + at.y))
    }

    /// The hull of both soles, seen from the COM.
    fn both_soles(&self) -> Span {
        Span { low: self.sole(-1.0).low, high: self.sole(1.0).high }
    }

    /// Push-offs with up to `load` times the weight, and none at all.
    fn leaps(&self, agility: &Agility, load: f64) -> Vec<Leap> {
        let mut leaps = vec![Leap { push_off_s: 0.0, flight_s: 0.0, after: 1.0, during: 0.0 }];
        let gravity = self.omega * self.omega * agility.com_height_m;
        for (force, time) in FORCES.into_iter().flat_map(|force| TIMES.map(|time| (force, time))) {
            let extra = force * (load - 1.0);
            if extra <= 1e-3 {
                continue;
            }
            let straight_s = (2.0 * agility.leg_stroke_m / (extra * gravity)).sqrt();
            let push_off_s = time * straight_s.min(agility.leg_speed_m_s / (extra * gravity));
            let root = (1.0 + extra).sqrt();
            let angle = self.omega * root * push_off_s;
            let (a, b) = (angle.cosh() + root * angle.sinh(), angle.cosh() + angle.sinh() / root);
            leaps.push(Leap {
                push_off_s,
                flight_s: 2.0 * extra * push_off_s,
                after: a / (b * b),
                during: (a - 1.0) / b,
            });
        }
        leaps
    }

    /// How far both feet move in a flight, fore and aft and to a side (m).
    fn in_flight(&self, flight_s: f64) -> Vector2<f64> {
        let Some(region) = self.regions.first() else { return Vector2::zeros() };
        let share = (flight_s / region.swing_time_s).min(1.0).powi(2);
        let [x, y] = [region.x_m[0].abs().max(region.x_m[1]), (region.y_m[1] - self.stance_width_m).max(0.0)];
        Vector2::new(x, y) * share
    }
}

/// A push-off, the flight after it, and the factors of the sets after the landing and of the support during the
/// push-off.
struct Leap {
    push_off_s: f64,
    flight_s: f64,
    after: f64,
    during: f64,
}

/// Ratio of the impulse of a push with constant force over this duration (s) to an instantaneous one with the same
/// effect. The effect of a force f(t) is the integral of f e^(-omega t).
pub fn rectangular_push_factor(omega: f64, duration_s: f64) -> f64 {
    let angle = omega * duration_s;
    if angle < 1e-9 { 1.0 } else { angle / -(-angle).exp_m1() }
}

/// The same ratio for a force that is half a period of a sine.
pub fn half_sine_push_factor(omega: f64, duration_s: f64) -> f64 {
    let turn = omega * duration_s / PI;
    2.0 * (1.0 + turn * turn) / (1.0 + (-omega * duration_s).exp())
}

fn direction(heading_deg: f64) -> Vector2<f64> {
    let (sin, cos) = heading_deg.to_radians().sin_cos();
    Vector2::new(cos, sin)
}

#[cfg(test)]
mod tests;
