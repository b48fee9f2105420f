//! One footstep of the pendulum with relaxed boundary conditions (paper, Sect. V.A, after its reference \[12\]).
//!
//! While the foot is in the air, the ZMP goes from z0 to z1 and the COM follows eq. 1. For each axis
//!
//! ```text
//! zmp(t) = z1 + (z0 - z1) e^(-lambda t)
//! dcm(t) = (dcm(0) - z1 - g (z0 - z1)) e^( omega t) + z1 + g (z0 - z1) e^(-lambda t),   g = omega / (omega + lambda)
//! ccm(t) = (ccm(0) - z1 - h (z0 - z1)) e^(-omega t) + z1 + h (z0 - z1) e^(-lambda t),   h = omega / (omega - lambda)
//! ```
//!
//! with dcm = com + com_vel / omega and ccm = com - com_vel / omega. At landing the COM is to rest over the middle of
//! the new stance: dcm = com = target. This condition is linear in (z0, z1). Since z0 and z1 must lie inside the stance
//! sole, the condition cannot be met in general, and becomes the objective of a least-squares problem:
//!
//! ```text
//! min over z0, z1 in [lo, hi] of  w_dcm (dcm(T) - target)^2 + w_com (com(T) - target)^2
//!                               + w_zmp ((z0 - middle)^2 + (z1 - middle)^2)
//! ```
//!
//! The problem has two variables in a box, and is solved in closed form, face by face.

use super::stepping::{RelaxationWeights, Stepping};
use nalgebra::{Matrix2, RowVector2, Vector2};

/// One axis of a planned footstep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisPlan {
    omega: f64,
    /// Rate at which the ZMP goes from z0 to z1 (1/s).
    lambda: f64,
    /// First and last ZMP, z0 and z1 (m).
    pub z: [f64; 2],
    dcm: f64,
    ccm: f64,
}

/// Start and aim of one axis of a footstep (m, m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Boundary {
    pub com: f64,
    pub com_vel: f64,
    /// Desired COM at landing.
    pub target: f64,
    /// Smallest and largest allowed ZMP.
    pub zmp: [f64; 2],
}

impl AxisPlan {
    /// Finds the best (z0, z1). `zmp[0] <= zmp[1]` is required.
    pub fn new(omega: f64, rules: &Stepping, boundary: &Boundary) -> Self {
        let Boundary {
            com,
            com_vel,
            target,
            zmp: [least, most],
        } = *boundary;
        let mut plan = Self {
            omega,
            lambda: rules.lambda * omega,
            z: [0.0; 2],
            dcm: com + com_vel / omega,
            ccm: com - com_vel / omega,
        };
        let time = rules.swing_time_s;
        // DCM and COM at landing are linear in the initial state and in z.
        let landing = |plan: Self| {
            let [com, com_vel] = plan.com(time);
            Vector2::new(com + com_vel / omega, com)
        };
        let free = landing(plan);
        let by_z = [[1.0, 0.0], [0.0, 1.0]].map(|z| {
            landing(Self {
                z,
                dcm: 0.0,
                ccm: 0.0,
                ..plan
            })
        });
        let rows = [
            RowVector2::new(by_z[0][0], by_z[1][0]),
            RowVector2::new(by_z[0][1], by_z[1][1]),
        ];
        let RelaxationWeights { dcm, com, zmp } = rules.weights;
        let middle = 0.5 * (least + most);
        let hessian = dcm * rows[0].transpose() * rows[0]
            + com * rows[1].transpose() * rows[1]
            + Matrix2::from_diagonal_element(zmp);
        let linear = rows[0].transpose() * (dcm * (target - free[0]))
            + rows[1].transpose() * (com * (target - free[1]))
            + Vector2::repeat(zmp * middle);
        plan.z = in_box(&hessian, &linear, [[least, most]; 2]).into();
        plan
    }

    /// ZMP (m) at `time_s` (s) after the lift.
    pub fn zmp(&self, time_s: f64) -> f64 {
        self.z[1] + (self.z[0] - self.z[1]) * (-self.lambda * time_s).exp()
    }

