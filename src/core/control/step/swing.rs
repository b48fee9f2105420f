//! A foot in the air: its smooth path to the landing place, and the detection of its landing by contact.

use super::quintic::Quintic;
use crate::control::estimate::{along, on_ground};
use crate::robot::swing_shape::{bump, least_jerk};
use crate::robot::{Around, Foot, PerFoot, Pose};
use nalgebra::{Isometry2, Point2, Vector2, Vector3};

/// Share of the swing before which a load is not taken as a landing, because the foot may not have left the ground yet.
pub const EARLIEST_LANDING: f64 = 0.6;
/// Share of the swing before the end of an axis' motion within which the axis is not aimed anew.
const ARRIVED: f64 = 0.05;
/// Speed at which a late foot goes down, in COM heights times omega.
pub const LATE_SPEED: f64 = 0.057;
/// Share of the swing that comparisons of times ignore, because times are rounded.
const ROUNDING: f64 = 1e-8;

/// Duration and height of a swing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingTiming {
    /// Planned time from lift to landing (s).
    pub swing_time_s: f64,
    /// Largest height of the sole (m).
    pub lift_m: f64,
    /// How much sooner than in the middle of the swing the sole is highest: at the share u of the swing, it is as high
    /// as it would otherwise be at `u + lead u (1 - u)`. From 0 to 1; with a lead, the foot rises fast and comes down
    /// slowly.
    pub lead: f64,
    /// Longest time for which a late foot goes on downward (s).
    pub late_s: f64,
    /// Speed at which a late foot goes down (m/s).
    pub late_speed_m_s: f64,
}

/// How a foot goes over the ground, along the axes of the stance sole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// Shares of the swing between which the foot moves along x, and along y.
    pub moves: [[f64; 2]; 2],
    /// Largest displacement that the arc adds along x on the way (m).
    pub arc_m: f64,
}

impl Way {
    /// Straight to the landing place.
    pub const STRAIGHT: Self = Self {
        moves: [[0.0, 1.0]; 2],
        arc_m: 0.0,
    };

    /// To a place on the other side of the stance leg: first forward or backward, then sideways.
    pub fn around(
        Around {
            sideways_from,
            arc_m,
        }: Around,
    ) -> Self {
        Self {
            moves: [[0.0, 1.0 - sideways_from], [sideways_from, 1.0]],
            arc_m,
        }
    }

    /// The way back from a place on the other side of the stance leg: first sideways, then forward or backward.
    pub fn back_around(
        Around {
            sideways_from,
            arc_m,
        }: Around,
    ) -> Self {
        Self {
            moves: [[sideways_from, 1.0], [0.0, 1.0 - sideways_from]],
            arc_m,
        }
    }
}

/// A planned footstep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedFootstep {
    pub foot: Foot,
    /// Where the centre of its sole is to land (m), world frame.
    pub to: Point2<f64>,
    /// The ZMP error for which the footstep is taken (m), control frame.
    pub zmp_error: Vector2<f64>,
}

/// One footstep, from lift to landing.
#[derive(Debug, Clone, PartialEq)]
pub struct Swing {
    /// The footstep as chosen, with its present landing place.
    pub footstep: PlannedFootstep,
    timing: SwingTiming,
    /// Pose of the stance sole in the world, flat on the ground.
    pub stance: Isometry2<f64>,
    /// Path of the swing sole's centre: x and y along the stance axes, and the height, without the bump that lifts the
    /// sole off the ground.
    path: [Quintic; 3],
    /// Shares of the swing between which each axis moves.
    moves: [[f64; 2]; 3],
    /// Largest displacement that the arc adds along the stance sole's x axis (m).
    arc_m: f64,
    /// Pose of the swing sole at the lift, and at its landing.
    from: Pose,
    pub to: Pose,
    /// Time since the lift (s).
    pub time_s: f64,
}

impl Swing {
    /// A footstep that starts from the given footholds (world frame).
    pub fn new(
        timing: SwingTiming,
        way: Way,
        footstep: PlannedFootstep,
        footholds: &PerFoot<Pose>,
    ) -> Self {
        let [from, foothold] = [footstep.foot, footstep.foot.other()].map(|foot| footholds[foot]);
        let stance = on_ground(&foothold);
        let to = along(&foothold, footstep.to);
        let landing = to.translation.vector;
        let local = |place: Vector3<f64>| {
            let over = stance.inverse_transform_point(&place.xy().into());
            [over.x, over.y, place.z]
        };
        let (start, end) = (local(from.translation.vector), local(landing));
        let Way {
            moves: [x, y],
            arc_m,
        } = way;
        let moves = [x, y, [0.0, 1.0]];
        let path = [0, 1, 2].map(|k| {
            let [start_s, end_s] = moves[k].map(|share| share * timing.swing_time_s);
            Quintic::new([start[k], 0.0, 0.0], end[k], start_s, end_s)
        });
        Self {
            footstep,
            timing,
            stance,
            path,
            moves,
            arc_m,
            from,
            to,
            time_s: 0.0,
        }
    }

