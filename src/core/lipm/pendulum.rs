//! The COG-ZMP inverted pendulum (paper, Sect. II and III.A): its state, its exact discretisation, and its feedback.
//!
//! Each horizontal axis obeys `com_acc = omega^2 (com - zmp)` (eq. 1, 2), with the velocity of the ZMP as input (eq.
//! 6). The axes are not coupled (eq. 8 and 9 are block diagonal), so functions are for one axis; [`State`] has both.
//!
//! Discretisation and pole placement are written in the modes of the pendulum, in which they have closed forms:
//!
//! | mode | meaning | eigenvalue | input |
//! |---|---|---|---|
//! | com + com_vel/omega - zmp | divergent | e^(omega dt) | -(e^(omega dt) - 1)/omega |
//! | com - com_vel/omega - zmp | convergent | e^(-omega dt) | -(1 - e^(-omega dt))/omega |
//! | zmp | | 1 | dt |

use nalgebra::{Matrix3, Point2, RowVector3, Vector2, Vector3, Vector6};

/// A pendulum of constant height, sampled at every control period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendulum {
    /// Natural frequency, sqrt(g / height) (rad/s).
    pub omega: f64,
    /// Control period (s).
    pub dt: f64,
}

/// State of eq. 5. Each axis is [com, com_vel, zmp] in (m, m/s, m), control frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    pub x: Vector3<f64>,
    pub y: Vector3<f64>,
}

impl State {
    pub fn new(com: Point2<f64>, com_vel: Vector2<f64>, zmp: Point2<f64>) -> Self {
        Self {
            x: Vector3::new(com.x, com_vel.x, zmp.x),
            y: Vector3::new(com.y, com_vel.y, zmp.y),
        }
    }

    pub fn com(&self) -> Point2<f64> {
        Point2::new(self.x[0], self.y[0])
    }

    pub fn com_vel(&self) -> Vector2<f64> {
        Vector2::new(self.x[1], self.y[1])
    }

    pub fn zmp(&self) -> Point2<f64> {
        Point2::new(self.x[2], self.y[2])
    }

    /// The state as one vector in the order of eq. 5.
    pub fn stacked(&self) -> Vector6<f64> {
        Vector6::new(
            self.x[0], self.x[1], self.x[2], self.y[0], self.y[1], self.y[2],
        )
    }

    /// The inverse of [`Self::stacked`].
    pub fn from_stacked(v: &Vector6<f64>) -> Self {
        Self {
            x: Vector3::new(v[0], v[1], v[2]),
            y: Vector3::new(v[3], v[4], v[5]),
        }
    }
}

impl Pendulum {
    /// Control period in 1/omega.
    pub fn phase(&self) -> f64 {
        self.omega * self.dt
    }

    /// Transition of one axis over a period with a constant ZMP: a diagonal block of A in eq. 10.
    pub fn transition(&self) -> Matrix3<f64> {
        let (sinh, cosh) = ((self.omega * self.dt).sinh(), (self.omega * self.dt).cosh());
        Matrix3::new(
            cosh,
            sinh / self.omega,
            1.0 - cosh,
            self.omega * sinh,
            cosh,
            -self.omega * sinh,
            0.0,
            0.0,
            1.0,
        )
    }

    /// Effect of a unit velocity of the ZMP (m/s) over a period (zero-order hold): a column block of B in eq. 10.
    pub fn input(&self) -> Vector3<f64> {
        let x = self.omega * self.dt;
        let half = (0.5 * x).sinh();
        Vector3::new((x - x.sinh()) / self.omega, -2.0 * half * half, self.dt)
    }

    /// Effect of a unit [disturbance](super::disturbance) of the ZMP (m) that is constant over a period. The
    /// disturbance acts on the COM as the ZMP does.
    pub fn disturbance(&self) -> Vector3<f64> {
        let of_zmp = self.transition().column(2).into_owned();
        Vector3::new(of_zmp[0], of_zmp[1], 0.0)
    }

    /// One axis after a period with ZMP velocity `rate` (m/s) (eq. 10).
    pub fn step(&self, axis: &Vector3<f64>, rate: f64) -> Vector3<f64> {
        self.transition() * axis + self.input() * rate
    }