    /// COM (m) and COM velocity (m/s) at `time_s` (s) after the lift.
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

/// `min 1/2 x' H x - b' x` over the box `[least, most]` of each variable, with H positive definite: the best of the
/// candidates in the interior, on the four edges and at the four corners.
pub(super) fn in_box(
    hessian: &Matrix2<f64>,
    linear: &Vector2<f64>,
    within: [[f64; 2]; 2],
) -> Vector2<f64> {
    let cost = |x: &Vector2<f64>| 0.5 * x.dot(&(hessian * x)) - linear.dot(x);
    if let Some(free) = hessian.cholesky().map(|factor| factor.solve(linear))
        && free
            .iter()
            .zip(within)
            .all(|(v, [least, most])| (least..=most).contains(v))
    {
        return free;
    }
    // The best point of each edge, including its corners. The best of these points is the solution.
    let mut best = within.map(|[least, _]| least).into();
    for held in [0, 1] {
        let other = 1 - held;
        for value in within[held] {
            let mut x = Vector2::repeat(value);
            let along = (linear[other] - hessian[(other, held)] * value) / hessian[(other, other)];
            x[other] = along.clamp(within[other][0], within[other][1]);
            if cost(&x) < cost(&best) {
                best = x;
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::super::testing::{self, cases};
    use super::*;
    use proptest::prelude::*;

    const OMEGA: f64 = 5.63;

    fn any_rules() -> impl Strategy<Value = Stepping> {
        let lambda = prop_oneof![0.2..0.9f64, 1.1..10.0f64];
        (lambda, 0.1..0.4f64, 0.1..10.0f64, 0.0..1.0f64, -4.0..0.0f64).prop_map(
            |(lambda, swing_time_s, dcm, com, zmp_exponent)| {
                let weights = RelaxationWeights {
                    dcm,
                    com,
                    zmp: 10_f64.powf(zmp_exponent),
                };
                Stepping {
                    swing_time_s,
                    lambda,
                    weights,
                    ..Stepping::EXAMPLE
                }
            },
        )
    }

    /// States and strides that follow a push of a few N s, with a stance sole that need not be centred.
    fn any_boundary() -> impl Strategy<Value = Boundary> {
        (
            -0.1..0.1f64,
            -0.8..0.8f64,
            -0.15..0.15f64,
            -0.05..0.02f64,
            0.0..0.1f64,
        )
            .prop_map(|(com, com_vel, target, least, width)| Boundary {
                com,
                com_vel,
                target,
                zmp: [least, least + width],
            })
    }

    /// COM and COM velocity by eq. 1 with the planned ZMP.
    fn integrated(plan: &AxisPlan, boundary: &Boundary, until_s: f64) -> [f64; 2] {
        testing::integrated(
            |time, x| Vector2::new(x[1], OMEGA * OMEGA * (x[0] - plan.zmp(time))),
            Vector2::new(boundary.com, boundary.com_vel),
            until_s,
        )
        .into()
    }

    /// The objective at (z0, z1), computed only from the COM that eq. 1 leads to.
    fn objective(plan: &AxisPlan, rules: &Stepping, boundary: &Boundary, z: [f64; 2]) -> f64 {
        let [com, com_vel] = integrated(&AxisPlan { z, ..*plan }, boundary, rules.swing_time_s);
        let middle = 0.5 * (boundary.zmp[0] + boundary.zmp[1]);
        let RelaxationWeights {
            dcm: by_dcm,
            com: by_com,
            zmp: by_zmp,
        } = rules.weights;
        by_dcm * (com + com_vel / OMEGA - boundary.target).powi(2)
            + by_com * (com - boundary.target).powi(2)
            + by_zmp * ((z[0] - middle).powi(2) + (z[1] - middle).powi(2))
    }

    proptest! {
        #![proptest_config(cases(3, 256))]

        #[test]
        fn the_com_falls_as_eq_1_says(rules in any_rules(), boundary in any_boundary(), share in 0.0..1.5f64) {
            let plan = AxisPlan::new(OMEGA, &rules, &boundary);
            let time = share * rules.swing_time_s;
            let (wanted, planned) = (integrated(&plan, &boundary, time), plan.com(time));
            prop_assert!((planned[0] - wanted[0]).abs() < 1e-8, "{planned:?} {wanted:?}");
            prop_assert!((planned[1] - wanted[1]).abs() < 1e-7, "{planned:?} {wanted:?}");
        }

        /// The objective is convex, so it is enough that no point near the plan is better.
        #[test]
        fn no_place_in_the_sole_is_better(rules in any_rules(), boundary in any_boundary()) {
            let plan = AxisPlan::new(OMEGA, &rules, &boundary);
            let [least, most] = boundary.zmp;
            prop_assert!(plan.z.iter().all(|z| (least..=most).contains(z)), "{:?}", plan.z);
            let cost = |z| objective(&plan, &rules, &boundary, z);
            let best = cost(plan.z);
            for way in 0..16 {
                let (sin, cos) = (way as f64 * std::f64::consts::PI / 8.0).sin_cos();
                for step in [1e-3, 0.02] {
                    let other = [plan.z[0] + step * cos, plan.z[1] + step * sin].map(|z| z.clamp(least, most));
                    prop_assert!(best <= cost(other) + 1e-12 * (1.0 + best), "{:?}: {best}, {other:?}: {}", plan.z, cost(other));
                }
            }
        }

        /// Left and right are mirror images to the bit, so that equal strides stay equal.
        #[test]
        fn mirrored_boundaries_have_mirrored_plans(rules in any_rules(), boundary in any_boundary(), time in 0.0..0.4f64) {
            let Boundary { com, com_vel, target, zmp: [least, most] } = boundary;
            let mirrored = Boundary { com: -com, com_vel: -com_vel, target: -target, zmp: [-most, -least] };
            let (plan, other) = [&boundary, &mirrored].map(|b| AxisPlan::new(OMEGA, &rules, b)).into();
            prop_assert_eq!(plan.z, other.z.map(|z| -z));
            prop_assert_eq!(plan.com(time), other.com(time).map(|v| -v));
            prop_assert_eq!(plan.zmp(time), -other.zmp(time));
        }
    }

    #[test]
    fn the_zmp_starts_at_z0_and_tends_to_z1() {
        let rules = Stepping::EXAMPLE;
        let plan = AxisPlan::new(
            OMEGA,
            &rules,
            &Boundary {
                com: 0.0,
                com_vel: 0.3,
                target: 0.05,
                zmp: [-9.0, 9.0],
            },
        );
        let left = |time: f64| (plan.zmp(time) - plan.z[1]) / (plan.z[0] - plan.z[1]);
        // After one time constant, 1/e of the distance is left.
        for (time, expected) in [
            (0.0, 1.0),
            (1.0 / (rules.lambda * OMEGA), (-1.0_f64).exp()),
            (9.0, 0.0),
        ] {
            assert!(
                (left(time) - expected).abs() < 1e-12,
                "{time}: {}",
                left(time)
            );
        }
    }
}
