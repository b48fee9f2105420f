//! How well the ZMP follows the desired ZMP: its frequency response, measured on the standing robot.
//!
//! The paper's model (eq. 5 to 13) takes the ZMP to be where the gain asks for it. Joints, delay and contacts deliver
//! it late and not in full. Here a small sine is added to the gain's ZMP while all loops stay closed. The desired ZMP
//! (the gain's ZMP plus the sine) and the ZMP under the soles are correlated with the frequency of the sine over whole
//! periods. Their complex ratio is the response, which is 1 for an ideal robot. A pole faster than the bandwidth of the
//! response is more than the robot can follow.
//!
//! Measured on UT-mu2 under `switching`, sine of 5 mm, ideal sensors (`standfast-paper response`, `--axis y`):
//!
//! | frequency (Hz) | 0.50 | 1.04 | 2.16 | 3.10 | 4.47 | 9.29 | 19.3 | 40.0 |
//! |---|---|---|---|---|---|---|---|---|
//! | in omega | 0.56 | 1.16 | 2.41 | 3.47 | 5.00 | 10.4 | 21.5 | 44.7 |
//! | gain x | 1.02 | 1.06 | 1.03 | 0.97 | 0.95 | 0.96 | 0.97 | 0.98 |
//! | phase x (deg) | -0 | -3 | -9 | -10 | -9 | -14 | -28 | -59 |
//! | gain y | 1.04 | 1.10 | 1.14 | 1.10 | 1.01 | 0.96 | 0.97 | 0.98 |
//! | phase y (deg) | 1 | -1 | -7 | -12 | -14 | -16 | -29 | -59 |
//!
//! Above 10 Hz the rest is the delay of 4 ms from sensing to torque: the torques for the desired ZMP are fed forward
//! and do not wait for the joints to move. Around 2 Hz the joints' stiffness raises the delay to 11 ms. The phase
//! reaches -45 degrees at 189 rad/s (34 omega) on both axes; the gain does not fall to -3 dB. The fast pole, 5 omega,
//! is far below.

use nalgebra::{Complex, Point2, Vector2};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use standfast::core::control::{CpiController, Design, Phase};
use standfast::core::error::{Error, Result};
use standfast::core::robot::Robot;
use standfast::core::socket::{PreparedController, Report};
use standfast::sim::episode::{ClosedLoop, Disturbance, EpisodeConfig, Until};
use std::any::Any;
use std::f64::consts::TAU;

/// Direction of the sine, world frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Forward.
    X,
    /// To the left.
    Y,
}

/// Settings of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Experiment {
    pub axis: Axis,
    /// Amplitude of the sine (m).
    pub amplitude_m: f64,
    /// Engine and time steps; horizon and judge have no meaning here.
    pub config: EpisodeConfig,
    /// Time for transients to die out (s).
    pub settle_s: f64,
    /// Shortest time of measurement (s). It is rounded up to whole periods, at least two.
    pub measure_s: f64,
}

/// The response at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// The frequency nearest to the requested frequency whose measured periods fill whole ticks.
    pub frequency_hz: f64,
    /// Amplitude of the desired ZMP (m).
    pub wanted_m: f64,
    /// Ratio of the amplitude of the desired ZMP to the amplitude of the sine: the sensitivity of the loop to a
    /// disturbance.
    pub sensitivity: f64,
    /// Ratio of the true ZMP (all contacts, mean over a tick) to the ZMP desired for that tick: gain.
    pub gain: f64,
    /// Phase of the ratio of the true ZMP to the desired ZMP; continuous over the frequencies if measured by
    /// [`measure`].
    pub phase_deg: f64,
    /// Gain and phase of the controller's estimate of the ZMP, which is known one tick later, to the desired ZMP.
    pub estimate_gain: f64,
    pub estimate_phase_deg: f64,
}

impl Point {
    /// The delay with this phase (s).
    pub fn delay_s(&self) -> f64 {
        -self.phase_deg / 360.0 / self.frequency_hz
    }

    /// Angular frequency (rad/s).
    pub fn angular_frequency(&self) -> f64 {
        TAU * self.frequency_hz
    }
}

/// `count` frequencies from `from` to `to`, evenly spaced on a logarithmic scale.
pub fn log_spaced(from: f64, to: f64, count: usize) -> Vec<f64> {
    let step = (to / from).ln() / (count.max(2) - 1) as f64;
    (0..count).map(|i| from * (step * i as f64).exp()).collect()
}

