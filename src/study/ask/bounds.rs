//! The accepted range of each number of a campaign.

use nalgebra::{DMatrix, DVector};
use standfast_core::error::{Error, Result};
use standfast_core::robot::dynamics::Dynamics;
use standfast_core::robot::{Kinematics, Robot, Units};
use standfast_sim::Push;
use standfast_sim::episode::EpisodeConfig;

/// Smallest and largest accepted value of each quantity of a push.
#[derive(Debug, Clone, Copy)]
pub struct PushBounds {
    pub impulse_n_s: [f64; 2],
    pub heading_deg: [f64; 2],
    pub height_m: [f64; 2],
    pub duration_s: [f64; 2],
    pub start_s: [f64; 2],
}

impl PushBounds {
    /// A push starts in the first half of the episode and lasts for a quarter of it at most, so it is always over
    /// before the horizon and leaves time to settle.
    pub fn new(horizon_s: f64) -> Self {
        Self {
            impulse_n_s: [0.0, 1e8],
            heading_deg: [-360.0, 360.0],
            height_m: [-100.0, 100.0],
            duration_s: [1e-3, horizon_s / 4.0],
            start_s: [0.0, horizon_s / 2.0],
        }
    }

    /// Checks one push. Errors name `file` as the origin of the values.
    pub fn check(&self, file: &str, push: &Push) -> Result<()> {
        in_range(file, "push.impulse_n_s", push.impulse_n_s, self.impulse_n_s)?;
        in_range(file, "push.heading_deg", push.heading_deg, self.heading_deg)?;
        in_range(file, "push.height_m", push.height_m, self.height_m)?;
        because(
            A_QUARTER,
            in_range(file, "push.duration_s", push.duration_s, self.duration_s),
        )?;
        because(
            HALF,
            in_range(file, "push.start_s", push.start_s, self.start_s),
        )
    }
}

/// Why the duration and the start of a push are limited.
pub(crate) const A_QUARTER: &str = ", a quarter of episode.horizon_s";
pub(crate) const HALF: &str = ", half of episode.horizon_s";

/// Adds to an error about a value the reason for its bound.
pub(crate) fn because(why: &str, checked: Result<()>) -> Result<()> {
    checked.map_err(|mut error| {
        if let Error::Value { accepted, .. } = &mut error {
            *accepted += why;
        }
        error
    })
}

/// Shortest step of the physics (s), and the largest number of steps in an episode, which take some minutes.
const LEAST_STEP_S: f64 = 1e-5;
const MOST_STEPS: f64 = 1e7;

/// Checks time steps, horizon and thresholds of an episode. Errors name `file` as the origin of the values.
pub fn check_episode(file: &str, episode: &EpisodeConfig) -> Result<()> {
    let positive = |field, value, most| positive(file, field, value, most);
    in_range(file, "episode.horizon_s", episode.horizon_s, [0.01, 3600.0])?;
    in_range(
        file,
        "episode.control_period_s",
        episode.control_period_s,
        [1e-4, 0.1],
    )?;
    let physics_step_s = episode.physics_step_s;
    let least_s = LEAST_STEP_S.max(episode.horizon_s / MOST_STEPS);
    in_range(
        file,
        "episode.physics_step_s",
        physics_step_s,
        [least_s, episode.control_period_s],
    )?;
    let substeps = episode.control_period_s / physics_step_s;
    if (substeps - substeps.round()).abs() > 1e-6 {
        let accepted = format!(
            "episode.control_period_s = {} divided by a whole number",
            episode.control_period_s
        );
        let problem = "does not divide the control period";
        return Err(Error::value(
            file,
            "episode.physics_step_s",
            physics_step_s,
            problem,
            accepted,
        ));
    }
    let judge = &episode.judge;
    positive(
        "episode.judge.fallen_tilt_deg",
        judge.fallen_tilt_deg,
        180.0,
    )?;
    positive(
        "episode.judge.standing_tilt_deg",
        judge.standing_tilt_deg,
        judge.fallen_tilt_deg,
    )?;
    positive(
        "episode.judge.standing_com_speed_m_s",
        judge.standing_com_speed_m_s,
        10.0,
    )?;
    let standing = positive(
        "episode.judge.standing_time_s",
        judge.standing_time_s,
        episode.horizon_s,
    );
    because(", the length of the episode (episode.horizon_s)", standing)?;
    positive(
        "episode.judge.fallen_com_height_ratio",
        judge.fallen_com_height_ratio,
        1.0,
    )?;
    if let Some(most) = judge.max_sole_force_weights {
        let field = "episode.judge.max_sole_force_weights";
        let ok = most > 1.0 && most <= 1000.0;
        accept(
            ok,
            file,
            field,
            most,
            "more than 1, which one sole bears at rest, at most 1000",
        )?;
    }
    positive("episode.judge.home_radius_m", judge.home_radius_m, 10.0)
}

/// Largest steps of the physics, as multiples of 1 / (angular frequency of the fastest vibration by the servos'
/// springs). Up to `COARSE`, at most one outcome in a hundred was seen to differ from the outcome with steps of 1 ms;
/// at 1.25, seven in a hundred of `catch` differed. Up to `UNSTABLE`, no unpushed robot was seen to fall; at twice
/// `UNSTABLE`, UT-mu2 with stiff servos fell.
const COARSE: f64 = 1.0;
const UNSTABLE: f64 = 4.0;
/// Longest control period, as a multiple of 1 / omega, at which no controller was seen to stand worse. At 0.27 `robust`
/// stood worse, and at 0.56 `switching` did.
const SLOW: f64 = 0.2;