    /// Acceleration of the COM (m/s^2) (eq. 1, 2).
    pub fn com_acc(&self, com: Point2<f64>, zmp: Point2<f64>) -> Vector2<f64> {
        (com - zmp) * (self.omega * self.omega)
    }

    /// The COM (m) after `time_s` (s) with a constant ZMP.
    pub fn com_in(
        &self,
        time_s: f64,
        com: Point2<f64>,
        com_vel: Vector2<f64>,
        zmp: Point2<f64>,
    ) -> Point2<f64> {
        let angle = self.omega * time_s;
        zmp + (com - zmp) * angle.cosh() + com_vel * (angle.sinh() / self.omega)
    }

    /// The discrete pole of the continuous pole `-pole * omega`.
    pub fn discrete_pole(&self, pole: f64) -> f64 {
        (-pole * self.omega * self.dt).exp()
    }

    /// Feedback vector f of one axis (eq. 11, 12: rate = -f . [com, com_vel, zmp]) that places the poles of the closed
    /// loop at `-poles[i] * omega` (continuous time; in discrete time at their exponentials). Poles may repeat.
    ///
    /// Pole placement in diagonal form: `f_j = prod_i (l_j - z_i) / (b_j prod_{k != j} (l_j - l_k))` with eigenvalues
    /// l, inputs b and desired poles z. With a pole at exactly 1 (that is, -omega) the convergent mode's feedback is
    /// exactly zero.
    pub fn feedback(&self, poles: [f64; 3]) -> Vector3<f64> {
        let x = self.omega * self.dt;
        // Eigenvalue j is exp(exponent * x). The row maps [com, com_vel, zmp] to the mode.
        let modes = [
            (
                1.0,
                -x.exp_m1() / self.omega,
                RowVector3::new(1.0, 1.0 / self.omega, -1.0),
            ),
            (
                -1.0,
                (-x).exp_m1() / self.omega,
                RowVector3::new(1.0, -1.0 / self.omega, -1.0),
            ),
            (0.0, self.dt, RowVector3::new(0.0, 0.0, 1.0)),
        ];
        // exp(a x) - exp(b x) without cancellation.
        let difference = |a: f64, b: f64| (b * x).exp() * ((a - b) * x).exp_m1();
        let mut feedback = RowVector3::zeros();
        for (j, (exponent, input, row)) in modes.iter().enumerate() {
            let wanted: f64 = poles.iter().map(|p| difference(*exponent, -p)).product();
            let others: f64 = modes
                .iter()
                .enumerate()
                .filter(|(k, _)| *k != j)
                .map(|(_, m)| difference(*exponent, m.0))
                .product();
            feedback += row * (wanted / (input * others));
        }
        feedback.transpose()
    }

    /// Closed loop of one axis, a diagonal block of A - B F (eq. 13).
    pub fn closed(&self, feedback: &Vector3<f64>) -> Matrix3<f64> {
        self.transition() - self.input() * feedback.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{PENDULUM, integrated};
    use super::*;

    #[test]
    fn the_discretisation_is_the_solution_of_the_equations_of_motion() {
        // Eq. 1 with a ramp of the ZMP, over 10 ms.
        let p = Pendulum {
            omega: 5.8,
            dt: 0.01,
        };
        let (start, rate) = (Vector3::new(0.01, -0.2, 0.03), 0.7);
        let s = integrated(
            |_, s| Vector3::new(s[1], p.omega * p.omega * (s[0] - s[2]), rate),
            start,
            p.dt,
        );
        assert!((p.step(&start, rate) - s).norm() < 1e-12);
    }

    #[test]
    fn the_closed_loop_has_the_poles_that_were_asked_for() {
        for poles in [
            [0.15, 1.0, 5.0],
            [1.0, 1.0, 1.0],
            [0.5, 1.0, 1.0],
            [2.0, 3.0, 20.0],
        ] {
            let closed = PENDULUM.closed(&PENDULUM.feedback(poles));
            let z = poles.map(|p| PENDULUM.discrete_pole(p));
            let minors = closed.trace().powi(2) - (closed * closed).trace();
            assert!((closed.trace() - z.iter().sum::<f64>()).abs() < 1e-12);
            assert!((minors / 2.0 - (z[0] * z[1] + z[1] * z[2] + z[2] * z[0])).abs() < 1e-12);
            assert!((closed.determinant() - z[0] * z[1] * z[2]).abs() < 1e-12);
        }
    }
}