    /// Changes the landing place (m, world frame), starting from the present planned state, before the landing is due.
    /// An axis whose motion has ended, or ends within the share `ARRIVED` of the swing, keeps its path.
    pub fn aim(&mut self, to: Point2<f64>) {
        self.to = along(&self.to, to);
        let local = self.stance.inverse_transform_point(&to);
        let end = [local.x, local.y, self.to.translation.z];
        for (k, end) in end.into_iter().enumerate() {
            let [start_s, end_s] = self.moves[k].map(|share| share * self.timing.swing_time_s);
            let now_s = self.time_s.max(start_s);
            if now_s < end_s - ARRIVED * self.timing.swing_time_s {
                self.path[k] = Quintic::new(self.path[k].at(now_s), end, now_s, end_s);
            }
        }
        self.footstep.to = to;
    }

    /// The sole at its landing, world frame.
    pub fn landing(&self) -> Pose {
        self.to
    }

    /// State of one axis of the path (place, velocity, acceleration).
    fn axis(&self, k: usize) -> [f64; 3] {
        self.path[k].at(self.time_s.max(self.moves[k][0] * self.timing.swing_time_s))
    }

    /// Place, velocity and acceleration over the ground, world frame.
    fn over_ground(&self) -> [Vector2<f64>; 3] {
        let (x, y, arc) = (self.axis(0), self.axis(1), self.bump(self.arc_m, 0.0));
        let turned = |i: usize| self.stance.rotation * Vector2::new(x[i] + arc[i], y[i]);
        [
            self.stance.translation.vector + turned(0),
            turned(1),
            turned(2),
        ]
    }

    /// Share of the planned swing time that has passed.
    pub fn share(&self) -> f64 {
        self.time_s / self.timing.swing_time_s
    }

    /// Time left until the landing is due (s).
    pub fn time_left_s(&self) -> f64 {
        self.timing.swing_time_s - self.time_s
    }

    /// Acceleration of the swing sole (m/s^2), world frame.
    pub fn sole_acc(&self) -> Vector3<f64> {
        let [.., over] = self.over_ground();
        let [.., bump] = self.bump(self.timing.lift_m, self.timing.lead);
        Vector3::new(over.x, over.y, self.axis(2)[2] + bump)
    }

    /// Planned pose of the swing sole now, and its velocity (m/s), world frame.
    pub fn sole(&self) -> (Pose, Vector3<f64>) {
        let ([at, vel, _], [z, vz, _]) = (self.over_ground(), self.axis(2));
        let ([x, y], [vx, vy]): ([f64; 2], [f64; 2]) = (at.into(), vel.into());
        let [bump, bump_rate, _] = self.bump(self.timing.lift_m, self.timing.lead);
        let late_s = (self.time_s - self.timing.swing_time_s).max(0.0);
        let late_speed = if late_s > 0.0 {
            self.timing.late_speed_m_s
        } else {
            0.0
        };
        let place = Vector3::new(x, y, z + bump - self.timing.late_speed_m_s * late_s);
        let turned = least_jerk(self.share());
        let rotation = self.from.rotation.slerp(&self.to.rotation, turned);
        (
            Pose::from_parts(place.into(), rotation),
            Vector3::new(vx, vy, vz + bump_rate - late_speed),
        )
    }

    /// A bump of `height` on the way, with its rate (1/s) and acceleration (1/s^2). `lead` is defined in [`SwingTiming`].
    pub fn bump(&self, height: f64, lead: f64) -> [f64; 3] {
        let duration = self.timing.swing_time_s;
        let u = self.share().min(1.0);
        let (w, rate) = (u + lead * u * (1.0 - u), 1.0 + lead * (1.0 - 2.0 * u));
        let [value, slope, curvature] = bump(height, w);
        [
            value,
            slope * rate / duration,
            (curvature * rate * rate - 2.0 * lead * slope) / (duration * duration),
        ]
    }

    /// Whether the planned landing time is reached.
    pub fn is_due(&self) -> bool {
        self.time_s >= (1.0 - ROUNDING) * self.timing.swing_time_s
    }

    /// Whether a sole that carries load has landed.
    pub fn has_landed(&self, carries: bool) -> bool {
        carries && self.time_s >= EARLIEST_LANDING * self.timing.swing_time_s
    }

