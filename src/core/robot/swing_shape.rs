//! The shapes of a swing over the share u of its duration: its progress over the ground, and its height.

/// Minimum-jerk motion from 0 to 1, before it starts and after its end at rest.
pub fn least_jerk(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
}

/// A smooth bump of `height` in the middle of the swing, with its first and second derivatives by u. Both ends have
/// zero height and rate.
pub fn bump(height: f64, u: f64) -> [f64; 3] {
    if u >= 1.0 {
        return [0.0; 3];
    }
    [
        16.0 * height * (u * (1.0 - u)).powi(2),
        32.0 * height * u * (1.0 - u) * (1.0 - 2.0 * u),
        32.0 * height * (1.0 - 6.0 * u + 6.0 * u * u),
    ]
}
