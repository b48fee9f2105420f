//! Pendulum bounds: the largest impulse from which an ideal pendulum with these feet can recover without a footstep,
//! with one, and with any number (Koolen et al. 2012, "Capturability-based analysis and control of legged locomotion").
//!
//! An instantaneous impulse J shifts the divergent component of motion (dcm) by J/(m omega), with mass m and natural
//! frequency omega, from the COM's position at home. The robot can recover if the dcm then lies in a certain set:
//! - **No step**: the hull of both soles.
//! - **One step**: let the robot stand on the sole s + B (centre s, shape B) with its ZMP at p in s + B. (The ZMP may
//!   move; what counts is a mean, which stays in the convex s + B.) After the time T of the step, the dcm is at
//!   `p + e^(omega T) (dcm - p)`. The robot recovers if this lies in the hull of the stance sole and the sole that
//!   lands at s + r, with r in the reach R: in `s + conv({0} u R) + B`. With q = e^(-omega T), and because (1 - q) B +
//!   q B = B, the set for the dcm is `s + B + q conv({0} u R)`.
//! - **N steps**: at T the dcm need only be where the sole at s + r can recover with N - 1 more steps:
//!   `C_N = (1 - q) B + q (R + C'_(N-1))`, where the prime is the mirrored reach of the other foot. Expanded,
//!   `C_N = B + q R + q^2 R' + ... + q^N conv({0} u R'..')`. In one dimension, d_N = (l - r + d_(N-1)) q + r.
//!
//! For each stance foot, the largest J along a heading with the dcm in such a set is one linear program.
//!
//! The bounds are a yardstick and not a ceiling: the height is constant, there is no angular momentum, and the ZMP
//! jumps at once. With trunk and arms, or by rocking on an edge, a robot can take more; delay and joint limits leave
//! less.

use crate::error::Result;
use crate::geometry::{LinearProgram, SupportPolygon};
use nalgebra::{Point2, Vector2};
use std::f64::consts::PI;

/// "Any number" of footsteps is reached when two more raise the bound by less than this share.
pub const NO_MORE: f64 = 1e-4;
/// Largest number of footsteps that is tried.
pub const MOST_STEPS: usize = 40;

/// Where a foot can land: offsets from the centre of the stance sole to that of the landing one, in the axes of the
/// control frame. They form a box on the side of the swing foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandingBox {
    /// Largest offset forward or backward (m).
    pub forward_m: f64,
    /// Largest offset to the side (m).
    pub outward_m: f64,
    /// Smallest offset to the side, at which the legs do not cross (m).
    pub inward_m: f64,
}

/// A pendulum on two soles side by side. Both are parallel to x, and the origin is midway between their centres.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    pub reach: LandingBox,
    /// Time from the impulse to the landing, and between landings (s).
    pub step_time_s: f64,
}

/// Largest instantaneous impulses along one heading (N s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub no_step_n_s: f64,
    /// With at most one footstep; not less than without.
    pub one_step_n_s: f64,
    /// With any number of footsteps.
    pub n_step_n_s: f64,
    /// Number of footsteps from which on more raise the bound by less than [`NO_MORE`].
    pub steps: usize,
}

impl SteppingPendulum {
    /// The bounds for a heading (degrees; 0 is forward, 90 to the left). Fails if the solver gives up.
    pub fn bounds(&self, heading_deg: f64) -> Result<Bounds> {
        let no_step_n_s = self.no_step_n_s(heading_deg);
        let one_step_n_s = no_step_n_s.max(self.exactly_n_s(heading_deg, 1)?);
        // The feet take turns, so the bound may rise with every other footstep only.
        let (mut before, mut now, mut steps) = (no_step_n_s, one_step_n_s, 1);
        while steps < MOST_STEPS {
            let next = now.max(self.exactly_n_s(heading_deg, steps + 1)?);
            if next <= before * (1.0 + NO_MORE) {
                break;
            }
            (before, now, steps) = (now, next, steps + 1);
        }
        Ok(Bounds { no_step_n_s, one_step_n_s, n_step_n_s: now, steps })
    }