/// Measures the response at rising `frequencies_hz` with ideal sensors (the robot's delay remains), on all cores. The
/// result does not depend on the number of threads.
///
/// It fails if under the sine the robot loses its stance or its state leaves all CPI sets.
pub fn measure(
    robot: &Robot,
    design: &Design,
    what: &Experiment,
    frequencies_hz: &[f64],
) -> Result<Vec<Point>> {
    let mut points = frequencies_hz
        .par_iter()
        .map(|&frequency_hz| measure_at(robot, design, what, frequency_hz))
        .collect::<Result<Vec<_>>>()?;
    for i in 1..points.len() {
        let before = points[i - 1];
        points[i].phase_deg = nearest_turn(points[i].phase_deg, before.phase_deg);
        points[i].estimate_phase_deg =
            nearest_turn(points[i].estimate_phase_deg, before.estimate_phase_deg);
    }
    Ok(points)
}

/// `angle` plus the number of whole turns that brings it nearest to `to` (degrees).
fn nearest_turn(angle: f64, to: f64) -> f64 {
    angle + 360.0 * ((to - angle) / 360.0).round()
}

fn measure_at(
    robot: &Robot,
    design: &Design,
    what: &Experiment,
    frequency_hz: f64,
) -> Result<Point> {
    let dt = what.config.control_period_s;
    let periods = (what.measure_s * frequency_hz).ceil().max(2.0);
    let measured = (periods / frequency_hz / dt).round() as u64;
    let frequency_hz = periods / (measured as f64 * dt);
    let settle = (what.settle_s / dt).round() as u64;
    let (axis, direction) = match what.axis {
        Axis::X => (0, Vector2::x()),
        Axis::Y => (1, Vector2::y()),
    };
    let factory = PreparedController::from(design.clone());
    let mut closed_loop = ClosedLoop::new(robot, [&factory], &what.config, Disturbance::default());
    closed_loop = closed_loop.until(Until::Horizon, 0.0);
    let [mut wanted, mut truth, mut estimate] = [Complex::new(0.0, 0.0); 3];
    let turn_at = |k: u64| Complex::cis(-TAU * frequency_hz * dt * k as f64);
    // The desired ZMP of a tick can be reached by the end of that tick at best, so it is compared with the true and the
    // estimated ZMP at the end of the tick.
    let (mut wanted_before, mut stood) = (Point2::origin(), true);
    for k in 0..=settle + measured {
        let angle = TAU * frequency_hz * dt * k as f64;
        let probe = direction * (what.amplitude_m * angle.sin());
        for controller in closed_loop.controllers() {
            let controller = &mut **controller as &mut dyn Any;
            if let Some(cpi) = controller.downcast_mut::<CpiController>() {
                cpi.probe_zmp(probe);
            }
        }
        let mut seen = None;
        closed_loop.decide(&mut |_, tick| {
            let Report {
                phase,
                zmp,
                zmp_ref,
                ..
            } = tick.report;
            let stands = phase == Phase::Switching.name();
            seen = Some((tick.truth.zmp, zmp, zmp_ref, stands));
        });
        let Some((zmp, Some(zmp_est), Some(zmp_ref), stands)) = seen else {
            return Err(lost(what, frequency_hz));
        };
        if k > 0 {
            let Some(zmp) = zmp.filter(|_| stood) else {
                return Err(lost(what, frequency_hz));
            };
            if k > settle {
                wanted += turn_at(k - 1) * wanted_before[axis];
                truth += turn_at(k - 1) * zmp[axis];
                estimate += Complex::cis(TAU * frequency_hz * dt) * turn_at(k) * zmp_est[axis];
            }
        }
        (wanted_before, stood) = (zmp_ref, stands);
        closed_loop.advance();
    }
    let wanted_m = 2.0 * wanted.norm() / measured as f64;
    Ok(Point {
        frequency_hz,
        wanted_m,
        sensitivity: wanted_m / what.amplitude_m,
        gain: (truth / wanted).norm(),
        phase_deg: (truth / wanted).arg().to_degrees(),
        estimate_gain: (estimate / wanted).norm(),
        estimate_phase_deg: (estimate / wanted).arg().to_degrees(),
    })
}

fn lost(what: &Experiment, frequency_hz: f64) -> Error {
    let problem = format!(
        "the robot loses its balance under a sine of {} m",
        what.amplitude_m
    );
    Error::Numeric {
        what: format!("response at {frequency_hz:.2} Hz"),
        problem,
    }
}

/// The bandwidth: the first frequencies (rad/s) at which gain and phase fall below their limits. None if they do not
/// within the measured range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bandwidth {
    /// Frequency at which the gain falls below -3 dB.
    pub gain_rad_s: Option<f64>,
    /// Frequency at which the phase falls below -45 degrees.
    pub phase_rad_s: Option<f64>,
}

