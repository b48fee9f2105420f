//! The ground: a level or inclined plane on which the robot starts. Around the patch under its feet the ground may be
//! higher or lower, so that a foot that is set down there lands early or late.
//!
//! The world's origin is on the plane, midway between the feet at the start. The patch is a rectangle that is
//! [`MARGIN`] wider than both soles on each side. Its edges are sharp: a sole across one stands on the higher side.
//!
//! A slope is level at first and tilts under the robot within [`tilting`]. So every controller starts at home,
//! upright and at rest, and has to adapt to the slope before the push. (To the estimator of a robot that starts on the
//! slope, the COM would seem to have jumped.)

use super::variation::Variation;
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, UnitVector3, Vector3};
use standfast_core::robot::{Foot, Kinematics, Robot, SizeRatio, Units};

/// Distance from the soles to the edges of the patch, in COM heights, so that feet that rock or slide do not meet an
/// edge.
pub const MARGIN: f64 = 0.032;

/// Time in which the ground tilts from level to a slope of `slope_deg` degrees, without setting the robot in motion; in
/// 1/omega.
pub fn tilting(slope_deg: f64) -> f64 {
    (1.68 * slope_deg.abs()).clamp(1.68, 4.5)
}

/// Extent of the ground around the patch, and depth of the boxes that rise above the plane; in diagonals of the patch.
/// A robot falls less far than the extent.
const REACH: f64 = 9.0;
const DEPTH: f64 = 1.0;

/// The ground under a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Rotation from the frame of the plane, with its normal as z, to the world.
    pub slope: UnitQuaternion<f64>,
    /// Height of the surrounding ground above the patch, along the normal (m).
    pub step_m: f64,
    /// The corners of the patch with the smallest and the largest coordinates (m), in the frame of the plane.
    pub patch: [Point2<f64>; 2],
    /// Time in which the ground tilts from level to its slope (s).
    pub tilting_s: f64,
}

impl Default for Ground {
    /// Level ground without a step.
    fn default() -> Self {
        Self {
            slope: UnitQuaternion::identity(),
            step_m: 0.0,
            patch: [Point2::origin(); 2],
            tilting_s: 0.0,
        }
    }
}

impl Ground {
    /// The ground of `variation` under `robot` in its home stance.
    pub fn new(robot: &Robot, variation: &Variation) -> Self {
        let angle_deg = variation.slope_deg.filter(|angle_deg| *angle_deg != 0.0);
        let slope = angle_deg.map_or(UnitQuaternion::identity(), |angle_deg| {
            let (sin, cos) = variation
                .slope_heading_deg
                .unwrap_or(0.0)
                .to_radians()
                .sin_cos();
            // The rotation is about the horizontal axis to the right of the heading, which raises the ground ahead.
            let axis = UnitVector3::new_normalize(Vector3::new(sin, -cos, 0.0));
            UnitQuaternion::from_axis_angle(&axis, angle_deg.to_radians())
        });
        let kinematics = Kinematics::at_home(robot);
        let mut patch = [
            Point2::new(f64::INFINITY, f64::INFINITY),
            Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
        ];
        for foot in Foot::BOTH {
            for corner in robot.soles[foot]
                .corners()
                .map(|corner| kinematics.sole_pose(robot, foot) * corner)
            {
                patch[0] = patch[0].inf(&corner.xy());
                patch[1] = patch[1].sup(&corner.xy());
            }
        }
        let units = Units::of(robot);
        let margin = nalgebra::Vector2::repeat(MARGIN * units.length_m);
        Self {
            slope,
            step_m: variation.ground_step_m.unwrap_or(0.0),
            patch: [patch[0] - margin, patch[1] + margin],
            tilting_s: tilting(angle_deg.unwrap_or(0.0)) * units.time_s(),
        }
    }

    /// The ground under a similar robot.
    pub(super) fn scaled(&self, by: SizeRatio) -> Self {
        Self {
            step_m: self.step_m * by.length,
            patch: self.patch.map(|corner| corner * by.length),
            tilting_s: self.tilting_s * by.time(),
            ..*self
        }
    }

