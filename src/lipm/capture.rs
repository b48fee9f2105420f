//! Pendulum bounds: the largest impulse that an ideal pendulum on these feet can take, without a footstep, with one,
//! with any number (Koolen et al. 2012, "Capturability-based analysis and control of legged locomotion").
//!
//! An instantaneous impulse J moves the divergent component of motion (dcm) by J/(m omega) from where the COM is at
//! home. What it can be brought back from:
//! - **No step**: it lies inside the hull of both soles.
//! - **One step**: standing on the sole s + B (centre s, shape B) with the ZMP at p, after the step's time T it is at
//!   `p + e^(omega T) (dcm - p)`; p is anywhere in s + B (it may move: the mean that counts stays in the convex s + B).
//!   That is caught if it lies in the hull of the stance sole and the one that lands at s + r, r in the reach R:
//!   `s + conv({0} u R) + B`. So, with q = e^(-omega T) and because (1 - q) B + q B = B, the dcm can be anywhere in
//!   `s + B + q conv({0} u R)`.
//! - **N steps**: at T it need only be where the sole that has landed at s + r can catch it with N - 1 steps:
//!   `C_N = (1 - q) B + q (R + C'_(N-1))`, the prime for the mirrored reach of the other foot. Written out,
//!   `C_N = B + q R + q^2 R' + ... + q^N conv({0} u R'..')`: in one dimension d_N = (l - r + d_(N-1)) q + r.
//!
//! The largest J along a heading for which the dcm lies in such a set is one linear program for each stance foot.
//!
//! A yardstick, not a ceiling: the height is constant, there is no angular momentum, the ZMP jumps at once. Trunk and
//! arms, or rocking on an edge, can take more; delay and the joints' limits leave less.

use crate::error::Result;
use crate::geometry::{LinearProgram, SupportPolygon};
use nalgebra::{Point2, Vector2};
use std::f64::consts::PI;

/// "Any number" of footsteps ends when two more raise the bound by less than this (relative),
pub const NO_MORE: f64 = 1e-4;
/// or here.
pub const MOST_STEPS: usize = 40;

/// Where a foot can land, seen from the centre of the stance sole (to that of the landing one); axes of the control
/// frame. A box, on the side of the swing foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandingBox {
    /// Fore and aft (m).
    pub forward_m: f64,
    /// Sideways, at most (m),
    pub outward_m: f64,
    /// and at least, so that the legs do not cross (m).
    pub inward_m: f64,
}

/// A pendulum on two soles side by side, both parallel to x, the origin midway between their centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteppingPendulum {
    pub mass_kg: f64,
    /// (rad/s)
    pub omega: f64,
    /// Where the dcm starts: the COM at rest (m).
    pub com: Point2<f64>,
    /// Extent of a sole about its centre: least and most (m).
    pub sole_x_m: [f64; 2],
    pub sole_y_m: [f64; 2],
    /// Between the soles' centres (m).
    pub stance_width_m: f64,
    pub reach: LandingBox,
    /// From the impulse to the landing, and between landings (s).
    pub step_time_s: f64,
}

/// Largest instantaneous impulses along one heading (N s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub no_step_n_s: f64,
    /// With at most one footstep: not less than without.
    pub one_step_n_s: f64,
    /// With any number of footsteps.
    pub n_step_n_s: f64,
    /// Footsteps from which on more bring less than [`NO_MORE`].
    pub steps: usize,
}

impl SteppingPendulum {
    /// All bounds along a heading (degrees; 0 forward, 90 to the left). Errors: the solver gives up.
    pub fn bounds(&self, heading_deg: f64) -> Result<Bounds> {
        let no_step_n_s = self.no_step_n_s(heading_deg);
        let one_step_n_s = no_step_n_s.max(self.exactly_n_s(heading_deg, 1)?);
        // A gain may come with every other footstep only: the feet take turns.
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

    /// Without a footstep (N s): m omega d, with d from the COM to the edge of both soles' hull; 0 if it is not above it.
    pub fn no_step_n_s(&self, heading_deg: f64) -> f64 {
        let ([x0, x1], [y0, y1], side) = (self.sole_x_m, self.sole_y_m, self.stance_width_m / 2.0);
        let corner = |x, y| Point2::new(x, y);
        let corners =
            [-side, side].map(|s| [corner(x0, s + y0), corner(x1, s + y0), corner(x1, s + y1), corner(x0, s + y1)]);
        let hull = SupportPolygon::hull(corners.as_flattened()).filter(|hull| hull.contains(self.com));
        let d = hull.and_then(|hull| hull.distance_along(self.com, direction(heading_deg)));
        self.mass_kg * self.omega * d.unwrap_or(0.0)
    }

    /// With exactly `steps` footsteps (N s), one or more, from the better stance foot; the last may land and not be
    /// needed. 0 if they catch no impulse along this heading. Errors: the solver gives up.
    pub fn exactly_n_s(&self, heading_deg: f64, steps: usize) -> Result<f64> {
        let mut best: f64 = 0.0;
        // y of the stance sole over half the stance's width: the left foot, the right one.
        for stance in [1.0, -1.0] {
            best = best.max(self.on_stance_n_s(direction(heading_deg), steps, stance)?);
        }
        Ok(best)
    }

    /// Unknowns: the dcm's way along the heading, a point of B, a landing for each footstep, and how far the last of
    /// them counts (conv({0} u R) = {(g, t): g in t R, 0 <= t <= 1}).
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

    /// q^k: what is left of a distance, seen from k footsteps before.
    fn shrink(&self, footsteps: usize) -> f64 {
        (-self.omega * self.step_time_s * footsteps as f64).exp()
    }
}

/// How much more impulse than an instantaneous one a push of this duration (s) may have, its force constant: of f(t)
/// counts the integral of f e^(-omega t).
pub fn rectangular_push_factor(omega: f64, duration_s: f64) -> f64 {
    let angle = omega * duration_s;
    if angle < 1e-9 { 1.0 } else { angle / -(-angle).exp_m1() }
}

/// The same for a force that is half a period of a sine.
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
