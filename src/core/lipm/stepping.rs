//! The paper's stepping rules (Sect. V; table `[stepping]` of a gain set's file), for states in no CPI set.
//!
//! As in the paper, the footstep is planned once, when it is decided, without feedback while the foot is in the air.

use super::capture::SwingRegion;
use crate::error::{Error, Result};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// The table `[stepping]` of a gain set's file, which holds for robots of every size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SteppingTable {
    /// In 1/omega.
    #[serde(default)]
    pub patience: f64,
    pub alpha: f64,
    pub range: RangeTable,
    /// In swing times of the robot's region beside the stance foot.
    pub swing_time: f64,
    /// In COM heights.
    pub lift: f64,
    pub lambda: f64,
    pub weights: RelaxationWeights,
    /// In 1/omega, as all fields below.
    pub late: f64,
    pub pause: f64,
    pub same_foot_pause: f64,
}

/// The [`LandingRange`] in shares of the robot's region beside the stance foot, so that it contains the stance at home.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeTable {
    /// Share of the way forward or backward to the end of the region.
    pub forward: f64,
    /// Share of the way from the stance at home outward to the end of the region.
    pub outward: f64,
    /// Share of the way from the innermost place of the region to the stance at home.
    pub least: f64,
}

impl SteppingTable {
    /// The keys that a file needs.
    pub const KEYS: [&str; 9] = [
        "alpha",
        "range",
        "swing_time",
        "lift",
        "lambda",
        "weights",
        "late",
        "pause",
        "same_foot_pause",
    ];

    /// Checks the values. Errors name the gain set `file`.
    pub fn validate(&self, file: &str) -> Result<()> {
        let range = &self.range;
        let ranges = [
            ("patience", self.patience, 0.0, 6.0),
            ("alpha", self.alpha, 0.0, 1e3),
            ("swing_time", self.swing_time, 0.1, 10.0),
            ("lift", self.lift, 0.0, 0.6),
            ("lambda", self.lambda, 0.01, 1e3),
            ("late", self.late, 0.0, 6.0),
            ("pause", self.pause, 0.0, 6.0),
            ("same_foot_pause", self.same_foot_pause, 0.0, 600.0),
            ("range.forward", range.forward, 0.01, 1.0),
            ("range.outward", range.outward, 0.01, 1.0),
            ("range.least", range.least, 0.0, 1.0),
            ("weights.dcm", self.weights.dcm, 0.0, 1e9),
            ("weights.com", self.weights.com, 0.0, 1e9),
            ("weights.zmp", self.weights.zmp, 1e-9, 1e9),
        ];
        Error::check_ranges(file, "stepping", &ranges)?;
        if (self.lambda - 1.0).abs() < 0.01 {
            let accepted = "a multiple of omega that is not 1: below 0.99 or above 1.01";
            return Err(Error::value(
                file,
                "stepping.lambda",
                self.lambda,
                "is too close to 1",
                accepted,
            ));
        }
        Ok(())
    }

    /// The rules of a robot with the COM height `length_m` (m) and 1/omega `time_s` (s), whose feet can land in the
    /// region `beside`, in which they stand `stance_m` (m) apart at home.
    pub fn rules(
        &self,
        length_m: f64,
        time_s: f64,
        beside: &SwingRegion,
        stance_m: f64,
    ) -> Stepping {
        let ([backward, forward], [inward, outward]) = (beside.x_m, beside.y_m);
        Stepping {
            patience_s: self.patience * time_s,
            alpha: self.alpha,
            range: LandingRange {
                forward_m: self.range.forward * forward.min(-backward),
                outward_m: stance_m + self.range.outward * (outward - stance_m),
                least_m: inward + self.range.least * (stance_m - inward),
            },
            swing_time_s: self.swing_time * beside.swing_time_s,
            lift_m: self.lift * length_m,
            lambda: self.lambda,
            weights: self.weights,
            late_s: self.late * time_s,
            pause_s: self.pause * time_s,
            same_foot_pause_s: self.same_foot_pause * time_s,
        }
    }
}

