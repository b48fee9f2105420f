//! One footstep of the pendulum by relaxed boundary conditions (paper, Sect. V.A, after its reference \[12\]).
//!
//! While the foot is in the air the ZMP goes from z0 to z1 and the COM follows eq. 1; for each axis
//!
//! ```text
//! zmp(t) = z1 + (z0 - z1) e^(-lambda t)
//! dcm(t) = (dcm(0) - z1 - g (z0 - z1)) e^( omega t) + z1 + g (z0 - z1) e^(-lambda t),   g = omega / (omega + lambda)
//! ccm(t) = (ccm(0) - z1 - h (z0 - z1)) e^(-omega t) + z1 + h (z0 - z1) e^(-lambda t),   h = omega / (omega - lambda)
//! ```
//!
//! with dcm = com + com_vel / omega and ccm = com - com_vel / omega. The wanted state at landing is the COM at rest over
//! the middle of the feet to be: dcm = com = target. It is linear in (z0, z1); but these must lie inside the stance
//! sole, so that it cannot be met in general and becomes the objective of a least-squares problem:
//!
//! ```text
//! min over z0, z1 in [lo, hi] of  w_dcm (dcm(T) - target)^2 + w_com (com(T) - target)^2
//!                               + w_zmp ((z0 - middle)^2 + (z1 - middle)^2)
//! ```
//!
//! Two variables in a box: solved in closed form, face by face.

use super::stepping::{RelaxationWeights, Stepping};
use nalgebra::{Matrix2, RowVector2, Vector2};

/// One axis of a planned footstep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisPlan {
    omega: f64,
    /// (1/s)
    lambda: f64,
    /// First and last ZMP (m).
    pub z: [f64; 2],
    dcm: f64,
    ccm: f64,
}

/// What one axis of a footstep starts from and aims at (m, m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Boundary {
    pub com: f64,
    pub com_vel: f64,
    /// Wanted COM at landing.
    pub target: f64,
    /// Where the ZMP may be.
    pub zmp: [f64; 2],
}

impl AxisPlan {
    /// The best (z0, z1). `zmp[0] <= zmp[1]`.
    pub fn new(omega: f64, rules: &Stepping, boundary: &Boundary) -> Self {
        let Boundary { com, com_vel, target, zmp: [least, most] } = *boundary;
        let mut plan = Self {
            omega,
            lambda: rules.lambda * omega,
            z: [0.0; 2],
            dcm: com + com_vel / omega,
            ccm: com - com_vel / omega,
        };
        let time = rules.swing_time_s;
        // DCM and COM at landing are affine in z.
        let at = |z: [f64; 2]| {
            let [com, com_vel] = Self { z, ..plan }.com(time);
            Vector2::new(com + com_vel / omega, com)
        };
        let free = at([0.0; 2]);
        let by_z = [at([1.0, 0.0]) - free, at([0.0, 1.0]) - free];
        let rows = [RowVector2::new(by_z[0][0], by_z[1][0]), RowVector2::new(by_z[0][1], by_z[1][1])];
        let RelaxationWeights { dcm, com, zmp } = rules.weights;
        let middle = 0.5 * (least + most);
        let hessian = dcm * rows[0].transpose() * rows[0]
            + com * rows[1].transpose() * rows[1]
            + Matrix2::from_diagonal_element(zmp);
        let linear = rows[0].transpose() * (dcm * (target - free[0]))
            + rows[1].transpose() * (com * (target - free[1]))
            + Vector2::repeat(zmp * middle);
        plan.z = in_box(&hessian, &linear, [least, most]).into();
        plan
    }

    /// ZMP at a time after the lift (m).
    pub fn zmp(&self, time_s: f64) -> f64 {
        self.z[1] + (self.z[0] - self.z[1]) * (-self.lambda * time_s).exp()
    }

    /// COM (m) and its velocity (m/s) at a time after the lift.
    pub fn com(&self, time_s: f64) -> [f64; 2] {
        let (w, lambda, [z0, z1]) = (self.omega, self.lambda, self.z);
        let mode = |start: f64, rate: f64, share: f64| {
            let moving = share * (z0 - z1);
            (start - z1 - moving) * (rate * time_s).exp() + z1 + moving * (-lambda * time_s).exp()
        };
        let dcm = mode(self.dcm, w, w / (w + lambda));
        let ccm = mode(self.ccm, -w, w / (w - lambda));
        [0.5 * (dcm + ccm), 0.5 * (dcm - ccm) * w]
    }
}

/// `min 1/2 x' H x - b' x` over the square `[least, most]^2`, H positive definite: the best of the candidates on the
/// inside, the four edges and the four corners.
fn in_box(hessian: &Matrix2<f64>, linear: &Vector2<f64>, [least, most]: [f64; 2]) -> Vector2<f64> {
    let cost = |x: &Vector2<f64>| 0.5 * x.dot(&(hessian * x)) - linear.dot(x);
    if let Some(free) = hessian.cholesky().map(|factor| factor.solve(linear))
        && free.iter().all(|v| (least..=most).contains(v))
    {
        return free;
    }
    // The best point of each edge, corners included; one of these is the answer.
    let mut best = Vector2::repeat(least);
    for held in [0, 1] {
        let other = 1 - held;
        for value in [least, most] {
            let mut x = Vector2::repeat(value);
            let along = (linear[other] - hessian[(other, held)] * value) / hessian[(other, other)];
            x[other] = along.clamp(least, most);
            if cost(&x) < cost(&best) {
                best = x;
            }
        }
    }
    best
}
