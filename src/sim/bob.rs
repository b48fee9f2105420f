//! The bob of a pendulum on its rope: how fast it comes, and what its padding does.

use serde::{Deserialize, Serialize};
use standfast_core::robot::GRAVITY;

/// The bob of a pendulum with its rope and its padding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bob {
    pub mass_kg: f64,
    /// Length of the rope, up to the centre of the bob.
    pub rope_m: f64,
    pub radius_m: f64,
    /// Stiffness of the padding.
    pub stiffness_n_m: f64,
    /// Speed at which the bob and what it strikes part, as a share of that at which they meet: more than 0, up to 1.
    pub restitution: f64,
}

impl Bob {
    /// Height (m) from which it falls to the lowest point if it is drawn back horizontally by `draw_m`.
    pub fn fall_m(&self, draw_m: f64) -> f64 {
        self.rope_m - (self.rope_m.powi(2) - draw_m.powi(2)).max(0.0).sqrt()
    }

    /// Speed at the lowest point (m/s).
    pub fn speed_m_s(&self, draw_m: f64) -> f64 {
        (2.0 * GRAVITY * self.fall_m(draw_m)).sqrt()
    }

    /// Momentum with which it strikes (N s), the impulse of its push.
    pub fn momentum_n_s(&self, draw_m: f64) -> f64 {
        self.mass_kg * self.speed_m_s(draw_m)
    }

    /// The drawback from which it strikes with a momentum (N s), at most the rope's length (m).
    pub fn draw_m(&self, momentum_n_s: f64) -> f64 {
        let fall_m = (momentum_n_s / self.mass_kg).powi(2) / (2.0 * GRAVITY);
        let below_m = (self.rope_m - fall_m).max(0.0);
        (self.rope_m.powi(2) - below_m.powi(2)).sqrt()
    }

    /// How long it is in touch with a free body that has no restitution losses (s), a length for plans and bounds.
    pub fn contact_s(&self, struck_kg: f64) -> f64 {
        let reduced_kg = self.mass_kg * struck_kg / (self.mass_kg + struck_kg);
        std::f64::consts::PI * (reduced_kg / self.stiffness_n_m).sqrt()
    }

    /// Damping of the foam (s/m) for which a strike at `speed_m_s` has the restitution e: the product of both, a, is the
    /// positive root of a - ln(1 + a) = -e a - ln(1 - e a), the energy of the law before and after the strike.
    pub(crate) fn damping_s_m(&self, speed_m_s: f64) -> f64 {
        let e = self.restitution;
        let excess = |a: f64| (-e * a - (-e * a).ln_1p()) - (a - a.ln_1p());
        let [mut least, mut most] = [0.0, 1.0 / e];
        for _ in 0..60 {
            let middle = 0.5 * (least + most);
            if excess(middle) < 0.0 {
                least = middle;
            } else {
                most = middle;
            }
        }
        least / speed_m_s.max(1e-9)
    }

    /// Angle of the rope from the vertical at a time before it hangs straight (rad). It does not exceed the angle of release.
    pub(crate) fn angle_rad(&self, momentum_n_s: f64, before_s: f64) -> f64 {
        const STEP_S: f64 = 1e-3;
        let most = (self.draw_m(momentum_n_s) / self.rope_m).asin();
        let (mut angle, mut rate) = (0.0_f64, momentum_n_s / self.mass_kg / self.rope_m);
        for _ in 0..(before_s / STEP_S) as usize {
            rate -= STEP_S * GRAVITY / self.rope_m * angle.sin();
            angle += STEP_S * rate;
            if rate <= 0.0 || angle >= most {
                return most;
            }
        }
        angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bob_swings_as_a_pendulum() {
        let bob = Bob {
            mass_kg: 3.0,
            rope_m: 1.75,
            radius_m: 0.08,
            stiffness_n_m: 9e4,
            restitution: 0.5,
        };
        // It falls by 1.75 - sqrt(1.75^2 - 1) = 0.31386 m.
        assert!((bob.speed_m_s(1.0) - 2.4815).abs() < 1e-3);
        for draw_m in [0.0, 0.01, 1.0, 1.75] {
            assert!((bob.draw_m(bob.momentum_n_s(draw_m)) - draw_m).abs() < 1e-9);
        }
        // From a small drawback it takes a quarter of its period to hang straight.
        let momentum_n_s = bob.momentum_n_s(0.05);
        let quarter_s = 0.5 * std::f64::consts::PI * (bob.rope_m / GRAVITY).sqrt();
        let at_m = |share: f64| bob.rope_m * bob.angle_rad(momentum_n_s, share * quarter_s).sin();
        assert_eq!(at_m(0.0), 0.0);
        assert!(
            (at_m(1.0 / 3.0) - 0.025).abs() < 2e-4,
            "{}",
            at_m(1.0 / 3.0)
        );
        assert!((at_m(0.99) - 0.05).abs() < 1e-4 && (at_m(2.0) - 0.05).abs() < 1e-9);
    }
}
