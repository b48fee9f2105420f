//! The accepted range of each number of a campaign.

use crate::episode::EpisodeConfig;
use crate::error::{Error, Result};
use crate::sim::Push;

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
        in_range(file, "push.duration_s", push.duration_s, self.duration_s)?;
        in_range(file, "push.start_s", push.start_s, self.start_s)
    }
}

/// Shortest step of the physics (s), and the most steps of an episode, which take some minutes.
const LEAST_STEP_S: f64 = 1e-5;
const MOST_STEPS: f64 = 1e7;

/// Checks time steps, horizon and thresholds of an episode. Errors name `file` as the origin of the values.
pub fn check_episode(file: &str, episode: &EpisodeConfig) -> Result<()> {
    let positive = |field, value, most| positive(file, field, value, most);
    in_range(file, "episode.horizon_s", episode.horizon_s, [0.01, 3600.0])?;
    in_range(file, "episode.control_period_s", episode.control_period_s, [1e-4, 0.1])?;
    let physics_step_s = episode.clock().physics_step_s;
    let least_s = LEAST_STEP_S.max(episode.horizon_s / MOST_STEPS);
    in_range(file, "episode.physics_step_s", physics_step_s, [least_s, episode.control_period_s])?;
    let substeps = episode.control_period_s / physics_step_s;
    if (substeps - substeps.round()).abs() > 1e-6 {
        let accepted = format!("episode.control_period_s = {} divided by a whole number", episode.control_period_s);
        let problem = "does not divide the control period";
        return Err(Error::value(file, "episode.physics_step_s", physics_step_s, problem, accepted));
    }
    let judge = &episode.judge;
    positive("episode.judge.fallen_tilt_deg", judge.fallen_tilt_deg, 180.0)?;
    positive("episode.judge.standing_tilt_deg", judge.standing_tilt_deg, judge.fallen_tilt_deg)?;
    positive("episode.judge.standing_com_speed_m_s", judge.standing_com_speed_m_s, 10.0)?;
    positive("episode.judge.standing_time_s", judge.standing_time_s, episode.horizon_s)?;
    positive("episode.judge.fallen_com_height_ratio", judge.fallen_com_height_ratio, 1.0)?;
    positive("episode.judge.home_radius_m", judge.home_radius_m, 10.0)
}

/// A number with four significant digits, since those in units of the robot are not round in SI units.
pub fn digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Checks that a number is in a range.
pub(crate) fn in_range(file: &str, field: &str, value: f64, [least, most]: [f64; 2]) -> Result<()> {
    accept((least..=most).contains(&value), file, field, value, &format!("{} to {}", digits(least), digits(most)))
}

/// Checks that a number is positive and not too large.
pub fn positive(file: &str, field: &str, value: f64, most: f64) -> Result<()> {
    accept(value > 0.0 && value <= most, file, field, value, &format!("more than 0, at most {}", digits(most)))
}

/// Returns an error that states what is accepted, unless `ok`.
pub(crate) fn accept(ok: bool, file: &str, field: &str, value: f64, accepted: &str) -> Result<()> {
    if ok { Ok(()) } else { Err(Error::value(file, field, value, "out of range", accepted)) }
}
