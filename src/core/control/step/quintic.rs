//! Minimum-jerk motion along one axis, from any state to rest at a given place and time.
//!
//! With s the time left, the distance from the end is `c3 s^3 + c4 s^4 + c5 s^5`. The distance, its rate and its
//! acceleration are zero at s = 0, and the coefficients c3, c4, c5 follow from the state at the start.

/// The motion along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Quintic {
    end: f64,
    end_s: f64,
    c: [f64; 3],
}

impl Quintic {
    /// From position, velocity and acceleration (m, m/s, m/s^2) at `start_s` to rest at `end` (m) at the later `end_s`.
    pub fn new([place, vel, acc]: [f64; 3], end: f64, start_s: f64, end_s: f64) -> Self {
        let s = end_s - start_s;
        // Derivatives with respect to the time left.
        let (y, v, a) = (place - end, -vel, acc);
        let c3 = (10.0 * y - 4.0 * v * s + 0.5 * a * s * s) / s.powi(3);
        let c4 = (-15.0 * y + 7.0 * v * s - a * s * s) / s.powi(4);
        let c5 = (6.0 * y - 3.0 * v * s + 0.5 * a * s * s) / s.powi(5);
        Self {
            end,
            end_s,
            c: [c3, c4, c5],
        }
    }

    /// Position, velocity and acceleration at `time_s`; at rest after the end.
    pub fn at(&self, time_s: f64) -> [f64; 3] {
        let s = (self.end_s - time_s).max(0.0);
        let [c3, c4, c5] = self.c;
        [
            self.end + s * s * s * (c3 + s * (c4 + s * c5)),
            -s * s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)),
            s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_starts_in_the_state_given_and_ends_at_rest() {
        let state = [0.1, -0.7, 3.0];
        let axis = Quintic::new(state, 0.25, 1.0, 1.15);
        for (is, wanted) in axis.at(1.0).iter().zip(state) {
            assert!((is - wanted).abs() < 1e-9, "{:?}", axis.at(1.0));
        }
        for late in [1.15, 1.2] {
            assert_eq!(
                axis.at(late),
                [0.25, 0.0, 0.0].map(|v: f64| v + 0.0),
                "{late}"
            );
        }
    }

    #[test]
    fn velocity_and_acceleration_are_the_slopes() {
        let axis = Quintic::new([0.1, -0.7, 3.0], 0.25, 1.0, 1.15);
        for k in 1..14 {
            let (t, h) = (1.0 + 0.01 * f64::from(k), 1e-5);
            let [before, now, after] = [t - h, t, t + h].map(|t| axis.at(t));
            for d in 0..2 {
                let slope = (after[d] - before[d]) / (2.0 * h);
                assert!((slope - now[d + 1]).abs() < 1e-4, "{t}: {slope} {now:?}");
            }
        }
    }
}