    /// Whether the foot is so late that the swing ends without a landing.
    pub fn is_overdue(&self) -> bool {
        self.time_s >= (1.0 - ROUNDING) * (self.timing.swing_time_s + self.timing.late_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::estimate::heading;
    use nalgebra::UnitQuaternion;

    const TIMING: SwingTiming = SwingTiming {
        swing_time_s: 0.2,
        lift_m: 0.025,
        lead: 0.5,
        late_s: 0.12,
        late_speed_m_s: 0.1,
    };
    const DT: f64 = 0.002;

    fn flat(x: f64, y: f64, yaw: f64) -> Pose {
        Pose::from_parts(
            Vector3::new(x, y, 0.0).into(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw),
        )
    }

    /// A footstep back and to the right, by a right foot that is turned a little.
    fn swing() -> Swing {
        let to = Point2::new(-0.1, -0.13);
        let footstep = PlannedFootstep {
            foot: Foot::Right,
            to,
            zmp_error: Vector2::new(-0.03, -0.04),
        };
        let footholds = PerFoot {
            left: flat(0.01, 0.048, 0.1),
            right: flat(-0.01, -0.05, -0.05),
        };
        Swing::new(TIMING, Way::STRAIGHT, footstep, &footholds)
    }

    fn at(time_s: f64) -> Swing {
        Swing { time_s, ..swing() }
    }

    #[test]
    fn the_sole_goes_from_its_foothold_to_the_landing_place() {
        let (start, velocity) = at(0.0).sole();
        assert!((start.translation.vector - Vector3::new(-0.01, -0.05, 0.0)).norm() < 1e-15);
        // The velocity is a sum of terms of some m/s that cancel.
        assert!((heading(&start) + 0.05).abs() < 1e-15 && velocity.norm() < 1e-14);
        let (end, velocity) = at(TIMING.swing_time_s).sole();
        assert!((end.translation.vector - Vector3::new(-0.1, -0.13, 0.0)).norm() < 1e-15);
        // It lands parallel to the stance foot.
        assert!((heading(&end) - 0.1).abs() < 1e-12 && velocity.norm() == 0.0);
    }

    #[test]
    fn with_a_lead_the_sole_is_highest_early_and_comes_down_slowly() {
        let without = |time_s: f64| Swing {
            timing: SwingTiming {
                lead: 0.0,
                ..TIMING
            },
            ..at(time_s)
        };
        let due = TIMING.swing_time_s;
        assert!((without(0.5 * due).sole().0.translation.z - TIMING.lift_m).abs() < 1e-15);
        // u + 1/2 u (1 - u) is 1/2 at u = (3 - sqrt 5) / 2.
        let (highest, velocity) = at(0.5 * (3.0 - 5.0_f64.sqrt()) * due).sole();
        assert!((highest.translation.z - TIMING.lift_m).abs() < 1e-15 && velocity.z.abs() < 1e-12);
        for left_s in [0.01, 0.02, 0.03] {
            let [slow, fast] =
                [at(due - left_s), without(due - left_s)].map(|swing| -swing.sole().1.z);
            assert!(
                slow > 0.0 && slow < 0.6 * fast,
                "{left_s} s before the landing: {slow}, not {fast} m/s"
            );
        }
    }

    #[test]
    fn velocity_and_acceleration_of_the_sole_are_slopes_and_it_stays_above_the_ground() {
        for k in 1..160 {
            let time = f64::from(k) * DT;
            let place = |time: f64| at(time).sole().0.translation.vector;
            let slope = (place(time + 1e-6) - place(time - 1e-6)) / 2e-6;
            let (pose, velocity) = at(time).sole();
            // The path has a kink at the planned landing time.
            if (time - TIMING.swing_time_s).abs() > 1e-5 {
                assert!(
                    (velocity - slope).norm() < 1e-6,
                    "{time} s: {velocity} {slope}"
                );
            }
            if time < TIMING.swing_time_s {
                assert!(pose.translation.z > 0.0, "{time} s: {pose}");
                let slope = (at(time + 1e-6).sole().1 - at(time - 1e-6).sole().1) / 2e-6;
                assert!((at(time).sole_acc() - slope).norm() < 1e-4, "{time} s");
            }
        }
    }

    #[test]
    fn a_late_foot_goes_down_and_gives_up() {
        let due = TIMING.swing_time_s;
        let (pose, velocity) = at(due + 0.05).sole();
        assert!(
            (pose.translation.vector - Vector3::new(-0.1, -0.13, -0.05 * TIMING.late_speed_m_s))
                .norm()
                < 1e-15
        );
        assert_eq!(velocity, Vector3::new(0.0, 0.0, -TIMING.late_speed_m_s));
        assert!(!at(due + TIMING.late_s - DT).is_overdue());
        assert!(at(due + TIMING.late_s).is_overdue(), "it is late for good");
        assert!(!at(due + TIMING.late_s).has_landed(false), "but not landed");
        assert!(at(due).is_due() && !at(due - DT).is_due());
    }

    #[test]
    fn a_foot_lands_when_it_carries_but_not_before_it_has_left() {
        let due = TIMING.swing_time_s;
        assert!(!at(DT).has_landed(true), "it has not yet left the ground");
        assert!(!at(0.59 * due).has_landed(true));
        assert!(at(0.61 * due).has_landed(true), "early");
        assert!(at(due).has_landed(true) && !at(due).has_landed(false));
    }
}