/// Rules of the footsteps of one robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Stepping {
    /// Time for which no CPI set must have contained the state before a foot is lifted (s). The paper steps at once
    /// (0), after an impulse that is over when it is noticed. While a push lasts, the error still grows.
    pub patience_s: f64,
    /// Ratio of the stride to the ZMP error (eq. 29).
    pub alpha: f64,
    pub range: LandingRange,
    /// Planned time from lift to landing (s).
    pub swing_time_s: f64,
    /// Height of the sole in the middle of the swing (m).
    pub lift_m: f64,
    /// Rate at which the ZMP goes from its first to its last position, as a multiple of omega. It must not be 1.
    pub lambda: f64,
    pub weights: RelaxationWeights,
    /// Longest time for which a late foot goes on downward (s).
    pub late_s: f64,
    /// Shortest time from a landing to the next lift (s).
    pub pause_s: f64,
    /// Shortest time from the landing of a foot until the same foot is lifted again (s). Otherwise a robot that is
    /// driven to one side would stand on the far foot during that time, and be driven on. If eq. 27 to 29 choose the
    /// same foot earlier, no foot is lifted.
    pub same_foot_pause_s: f64,
}

/// Where a foot may land relative to the other: the semi-ellipse of eq. 27 and 28, in the axes of the control frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LandingRange {
    /// Largest offset forward or backward from the stance sole's centre (m), a in the paper.
    pub forward_m: f64,
    /// Largest offset to the side (m), b + y in the paper.
    pub outward_m: f64,
    /// Smallest offset to the side, at which the legs do not cross (m), y in the paper.
    pub least_m: f64,
}

/// Costs at landing, per metre squared (see [`super::relaxation`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelaxationWeights {
    /// Distance of the DCM from the middle of the feet.
    pub dcm: f64,
    /// Distance of the COM from the middle of the feet.
    pub com: f64,
    /// Distance of the first and the last ZMP from the middle of the stance sole.
    pub zmp: f64,
}

impl LandingRange {
    /// Length (m) that a foot at `from` can go along the unit vector `direction` before it leaves the semi-ellipse: the
    /// length of the paper's vector `Delta_max` (Sect. V.B, steps 2 and 3). It is 0 if the line misses the
    /// semi-ellipse.
    ///
    /// `from` and `direction` are in a frame with its origin at the stance sole's centre, x forward and y to the side
    /// of the swing foot.
    pub fn reach(&self, from: Vector2<f64>, direction: Vector2<f64>) -> f64 {
        let radii = Vector2::new(self.forward_m, self.outward_m - self.least_m);
        // Scaled so that the ellipse is a unit circle.
        let start = (from - Vector2::new(0.0, self.least_m)).component_div(&radii);
        let along = direction.component_div(&radii);
        let (a, b, c) = (
            along.norm_squared(),
            start.dot(&along),
            start.norm_squared() - 1.0,
        );
        let discriminant = b * b - a * c;
        if discriminant.is_nan() || discriminant <= 0.0 {
            return 0.0;
        }
        let [mut enter, mut leave] = [
            (-b - discriminant.sqrt()) / a,
            (-b + discriminant.sqrt()) / a,
        ];
        // The intersection with the straight edge y = least_m.
        let at_edge = -start.y / along.y;
        if along.y > 0.0 {
            enter = enter.max(at_edge);
        } else if along.y < 0.0 {
            leave = leave.min(at_edge);
        } else if start.y < 0.0 {
            return 0.0;
        }
        if enter.max(0.0) < leave { leave } else { 0.0 }
    }
}

