//! Pushes: a horizontal force on the trunk over a short time.

use serde::{Deserialize, Serialize};

/// Course of the force over the push's duration; the impulse is the same for all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    #[default]
    Rectangular,
    HalfSine,
}

/// A push on the trunk, at a height given relative to the COM at home.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Push {
    /// [N s], not negative.
    pub impulse_n_s: f64,
    /// 0 pushes forward (+x), 90 to the left (+y).
    pub heading_deg: f64,
    /// Height of the force's line above the COM of the home posture [m].
    pub height_m: f64,
    pub duration_s: f64,
    pub start_s: f64,
    pub profile: Profile,
}

impl Default for Push {
    fn default() -> Self {
        Self {
            impulse_n_s: 0.0,
            heading_deg: 0.0,
            height_m: 0.0,
            duration_s: 0.05,
            start_s: 0.5,
            profile: Profile::Rectangular,
        }
    }
}
