//! What a campaign varies in addition to its pushes: robot and ground (`[variations]`). The controller does not know
//! the variation.

use crate::ask::distribution::Distribution;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use standfast_core::error::Result;
use standfast_core::robot::Units;
use standfast_sim::{Variation, ground::tilting};

/// `[variations]`: a distribution for each quantity, or "nominal" (the default), which leaves the quantity as designed.
/// If a slope has a nominal heading, the heading is drawn uniformly from all directions.
pub type VariationSpec = Variation<Varied>;

/// The distribution of one quantity; None if it does not vary.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Varied(pub Option<Distribution>);

/// Word in a file for a quantity that does not vary.
const NOMINAL: &str = "nominal";

/// Steepest accepted slope.
const SLOPE_DEG: [f64; 2] = [-15.0, 15.0];

/// Smallest and largest accepted value of each quantity, for a robot with these units.
pub fn bounds(units: &Units) -> Variation<[f64; 2]> {
    let lengths_m = [-0.16 * units.length_m, 0.16 * units.length_m];
    Variation {
        mass_scale: [0.5, 2.0],
        trunk_com_x_m: lengths_m,
        trunk_com_y_m: lengths_m,
        friction: [0.01, 10.0],
        slope_deg: SLOPE_DEG,
        slope_heading_deg: [-360.0, 360.0],
        ground_step_m: lengths_m,
        kp_scale: [0.1, 10.0],
        kd_scale: [0.1, 10.0],
        torque_scale: [0.1, 10.0],
        speed_scale: [0.1, 10.0],
        rotor_scale: [0.1, 10.0],
        joint_friction_share: [0.0, 1.0],
        joint_damping_share: [0.0, 1.0],
        delay_s: [0.0, 0.1],
    }
}

/// Checks every distribution. Errors name `file` as the origin of the values.
pub(crate) fn check(spec: &VariationSpec, units: &Units, file: &str) -> Result<()> {
    for (name, (Varied(distribution), bounds)) in spec.zip(bounds(units)).list() {
        if let Some(distribution) = distribution {
            distribution.check(file, &format!("variations.{name}"), bounds)?;
        }
    }
    Ok(())
}

/// Heading in which a slope rises if none is given.
const ALL_AROUND_DEG: Distribution = Distribution::Uniform {
    uniform: [-180.0, 180.0],
};

/// Whether the ground may be inclined.
fn is_sloped(spec: &VariationSpec) -> bool {
    spec.slope_deg
        .0
        .is_some_and(|distribution| !(distribution.is_constant() && distribution.mean() == 0.0))
}

/// The quantities that are drawn. The heading of a slope is drawn exactly if there is a slope.
pub(crate) fn drawn(spec: &VariationSpec) -> Variation<Option<Distribution>> {
    let mut drawn = spec.map(|_, Varied(distribution)| distribution);
    let heading = drawn.slope_heading_deg.unwrap_or(ALL_AROUND_DEG);
    drawn.slope_heading_deg = is_sloped(spec).then_some(heading);
    drawn
}

/// Earliest start of the first push (s). While the ground tilts to its slope ([`tilting`]) the slope is not yet the
/// one that the campaign states, and the robot has not adapted to it, so no push may start.
pub fn earliest_push_s(spec: &VariationSpec, units: &Units) -> f64 {
    let Some(slope) = spec.slope_deg.0.filter(|_| is_sloped(spec)) else {
        return 0.0;
    };
    let [least, most] = slope.range(SLOPE_DEG);
    tilting(least.abs().max(most.abs())) * units.time_s()
}

/// The varied quantities and their distributions, in words.
pub fn described(spec: &VariationSpec) -> Vec<String> {
    let fields = spec.list().into_iter();
    fields
        .filter_map(|(name, Varied(distribution))| Some(format!("{name} {}", distribution?)))
        .collect()
}

// Written by hand: TOML has no value for "not there", and `--set` must find each key.
impl Serialize for Varied {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0 {
            Some(distribution) => distribution.serialize(serializer),
            None => serializer.serialize_str(NOMINAL),
        }
    }
}

impl<'de> Deserialize<'de> for Varied {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = toml::Value::deserialize(deserializer)?;
        if value.as_str() == Some(NOMINAL) {
            return Ok(Varied(None));
        }
        match Distribution::deserialize(value) {
            Ok(distribution) => Ok(Varied(Some(distribution))),
            Err(error) => {
                let problem = error.message().trim_end();
                Err(serde::de::Error::custom(format!(
                    "{problem}; or \"{NOMINAL}\""
                )))
            }
        }
    }
}
