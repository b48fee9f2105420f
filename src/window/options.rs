//! The options of the window.

use std::path::PathBuf;

/// How the window starts and ends.
#[derive(Debug, Clone)]
pub struct Options {
    /// Impulse of the push that a key gives (N s). None for an impulse that suits the robot.
    pub impulse: Option<f64>,
    /// Heading of this push (degrees).
    pub heading: f64,
    /// Simulated seconds per second.
    pub speed: f64,
    /// Time after which the window closes (s).
    pub seconds: Option<f64>,
    /// PNG file for the window's last picture.
    pub screenshot: Option<PathBuf>,
}
