//! The options of the window.

use standfast_sim::Engine;
use std::path::PathBuf;

/// The content of the window, and how it starts.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Trial of `campaign`, whose robot, ground, noise and pushes are used.
    pub trial: Option<u64>,
    /// Controllers by name or file, of which the first acts. If empty, the default controllers.
    pub gains: Vec<String>,
    /// Physics engine, and the engine of a ghost. If empty, the engine of the campaign, or Rapier.
    pub engines: Vec<Engine>,
    /// Robot by name or URDF file. None for the robot of the campaign, or the compiled-in one.
    pub robot: Option<String>,
    /// Campaign whose sensor noise, rates and thresholds are used. None for ideal sensors.
    pub campaign: Option<String>,
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
