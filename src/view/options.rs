//! What the window is asked.

use std::path::PathBuf;

/// What to show, and how the window starts.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Result folder: show `trial` of it, exactly as it was. None: live.
    pub dir: Option<PathBuf>,
    /// Trial of the result or, live, of `campaign`: robot, ground, noise and pushes are those of this trial.
    pub trial: Option<u64>,
    /// Gain sets by name or file; the first acts. Empty: as the window has them or, of a result, the first that lost.
    pub gains: Vec<String>,
    /// Robot by name or URDF file; None: that of the campaign, or the one that is compiled in.
    pub robot: Option<String>,
    /// Campaign whose sensor noise, rates and thresholds are taken; None: ideal sensors.
    pub campaign: Option<String>,
    /// Impulse of the key's push (N s); None: one that suits the robot.
    pub impulse: Option<f64>,
    /// Its heading (degrees).
    pub heading: f64,
    /// Simulated seconds per second.
    pub speed: f64,
    /// Close the window after so many seconds.
    pub seconds: Option<f64>,
    /// Write the window's last picture here (PNG).
    pub screenshot: Option<PathBuf>,
}
