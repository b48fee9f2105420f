//! Pendulum bounds: the largest impulse from which an ideal pendulum with these feet can recover without a footstep,
//! with one, and with any number (Koolen et al. 2012, "Capturability-based analysis and control of legged locomotion").
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
//! An ankle may be too weak to hold the ZMP at the edge of its sole. Then B is the part on which it can hold all of the
//! weight. After the last footstep both ankles share it, and hold it on the larger part D, so that the sum has
//! `(1 - w) B + w D` in the place of B, with w = q1 .. qN.
//!
//! The set of all impulses is the union of these sets over the sequences of regions. Each of them is a polygon: the
//! hull of two boxes, without and with the last footstep. The largest J along a heading is found by going through the
//! sequences of at most [`MOST_STEPS`] footsteps in which all footsteps from the third on land in the same region as
//! the second, so that a crossing may come first or follow another footstep. Other sequences may bring more, but their
//! gain is shrunk by q1 q2.
//!
//! - **Early**: any number of footsteps to [places](Place) beyond the regions. The time of footstep k is `a + b |r_k - s_k|`,
//!   from where that foot stands, s_k: at home or, after the other foot has landed at r_(k-1), at `-r'_(k-1)`. The sequences that
//!   are gone through alternate between two places, one for each foot. Their set is `B + q1 r1 + q1 q2 r2' + ...`.
//!
//! These bounds are a yardstick, not a limit of every robot: they leave out leaps, angular momentum and rocking.

use crate::geometry::SupportPolygon;
use nalgebra::{Point2, Vector2};
use std::f64::consts::PI;

/// Largest number of footsteps that is tried, for "any number". More would bring about a thousandth.
pub const MOST_STEPS: usize = 10;
/// Number of first footsteps each of which may take any region.
const FREE_STEPS: usize = 2;
/// Offsets from the centre of the stance sole to the centre of a landing sole, and the time of the swing (s). The
/// offsets have a smallest and a largest value for each axis (m), x forward and y to the side of the swing foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingRegion {
    pub x_m: [f64; 2],
    pub y_m: [f64; 2],
    pub swing_time_s: f64,
}

/// A place where a foot can land.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// From the centre of the stance sole (m), x forward and y to the side of the foot.
    pub at: Vector2<f64>,
    /// Time in the air (s): without travel, and per travel of a metre.
    pub time_s: [f64; 2],
}

/// A pendulum on two soles side by side. Both are parallel to x, and the origin is midway between their centres.
#[derive(Debug, Clone, PartialEq)]
pub struct SteppingPendulum {
    pub mass_kg: f64,
    /// Natural frequency (rad/s).
    pub omega: f64,
    /// The COM at rest, where the dcm starts (m).
    pub com: Point2<f64>,
    /// Smallest and largest coordinates of the ZMP, about the centre of a sole (m), while that foot stands alone.
    pub sole_x_m: [f64; 2],
    pub sole_y_m: [f64; 2],
    /// Smallest and largest coordinates of the ZMP about the centre of a sole (m), while both feet stand.
    pub both_x_m: [f64; 2],
    pub both_y_m: [f64; 2],
    /// Distance between the soles' centres (m).
    pub stance_width_m: f64,
    /// The regions where a foot can land. If there are none, there are no footsteps.
    pub regions: Vec<SwingRegion>,
}

/// Largest instantaneous impulses along one heading (N s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub no_step_n_s: f64,
    /// With at most one footstep; it is not less than without.
    pub one_step_n_s: f64,
    /// With any number of footsteps.
    pub n_step_n_s: f64,
}

/// A box parallel to the axes (m).
#[derive(Debug, Clone, Copy)]
struct Span {
    low: Vector2<f64>,
    high: Vector2<f64>,
}