#[cfg(test)]
impl Stepping {
    /// Rules for tests, which must not depend on the tuning of a gain set.
    pub(crate) const EXAMPLE: Self = Self {
        patience_s: 0.0,
        alpha: 4.0,
        range: LandingRange {
            forward_m: 0.15,
            outward_m: 0.18,
            least_m: 0.075,
        },
        swing_time_s: 0.2,
        lift_m: 0.025,
        lambda: 5.0,
        weights: RelaxationWeights {
            dcm: 1.0,
            com: 0.1,
            zmp: 0.01,
        },
        late_s: 0.12,
        pause_s: 0.03,
        same_foot_pause_s: 0.3,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lipm::testing::changed;

    const RANGE: LandingRange = LandingRange {
        forward_m: 0.15,
        outward_m: 0.18,
        least_m: 0.075,
    };

    /// The errors are tested for both kinds of footsteps.
    #[test]
    fn errors_name_the_field_its_value_and_what_is_accepted() {
        for (bad, accepted) in [
            ("stepping.patience = -0.1", "out of range; accepted: 0 to 6"),
            ("stepping.alpha = NaN", "out of range; accepted: 0 to 1000"),
            (
                "stepping.swing_time = 0",
                "out of range; accepted: 0.1 to 10",
            ),
            ("stepping.lift = 0.7", "out of range; accepted: 0 to 0.6"),
            (
                "stepping.lambda = 0",
                "out of range; accepted: 0.01 to 1000",
            ),
            (
                "stepping.lambda = 0.995",
                "is too close to 1; accepted: a multiple of omega",
            ),
            ("stepping.late = inf", "out of range; accepted: 0 to 6"),
            ("stepping.pause = -1", "out of range; accepted: 0 to 6"),
            (
                "stepping.range.forward = 0",
                "out of range; accepted: 0.01 to 1",
            ),
            (
                "stepping.range.least = -0.01",
                "out of range; accepted: 0 to 1",
            ),
            (
                "stepping.range.outward = 1.1",
                "out of range; accepted: 0.01 to 1",
            ),
            ("stepping.weights.dcm = -1", "out of range; accepted: 0 to "),
            (
                "stepping.weights.com = NaN",
                "out of range; accepted: 0 to ",
            ),
            (
                "stepping.weights.zmp = 0",
                "out of range; accepted: 0.000000001 to ",
            ),
            ("catching.lift = -0.01", "out of range; accepted: 0 to 0.6"),
            ("catching.late = NaN", "out of range; accepted: 0 to 6"),
            ("catching.pause = 7", "out of range; accepted: 0 to 6"),
            ("catching.transfer = 7", "out of range; accepted: 0 to 6"),
            ("catching.settle = 0", "out of range; accepted: 0.05 to 10"),
        ] {
            let (key, value) = bad.split_once(" = ").unwrap();
            let set = if key.starts_with("stepping") {
                "paper"
            } else {
                "catch"
            };
            let error = changed(set, key, &value.replace("NaN", "nan"))
                .unwrap_err()
                .to_string();
            assert!(
                error.contains(&format!("{bad}: {accepted}")),
                "{error}\nwanted: {bad}: {accepted}"
            );
        }
    }

    /// Every share leaves the stance at home in the range, in a region that contains it.
    #[test]
    fn the_range_contains_the_stance_at_home() {
        let table = crate::lipm::testing::built_in("paper").stepping.unwrap();
        for (least, outward) in [(0.0, 0.01), (0.7, 1.0), (1.0, 0.01), (1.0, 1.0)] {
            let table = SteppingTable {
                range: RangeTable {
                    least,
                    outward,
                    ..table.range
                },
                ..table
            };
            let beside = SwingRegion {
                x_m: [-0.2, 0.3],
                y_m: [0.15, 0.4],
                swing_time_s: 0.3,
            };
            let Stepping {
                range,
                swing_time_s,
                ..
            } = table.rules(0.9, 0.3, &beside, 0.21);
            assert!(
                0.15 <= range.least_m
                    && range.least_m <= 0.21
                    && 0.21 < range.outward_m
                    && range.outward_m <= 0.4
            );
            assert!(
                range.forward_m <= 0.2 && (swing_time_s - 0.3 * table.swing_time).abs() < 1e-12
            );
        }
    }

    #[test]
    fn reach_ends_on_the_border_of_the_semi_ellipse_or_leads_back_into_it() {
        for degrees in [0.0_f64, 30.0, 90.0, 150.0, 200.0, 270.0, 359.0] {
            let (home, way) = (Vector2::new(0.0, 0.097), degrees.to_radians());
            let direction = Vector2::new(way.cos(), way.sin());
            let end = home + direction * RANGE.reach(home, direction);
            let round = (end.x / 0.15).powi(2) + ((end.y - 0.075) / 0.105).powi(2);
            assert!(
                (round - 1.0).abs() < 1e-12 || (end.y - 0.075).abs() < 1e-12,
                "{degrees}: {end}"
            );
        }
        for (from, direction, expected) in [
            ([0.0, 0.097], [0.0, 1.0], 0.083),
            ([0.0, 0.097], [0.0, -1.0], 0.022),
            // Ahead of the range, and across.
            ([0.2, 0.097], [1.0, 0.0], 0.0),
            (
                [0.2, 0.097],
                [-1.0, 0.0],
                0.2 + 0.15 * (1.0 - (0.022_f64 / 0.105).powi(2)).sqrt(),
            ),
            ([0.0, 0.05], [1.0, 0.0], 0.0),
            ([0.0, 0.05], [0.0, 1.0], 0.13),
            ([0.0, 0.05], [0.0, -1.0], 0.0),
        ] {
            let reach_m = RANGE.reach(from.into(), direction.into());
            assert!(
                (reach_m - expected).abs() < 1e-12,
                "{from:?} {direction:?}: {reach_m}"
            );
        }
    }
}