    /// Height of the ground (m) at a horizontal position in the world frame.
    pub fn height_m(&self, at: Point2<f64>) -> f64 {
        let normal = self.slope * Vector3::z();
        let plane = -(normal.x * at.x + normal.y * at.y) / normal.z;
        if self.step_m == 0.0 {
            return plane;
        }
        let local = self.slope.inverse() * Point3::new(at.x, at.y, plane);
        let inside = (0..2).all(|i| (self.patch[0][i]..=self.patch[1][i]).contains(&local[i]));
        if inside {
            plane
        } else {
            plane + self.step_m / normal.z
        }
    }

    /// The ground at a time after the start, while it tilts from level to this slope.
    pub fn at(&self, time_s: f64) -> Self {
        let passed = if time_s < self.tilting_s {
            (time_s / self.tilting_s).max(0.0)
        } else {
            1.0
        };
        // The tilting starts and ends smoothly.
        let share = passed * passed * (3.0 - 2.0 * passed);
        Self {
            slope: UnitQuaternion::identity().slerp(&self.slope, share),
            ..*self
        }
    }

    /// Whether the ground never tilts.
    pub fn is_level(&self) -> bool {
        self.slope == UnitQuaternion::identity()
    }

    /// Pose of the half space in the frame of the plane. Its z axis points up, out of the ground.
    pub fn half_space(&self) -> Isometry3<f64> {
        Isometry3::translation(0.0, 0.0, self.step_m.min(0.0))
    }

    /// The boxes above the half space: poses in the frame of the plane, and half extents (m). If the surrounding ground
    /// is lower, it is the patch; if it is higher, these are the four sides of a frame around the patch.
    pub fn boxes(&self) -> Vec<(Isometry3<f64>, Vector3<f64>)> {
        let [low, high] = self.patch;
        let diagonal_m = (high - low).norm();
        let (reach_m, depth_m) = (REACH * diagonal_m, DEPTH * diagonal_m);
        let (far_low, far_high) = (low.map(|v| v - reach_m), high.map(|v| v + reach_m));
        let top = self.step_m.max(0.0);
        let rectangles = if self.step_m < 0.0 {
            vec![[low, high]]
        } else if self.step_m > 0.0 {
            vec![
                [Point2::new(high.x, far_low.y), far_high],
                [far_low, Point2::new(low.x, far_high.y)],
                [Point2::new(low.x, high.y), Point2::new(high.x, far_high.y)],
                [Point2::new(low.x, far_low.y), Point2::new(high.x, low.y)],
            ]
        } else {
            Vec::new()
        };
        let slabs = rectangles.into_iter().map(|[from, to]| {
            let (middle, half) = (nalgebra::center(&from, &to), (to - from) / 2.0);
            let pose = Isometry3::translation(middle.x, middle.y, top - depth_m / 2.0);
            (pose, Vector3::new(half.x, half.y, depth_m / 2.0))
        });
        slabs.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(variation: Variation) -> Ground {
        Ground::new(&standfast_robots::load("ut-mu2").unwrap(), &variation)
    }

    #[test]
    fn a_step_is_where_the_feet_do_not_stand_at_the_start() {
        for step_m in [0.01, -0.01] {
            let ground = ground(Variation {
                ground_step_m: Some(step_m),
                ..Variation::default()
            });
            let [low, high] = ground.patch;
            let margin_m = MARGIN * standfast_robots::load("ut-mu2").unwrap().home_com_height();
            assert!(
                (high.x - low.x - 2.0 * margin_m - 0.1).abs() < 0.02,
                "{low} {high}"
            );
            assert_eq!(ground.height_m(Point2::origin()), 0.0);
            for outside in [
                Point2::new(high.x + 1e-6, 0.0),
                Point2::new(0.0, low.y - 1e-6),
            ] {
                assert_eq!(ground.height_m(outside), step_m);
            }
            // The boxes' tops are at the height that the ground states.
            for (pose, half) in ground.boxes() {
                let top = (pose * Point3::new(0.0, 0.0, half.z)).xyz();
                assert!((top.z - ground.height_m(top.xy())).abs() < 1e-12, "{top}");
            }
        }
    }
}