/// Checks that servos are stable with such steps of the physics, and warns of steps and control periods that are too
/// long to judge by. Errors name `file` as the origin of the values.
pub fn check_steps(file: &str, episode: &EpisodeConfig, robot: &Robot) -> Result<()> {
    let step_s = episode.physics_step_s;
    let fastest_rad_s = fastest_vibration_rad_s(robot);
    if step_s * fastest_rad_s > UNSTABLE {
        let most_s = digits(UNSTABLE / fastest_rad_s);
        let problem = format!(
            "too long for the servos of {}, which vibrate at {fastest_rad_s:.0} rad/s",
            robot.name
        );
        let accepted = format!("up to {most_s}; or servos with less kp_n_m_rad");
        return Err(Error::value(
            file,
            "episode.physics_step_s",
            step_s,
            problem,
            accepted,
        ));
    }
    if step_s * fastest_rad_s > COARSE {
        log::warn!(
            "{file}: episode.physics_step_s = {step_s}: is long for the servos of {}, and verdicts may differ from those with \
             shorter steps; with up to {:.1} ms, at most 1 in 100 did",
            robot.name,
            1e3 * COARSE / fastest_rad_s
        );
    }
    let most_s = SLOW / Units::of(robot).omega();
    if episode.control_period_s > most_s {
        log::warn!(
            "{file}: episode.control_period_s = {}: is long for {}; controllers that stand with periods of up to {most_s:.1e} s \
             may fall",
            episode.control_period_s,
            robot.name
        );
    }
    Ok(())
}

/// The fastest frequency at which a robot in the air vibrates at home by the springs of its servos (rad/s).
fn fastest_vibration_rad_s(robot: &Robot) -> f64 {
    let (mut dynamics, joints) = (Dynamics::new(robot), robot.joints.len());
    dynamics.update(
        robot,
        &Kinematics::at_home(robot),
        &DVector::zeros(6 + joints),
    );
    let Some(mobility) = dynamics
        .mass_matrix()
        .clone()
        .cholesky()
        .map(|mass| mass.inverse())
    else {
        return 0.0;
    };
    let of_springs = DMatrix::from_fn(joints, joints, |i, j| {
        let stiffness = (robot.servos[i].kp * robot.servos[j].kp).sqrt();
        stiffness * mobility[(6 + i, 6 + j)]
    });
    of_springs.symmetric_eigenvalues().max().max(0.0).sqrt()
}

/// Writes a number with four significant digits, because a number in units of the robot is not round in SI units.
pub fn digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Checks that a number is in a range.
pub fn in_range(file: &str, field: &str, value: f64, [least, most]: [f64; 2]) -> Result<()> {
    accept(
        (least..=most).contains(&value),
        file,
        field,
        value,
        &format!("{} to {}", digits(least), digits(most)),
    )
}

/// Checks that a number is positive and not too large.
pub fn positive(file: &str, field: &str, value: f64, most: f64) -> Result<()> {
    accept(
        value > 0.0 && value <= most,
        file,
        field,
        value,
        &format!("more than 0, at most {}", digits(most)),
    )
}

/// Returns an error that states what is accepted, unless `ok`.
pub(crate) fn accept(ok: bool, file: &str, field: &str, value: f64, accepted: &str) -> Result<()> {
    if ok {
        Ok(())
    } else {
        Err(Error::value(
            file,
            field,
            shown(value),
            "out of range",
            accepted,
        ))
    }
}

/// Writes a number as a user gave it. A number that was converted from units of the robot has sixteen digits, and is
/// rounded.
pub(crate) fn shown(value: f64) -> String {
    const TYPED: usize = 12;
    let plain = value.to_string();
    let digits = plain
        .trim_start_matches(['-', '0', '.'])
        .trim_end_matches('0')
        .chars()
        .filter(char::is_ascii_digit)
        .count();
    if digits > TYPED {
        format!("{value:.5e}").parse().unwrap_or(value).to_string()
    } else {
        plain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stiff servos throw an unpushed UT-mu2 over. With servos 64 times as stiff as designed it happens between 4 and 8
    /// ms, and with servos 256 times as stiff at half of that step.
    #[test]
    fn steps_too_long_for_the_servos_are_refused() {
        for (stiffer, fine_s, bad_s) in [
            (1.0, 0.012, 0.1),
            (64.0, 0.002, 0.008),
            (256.0, 0.001, 0.004),
        ] {
            let mut robot = standfast_robots::load("ut-mu2").unwrap();
            for servo in &mut robot.servos {
                servo.kp *= stiffer;
            }
            let usual = EpisodeConfig::of(&Units::of(&robot));
            let check = |step_s| {
                check_steps(
                    "f",
                    &EpisodeConfig {
                        physics_step_s: step_s,
                        ..usual
                    },
                    &robot,
                )
            };
            check(fine_s).unwrap();
            let error = check(bad_s).unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("f: episode.physics_step_s = {bad_s}: ")),
                "{error}"
            );
        }
    }
}