/// The bandwidth from points at rising frequencies, interpolated on a logarithmic scale.
pub fn bandwidth(points: &[Point]) -> Bandwidth {
    Bandwidth {
        gain_rad_s: first_below(points, |p| p.gain.ln(), 0.5f64.sqrt().ln()),
        phase_rad_s: first_below(points, |p| p.phase_deg, -45.0),
    }
}

fn first_below(points: &[Point], value: impl Fn(&Point) -> f64, limit: f64) -> Option<f64> {
    let after = points.iter().position(|p| value(p) < limit)?;
    if after == 0 {
        return Some(points[0].angular_frequency());
    }
    let [a, b] = [&points[after - 1], &points[after]];
    let share = (value(a) - limit) / (value(a) - value(b));
    Some(a.angular_frequency() * (b.frequency_hz / a.frequency_hz).powf(share))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn experiment() -> Experiment {
        let config = EpisodeConfig::of(&standfast::core::robot::Units::of(
            &standfast::robots::load("ut-mu2").unwrap(),
        ));
        Experiment {
            axis: Axis::X,
            amplitude_m: 0.005,
            config,
            settle_s: 1.0,
            measure_s: 2.0,
        }
    }

    fn design(robot: &Robot, gains: &str) -> Design {
        Design::new(robot, &crate::gain_set(gains).unwrap(), 0.002).unwrap()
    }

    #[test]
    fn slow_wishes_are_met_and_the_same_to_the_bit_each_time() {
        let robot = standfast::robots::load("ut-mu2").unwrap();
        let design = design(&robot, "switching");
        for axis in [Axis::X, Axis::Y] {
            let points = measure(
                &robot,
                &design,
                &Experiment {
                    axis,
                    ..experiment()
                },
                &[0.5, 1.0],
            )
            .unwrap();
            for p in &points {
                assert!((p.gain - 1.0).abs() < 0.1, "{axis:?}: {p:?}");
                assert!(p.phase_deg.abs() < 10.0, "{axis:?}: {p:?}");
                assert!((p.estimate_gain - p.gain).abs() < 0.05, "{axis:?}: {p:?}");
            }
            let alone = measure(
                &robot,
                &design,
                &Experiment {
                    axis,
                    ..experiment()
                },
                &[1.0],
            )
            .unwrap();
            assert_eq!(alone[0], points[1]);
        }
    }

    #[test]
    fn a_set_that_wants_no_zmp_and_a_sine_that_topples_are_errors() {
        let robot = standfast::robots::load("ut-mu2").unwrap();
        let wild = Experiment {
            amplitude_m: 0.2,
            ..experiment()
        };
        let error = measure(&robot, &design(&robot, "switching"), &wild, &[1.0]).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("loses its balance under a sine of 0.2 m"),
            "{error}"
        );
    }

    /// A first-order lag with a bandwidth of 10 rad/s and a delay of 5 ms.
    fn lag(frequency_hz: f64) -> Point {
        let w = TAU * frequency_hz;
        let phase_deg = -(w / 10.0).atan().to_degrees() - (w * 0.005).to_degrees();
        let gain = 1.0 / (1.0 + w * w / 100.0).sqrt();
        Point {
            frequency_hz,
            wanted_m: 0.005,
            sensitivity: 1.0,
            gain,
            phase_deg,
            estimate_gain: gain,
            estimate_phase_deg: phase_deg,
        }
    }

    #[test]
    fn the_bandwidth_of_a_lag_is_the_lag() {
        let points: Vec<Point> = log_spaced(0.5, 20.0, 40).into_iter().map(lag).collect();
        let found = bandwidth(&points);
        assert!((found.gain_rad_s.unwrap() - 10.0).abs() < 0.1, "{found:?}");
        // atan(w / 10) + 0.005 w = pi / 4
        assert!(
            (found.phase_rad_s.unwrap() - 9.077).abs() < 0.1,
            "{found:?}"
        );
        assert_eq!(
            bandwidth(&points[..5]),
            Bandwidth {
                gain_rad_s: None,
                phase_rad_s: None
            }
        );
        assert_eq!(log_spaced(0.5, 20.0, 40).len(), 40);
    }

    #[test]
    fn phases_go_on_over_a_half_turn() {
        assert_eq!(nearest_turn(170.0, -175.0), -190.0);
        assert_eq!(nearest_turn(-20.0, -10.0), -20.0);
    }
}