impl Span {
    fn new([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> Self {
        Self {
            low: Vector2::new(x0, y0),
            high: Vector2::new(x1, y1),
        }
    }

    /// The box of all sums of a point of this box and `weight` times a point of the other.
    fn plus(self, other: Self, weight: f64) -> Self {
        Self {
            low: self.low + other.low * weight,
            high: self.high + other.high * weight,
        }
    }

    fn corners(&self) -> [Point2<f64>; 4] {
        let (low, high) = (self.low, self.high);
        [
            low,
            Vector2::new(high.x, low.y),
            high,
            Vector2::new(low.x, high.y),
        ]
        .map(Point2::from)
    }

    /// How far a ray from the origin goes until it leaves this box (m); 0 if it misses.
    fn leaves_at(&self, along: Vector2<f64>) -> f64 {
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for k in 0..2 {
            if along[k] == 0.0 {
                if self.low[k] > 0.0 || self.high[k] < 0.0 {
                    return 0.0;
                }
                continue;
            }
            let [a, b] = [self.low[k] / along[k], self.high[k] / along[k]];
            (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
        }
        if enters <= leaves { leaves } else { 0.0 }
    }

    /// How far a ray from the origin goes until it leaves the hull of this box and another one (m); 0 if it misses.
    fn farthest(&self, along: Vector2<f64>, other: &Self) -> f64 {
        let hull = SupportPolygon::hull([self.corners(), other.corners()].as_flattened());
        hull.and_then(|hull| hull.distance_along(Point2::origin(), along))
            .unwrap_or(0.0)
    }
}

/// The sums of a sequence before its next footstep: the set of dcms so far, and the factor that scales the rest.
struct Start {
    set: Span,
    weight: f64,
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

    /// The bound with at most `steps` footsteps (N s), with the better foot as the first stance foot. Without a
    /// footstep it is m omega d, with d from the COM to the edge of the soles' hull. It is 0 if these footsteps recover
    /// from no impulse in this heading.
    pub fn at_most_n_s(&self, heading_deg: f64, steps: usize) -> f64 {
        let along = direction(heading_deg);
        let mut best = self.both_soles().farthest(along, &self.both_soles());
        for stance in [1.0, -1.0] {
            let start = Start {
                set: self.sole(stance),
                weight: 1.0,
            };
            self.step(along, &start, -stance, [0, steps], &self.regions, &mut best);
        }
        self.mass_kg * self.omega * best
    }

    /// Goes through the sequences of at most `most` footsteps that continue the first `done` ones, and raises `best`
    /// (m) to the farthest dcm. The next footstep is to the side `side`, in one of `regions`.
    fn step(
        &self,
        along: Vector2<f64>,
        start: &Start,
        side: f64,
        [done, most]: [usize; 2],
        regions: &[SwingRegion],
        best: &mut f64,
    ) {
        if done == most {
            return;
        }
        for region in regions {
            let weight = start.weight * (-self.omega * region.swing_time_s).exp();
            let [y0, y1] = region.y_m.map(|y| side * y);
            let places = Span::new(region.x_m, [y0.min(y1), y0.max(y1)]);
            let next = Start {
                set: start.set.plus(places, weight),
                weight,
            };
            let [stays, steps] =
                [&start.set, &next.set].map(|set| set.plus(self.gain_of_both(), weight));
            *best = best.max(stays.farthest(along, &steps));
            let regions = if done + 1 < FREE_STEPS {
                &self.regions[..]
            } else {
                std::slice::from_ref(region)
            };
            self.step(along, &next, -side, [done + 1, most], regions, best);
        }
    }

    /// The bound with any number of footsteps to these places (N s). It is that without a footstep if they bring nothing.
    pub fn early_n_s(&self, heading_deg: f64, places: &[Place]) -> f64 {
        let along = direction(heading_deg);
        let shrink = |from: Vector2<f64>, to: &Place| {
            let [still_s, s_per_m] = to.time_s;
            (-self.omega * (still_s + s_per_m * (to.at - from).norm())).exp()
        };
        let after = |left: &Place, to: &Place| shrink(Vector2::new(-left.at.x, left.at.y), to);
        let home = Vector2::new(0.0, self.stance_width_m);
        let mut best = self.both_soles().leaves_at(along);
        for (first, second) in places
            .iter()
            .flat_map(|a| places.iter().map(move |b| (a, b)))
        {
            let shrinks = [after(second, first), after(first, second)];
            for stance in [1.0, -1.0] {
                let (mut set, mut weight) = (self.sole(stance), shrink(home, first));
                for k in 0..MOST_STEPS {
                    let foot = k % 2;
                    let (place, side) = ([first, second][foot], [-stance, stance][foot]);
                    let at = Vector2::new(place.at.x, side * place.at.y);
                    set = set.plus(Span { low: at, high: at }, weight);
                    let held = set.plus(self.gain_of_both(), weight);
                    best = best.max(held.leaves_at(along));
                    weight *= shrinks[1 - foot];
                }
            }
        }
        self.mass_kg * self.omega * best
    }

    /// The sole of the left foot (1) or the right one (-1), seen from the COM.
    fn sole(&self, foot: f64) -> Span {
        let center = Vector2::new(0.0, 0.5 * foot * self.stance_width_m) - self.com.coords;
        Span::new(
            self.sole_x_m.map(|x| x + center.x),
            self.sole_y_m.map(|y| y + center.y),
        )
    }

    /// The hull of both soles, as far as both ankles hold it, seen from the COM.
    fn both_soles(&self) -> Span {
        Span {
            low: self.sole(-1.0).low,
            high: self.sole(1.0).high,
        }
        .plus(self.gain_of_both(), 1.0)
    }

    /// How much farther two ankles hold the ZMP than one: D - B.
    fn gain_of_both(&self) -> Span {
        let gain = |[both, one]: [[f64; 2]; 2]| [both[0] - one[0], both[1] - one[1]];
        Span::new(
            gain([self.both_x_m, self.sole_x_m]),
            gain([self.both_y_m, self.sole_y_m]),
        )
    }
}

/// Ratio of the impulse of a push with constant force over this duration (s) to an instantaneous one with the same
/// effect. The effect of a force f(t) is the integral of f e^(-omega t).
pub fn rectangular_push_factor(omega: f64, duration_s: f64) -> f64 {
    let angle = omega * duration_s;
    if angle < 1e-9 {
        1.0
    } else {
        angle / -(-angle).exp_m1()
    }
}

/// The ratio of [`rectangular_push_factor`] for a force that is half a period of a sine.
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
