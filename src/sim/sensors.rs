//! What the controller is told: encoders, an IMU on the trunk, a wrench under each sole; with noise, bias and delay.

/// Errors of the sensors in one episode: a stream of standard normal numbers and how to scale them.
///
/// The plant takes the same count of numbers at the start (bias) and at every tick (noise), in a fixed order, so that
/// the noise of a sensor at a tick depends on the stream alone, not on what the controller does.
pub struct SensorErrors {
    /// Noise, in units of the robot's own [`SensorNoise`](crate::robot::SensorNoise).
    pub noise_scale: f64,
    /// Standard deviation of a bias that is constant over the episode, in the same units.
    pub bias_scale: f64,
    /// Independent standard normal numbers.
    pub normal: Box<dyn FnMut() -> f64 + Send>,
}
