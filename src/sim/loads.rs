//! What feet and gears of a robot bear. A solver of contacts may put the whole impulse of a landing into one physics
//! step, so that the force in a step depends on the step. Loads are therefore means over [`WINDOW_S`], which slide from
//! step to step. The two engines agree on them: the median force on a sole of the G1 and of UT-mu2 differs by 5 % at most,
//! and by up to 19 % as a mean over 2 ms.

use standfast_core::robot::{Foot, PerFoot, Servo};

/// Time over which a load is a mean (s).
pub const WINDOW_S: f64 = 0.006;

/// The loads of the last physics steps.
#[derive(Debug, Clone)]
pub(super) struct Loads {
    /// The loads of each step of the window: the force on each sole (N), then the torque through each gear (N m). The
    /// oldest step is the next to be replaced.
    steps: Vec<Vec<f64>>,
    oldest: usize,
    /// Speeds of the joints at the end of the last step (rad/s).
    dq: Vec<f64>,
    step_s: f64,
}

/// The largest loads since some time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PeakLoads {
    /// Force of the ground on each sole, along the ground's normal (N).
    pub soles_n: PerFoot<f64>,
    /// Torque through a gear, as a share of the torque limit of its motor: what the motor gives, less what its rotor
    /// takes to change its speed.
    pub gear_ratio: f64,
}

impl Loads {
    pub fn new(joints: usize, step_s: f64) -> Self {
        let steps = (WINDOW_S / step_s).round().max(1.0) as usize;
        Self {
            steps: vec![vec![0.0; 2 + joints]; steps],
            oldest: 0,
            dq: vec![0.0; joints],
            step_s,
        }
    }

    /// Takes the torque of a motor (N m) in the present step, at the end of which its joint has the speed `dq` (rad/s).
    pub fn turn(&mut self, joint: usize, servo: &Servo, tau: f64, dq: f64) {
        let acceleration = (dq - self.dq[joint]) / self.step_s;
        self.steps[self.oldest][2 + joint] = tau - servo.rotor_inertia_kg_m2 * acceleration;
        self.dq[joint] = dq;
    }

    /// Takes the forces on the soles in the present step (N), which ends it. Raises `peaks` to the loads.
    pub fn bear(&mut self, soles_n: PerFoot<f64>, servos: &[Servo], peaks: &mut PeakLoads) {
        for foot in Foot::BOTH {
            self.steps[self.oldest][foot as usize] = soles_n[foot];
        }
        self.oldest = (self.oldest + 1) % self.steps.len();
        let mean = |load: usize| {
            self.steps.iter().map(|step| step[load]).sum::<f64>() / self.steps.len() as f64
        };
        for foot in Foot::BOTH {
            peaks.soles_n[foot] = peaks.soles_n[foot].max(mean(foot as usize));
        }
        for (joint, servo) in servos.iter().enumerate() {
            let ratio = mean(2 + joint).abs() / servo.torque_n_m;
            peaks.gear_ratio = peaks.gear_ratio.max(ratio);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What one step of 1 ms adds to a load is a sixth of it, in whichever of the steps, and no more.
    #[test]
    fn a_load_is_a_mean_over_six_milliseconds() {
        let servo = standfast_robots::load("ut-mu2").unwrap().servos[0];
        let torque_n_m = 0.2 * servo.torque_n_m;
        let (mut loads, mut peaks) = (Loads::new(1, 0.001), PeakLoads::default());
        for step in 0..20 {
            // A landing stops the joint, which the motor keeps from turning before and after it.
            let dq = if step < 9 { 3.0 } else { 0.0 };
            loads.turn(0, &servo, torque_n_m, dq);
            let right = if step == 9 { 60.0 } else { 6.0 };
            // The start, which set the joint in motion, does not count.
            peaks.gear_ratio *= f64::from(step > 6);
            loads.bear(PerFoot { left: 6.0, right }, &[servo], &mut peaks);
        }
        let stopping = servo.rotor_inertia_kg_m2 * 3.0 / 0.006;
        let expected = (torque_n_m + stopping) / servo.torque_n_m;
        assert!((peaks.soles_n.left - 6.0).abs() < 1e-12, "{peaks:?}");
        assert!((peaks.soles_n.right - 15.0).abs() < 1e-12, "{peaks:?}");
        assert!(
            (peaks.gear_ratio - expected).abs() < 1e-12,
            "{peaks:?} {expected}"
        );
    }
}