    /// The bound without a footstep (N s): m omega d, with d from the COM to the edge of the soles' hull; 0 if the COM
    /// is outside.
    pub fn no_step_n_s(&self, heading_deg: f64) -> f64 {
        let ([x0, x1], [y0, y1], side) = (self.sole_x_m, self.sole_y_m, self.stance_width_m / 2.0);
        let corner = |x, y| Point2::new(x, y);
        let corners =
            [-side, side].map(|s| [corner(x0, s + y0), corner(x1, s + y0), corner(x1, s + y1), corner(x0, s + y1)]);
        let hull = SupportPolygon::hull(corners.as_flattened()).filter(|hull| hull.contains(self.com));
        let d = hull.and_then(|hull| hull.distance_along(self.com, direction(heading_deg)));
        self.mass_kg * self.omega * d.unwrap_or(0.0)
    }

    /// The bound with exactly `steps` footsteps (N s), one or more, with the better foot as the first stance foot. The
    /// last footstep may turn out not to be needed. It is 0 if these footsteps recover from no impulse in this heading.
    /// Fails if the solver gives up.
    pub fn exactly_n_s(&self, heading_deg: f64, steps: usize) -> Result<f64> {
        let mut best: f64 = 0.0;
        // The y coordinate of the stance sole in units of half the stance width: left foot, right foot.
        for stance in [1.0, -1.0] {
            best = best.max(self.on_stance_n_s(direction(heading_deg), steps, stance)?);
        }
        Ok(best)
    }

    /// The unknowns are the shift of the dcm along the heading, a point of B, a landing place for each footstep, and
    /// the share t of the last one (conv({0} u R) = {(g, t): g in t R, 0 <= t <= 1}).
    fn on_stance_n_s(&self, along: Vector2<f64>, steps: usize, stance: f64) -> Result<f64> {
        let unknowns = 1 + 2 + 2 * steps + 1;
        let (way, sole, landing, share) = (0, 1, |k: usize| 3 + 2 * k, unknowns - 1);
        let row = |terms: &[(usize, f64)]| {
            let mut row = vec![0.0; unknowns];
            terms.iter().for_each(|&(at, value)| row[at] = value);
            row
        };
        let mut program = LinearProgram::maximise(row(&[(way, 1.0)]));
        let from_sole = self.com - Point2::new(0.0, stance * self.stance_width_m / 2.0);
        for axis in 0..2 {
            let mut terms = vec![(way, along[axis]), (sole + axis, -1.0)];
            terms.extend((0..steps).map(|k| (landing(k) + axis, -self.shrink(k + 1))));
            program.equal.push((row(&terms), -from_sole[axis]));
        }
        program.between(row(&[(sole, 1.0)]), self.sole_x_m[0], self.sole_x_m[1]);
        program.between(row(&[(sole + 1, 1.0)]), self.sole_y_m[0], self.sole_y_m[1]);
        let LandingBox { forward_m, outward_m, inward_m } = self.reach;
        let mut side = -stance;
        for k in 0..steps {
            let (x, y) = (landing(k), landing(k) + 1);
            if k + 1 < steps {
                program.between(row(&[(x, 1.0)]), -forward_m, forward_m);
                program.between(row(&[(y, side)]), inward_m, outward_m);
            } else {
                for (terms, most) in [
                    ([(x, 1.0), (share, -forward_m)], 0.0),
                    ([(x, -1.0), (share, -forward_m)], 0.0),
                    ([(y, side), (share, -outward_m)], 0.0),
                    ([(y, -side), (share, inward_m)], 0.0),
                ] {
                    program.at_most.push((row(&terms), most));
                }
                program.between(row(&[(share, 1.0)]), 0.0, 1.0);
            }
            side = -side;
        }
        let found = program.solve()?;
        Ok(found.map_or(0.0, |(dcm_m, _)| self.mass_kg * self.omega * dcm_m))
    }

    /// The factor q^k by which k footsteps shrink a distance.
    fn shrink(&self, footsteps: usize) -> f64 {
        (-self.omega * self.step_time_s * footsteps as f64).exp()
    }
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
