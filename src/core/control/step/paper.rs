//! The paper's footwork (Sect. V). When the state has been in no CPI set for a while, swing foot and landing place are
//! decided once. COM and ZMP then follow the plan by relaxed boundary conditions ([`AxisPlan`]) without feedback until
//! the foot lands.
//!
//! Each foot may land in a semi-ellipse beside the other (eq. 27, 28), and moves along the direction of the ZMP error.
//! The foot that can go farther in that direction is chosen. Its stride is alpha times the error (eq. 29), within the
//! semi-ellipse.
//!
//! The paper takes one footstep, from home. Here more may follow, and after the first one the feet are apart. The
//! stride is then measured from the place beside the other foot where the foot would stand at home. If it were measured
//! from the foot's actual place, behind or ahead, it could leave the semi-ellipse at once.

use super::footwork::{Footwork, StepState};
use super::swing::{LATE_SPEED, PlannedFootstep, Swing, SwingTiming, Way};
use crate::control::body::{Body, SoleReference, carry};
use crate::control::stand::Support;
use crate::lipm::relaxation::{AxisPlan, Boundary};
use crate::lipm::stepping::Stepping;
use crate::robot::{Foot, PerFoot};
use crate::socket::{Command, TickError};
use nalgebra::{Isometry2, Point2, Vector2};

/// The rule, with the plan of the footstep in the air.
#[derive(Debug, Clone)]
pub struct PaperFootwork {
    rules: Stepping,
    plan: Option<StepPlan>,
}

impl PaperFootwork {
    pub fn new(rules: Stepping) -> Self {
        Self { rules, plan: None }
    }
}

impl Footwork for PaperFootwork {
    fn copy(&self) -> Box<dyn Footwork> {
        Box::new(self.clone())
    }

    fn lift(&mut self, now: &StepState, _: &mut Body) -> Option<Swing> {
        let (rules, estimate, family) = (&self.rules, now.estimate, &now.design.family);
        if !now.has_waited(rules.patience_s, rules.pause_s) {
            return None;
        }
        let footstep = choose(rules, &StanceState::of(now, &now.support()))?;
        if let Some(landing) = now
            .last_landing
            .filter(|landing| landing.foot == footstep.foot)
            && !now.has_passed(landing.ago_s, rules.same_foot_pause_s)
        {
            return None;
        }
        let Stepping {
            swing_time_s,
            lift_m,
            late_s,
            ..
        } = *rules;
        let late_speed_m_s = LATE_SPEED * now.design.units.speed_m_s();
        let timing = SwingTiming {
            swing_time_s,
            lift_m,
            lead: 0.0,
            late_s,
            late_speed_m_s,
        };
        let swing = Swing::new(timing, Way::STRAIGHT, footstep, &estimate.footholds);
        let half_sole_m = now.design.robot.soles[footstep.foot.other()].half_m;
        let (omega, com, com_vel) = (
            family.pendulum.omega,
            estimate.com_xy(),
            estimate.com_vel_xy(),
        );
        self.plan = Some(StepPlan::new(
            omega,
            rules,
            half_sole_m,
            family.zmp_margin,
            &swing,
            com,
            com_vel,
        ));
        Some(swing)
    }

    fn swing(
        &mut self,
        now: &StepState,
        swing: &mut Swing,
        body: &mut Body,
        command: &mut Command,
    ) -> Result<Point2<f64>, TickError> {
        let (robot, pendulum) = (&*now.design.robot, &now.design.family.pendulum);
        let planned = self
            .plan
            .as_ref()
            .ok_or(TickError::Unsolvable)?
            .at(swing.time_s);
        (body.com.place, body.com.vel) = (planned.com, planned.com_vel);
        let acceleration = pendulum.com_acc(planned.com, planned.zmp);
        let foot = swing.footstep.foot;
        let mut soles = SoleReference {
            poses: now.estimate.footholds,
            velocities: PerFoot::default(),
        };
        (soles.poses[foot], soles.velocities[foot]) = swing.sole();
        body.follow(robot, pendulum, now.estimate, soles, 0.0, command);
        let standing = PerFoot::from_fn(|f| f != foot);
        carry(
            robot,
            now.estimate,
            &standing,
            planned.zmp,
            acceleration,
            &mut command.tau_ff,
        );
        Ok(planned.zmp)
    }
}

/// Plan of COM and ZMP from lift to landing (Sect. V.A).
#[derive(Debug, Clone, PartialEq)]
struct StepPlan {
    /// Pose of the stance sole in the world, flat on the ground.
    stance: Isometry2<f64>,
    /// x and y in the stance sole's frame.
    axes: [AxisPlan; 2],
}

/// Planned horizontal COM, COM velocity and ZMP: world frame (m, m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
struct PlannedState {
    com: Point2<f64>,
    com_vel: Vector2<f64>,
    zmp: Point2<f64>,
}

impl StepPlan {
    /// Starts from the estimate at the lift. The ZMP stays at least `zmp_margin` (m) inside the stance sole.
    fn new(
        omega: f64,
        rules: &Stepping,
        half_sole_m: [f64; 2],
        zmp_margin: f64,
        swing: &Swing,
        com: Point2<f64>,
        com_vel: Vector2<f64>,
    ) -> Self {
        let stance = swing.stance;
        let [com, to] = [com, swing.footstep.to].map(|p| stance.inverse_transform_point(&p));
        let com_vel = stance.inverse_transform_vector(&com_vel);
        let axes = [0, 1].map(|axis| {
            let most = (half_sole_m[axis] - zmp_margin).max(0.0);
            let boundary = Boundary {
                com: com[axis],
                com_vel: com_vel[axis],
                target: 0.5 * to[axis],
                zmp: [-most, most],
            };
            AxisPlan::new(omega, rules, &boundary)
        });
        Self { stance, axes }
    }

    /// The plan at `time_s` (s) after the lift.
    fn at(&self, time_s: f64) -> PlannedState {
        let [[x, vx], [y, vy]] = self.axes.map(|axis| axis.com(time_s));
        let [zx, zy] = self.axes.map(|axis| axis.zmp(time_s));
        PlannedState {
            com: self.stance * Point2::new(x, y),
            com_vel: self.stance * Vector2::new(vx, vy),
            zmp: self.stance * Point2::new(zx, zy),
        }
    }
}

/// Difference of two strides below which they count as equal, in distances of the feet at home.
const SAME_STRIDE: f64 = 1e-3;
/// Difference of two loads below which they count as equal, as a share of their sum.
const SAME_LOAD: f64 = 0.006;

/// The state on which the choice of a footstep depends.
#[derive(Debug, Clone, Copy)]
pub struct StanceState<'a> {
    /// Pose of the control frame in the world.
    pub frame: &'a Isometry2<f64>,
    /// Centres of the soles on the ground (m), world frame.
    pub soles: PerFoot<Point2<f64>>,
    /// Vector from the centre of the right sole to the centre of the left one at home (m), control frame.
    pub stance: Vector2<f64>,
    /// The ZMP error, Delta p_Z in the paper (m), control frame.
    pub zmp_error: Vector2<f64>,
    /// Vertical force on each sole (N).
    pub load_n: PerFoot<f64>,
    /// Which feet can be lifted, because the other one is in contact.
    pub can_lift: PerFoot<bool>,
}

impl<'a> StanceState<'a> {
    fn of(now: &StepState, support: &'a Support) -> Self {
        let estimate = now.estimate;
        Self {
            frame: &support.frame,
            soles: PerFoot::from_fn(|foot| estimate.footholds[foot].translation.vector.xy().into()),
            stance: now.design.stance,
            zmp_error: now.zmp_error,
            load_n: estimate.load_n,
            can_lift: PerFoot::from_fn(|foot| estimate.in_contact[foot.other()]),
        }
    }
}

/// Chooses the footstep; None if neither foot can go in the direction of the error.
pub fn choose(rules: &Stepping, state: &StanceState) -> Option<PlannedFootstep> {
    let direction = state.zmp_error.try_normalize(0.0)?;
    let reach = PerFoot::from_fn(|foot| {
        let side = |v: Vector2<f64>| Vector2::new(v.x, v.y * foot.side());
        if state.can_lift[foot] {
            rules
                .range
                .reach(side(state.stance * foot.side()), side(direction))
        } else {
            0.0
        }
    });
    let foot = swing_foot(&reach, state.stance.norm(), &state.load_n);
    let stride = (rules.alpha * state.zmp_error.norm()).min(reach[foot]);
    let beside = state.stance * foot.side() + direction * stride;
    let to = state.soles[foot.other()] + state.frame.transform_vector(&beside);
    (stride > 0.0).then_some(PlannedFootstep {
        foot,
        to,
        zmp_error: state.zmp_error,
    })
}

/// The foot that can go farther. For a tie (a push straight forward or backward), the paper's text names the left foot,
/// and its experiment uses the right one. Here the foot with the smaller load goes, since it leaves the ground sooner.
/// If the loads are equal too, the right foot goes.
fn swing_foot(reach: &PerFoot<f64>, apart_m: f64, load_n: &PerFoot<f64>) -> Foot {
    let farther = reach.left - reach.right;
    let heavier = load_n.left - load_n.right;
    if farther.abs() > SAME_STRIDE * apart_m {
        if farther > 0.0 {
            Foot::Left
        } else {
            Foot::Right
        }
    } else if heavier < -SAME_LOAD * (load_n.left + load_n.right) {
        Foot::Left
    } else {
        Foot::Right
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Pose;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    /// Half the distance between the soles' centres at home (m).
    const HALF: f64 = 0.0485;
    const RULES: Stepping = Stepping {
        alpha: 1.0,
        ..Stepping::EXAMPLE
    };
    const EVEN: PerFoot<f64> = PerFoot {
        left: 39.0,
        right: 39.0,
    };

    struct Case {
        error: [f64; 2],
        load_n: PerFoot<f64>,
        can_lift: PerFoot<bool>,
        frame: Isometry2<f64>,
    }

    impl Case {
        fn new(error: [f64; 2]) -> Self {
            let can_lift = PerFoot {
                left: true,
                right: true,
            };
            Self {
                error,
                load_n: EVEN,
                can_lift,
                frame: Isometry2::identity(),
            }
        }

        /// Chooses from the home stance.
        fn choose(&self, rules: &Stepping) -> Option<PlannedFootstep> {
            choose(
                rules,
                &StanceState {
                    frame: &self.frame,
                    soles: PerFoot::from_fn(|foot| {
                        self.frame * Point2::new(0.0, HALF * foot.side())
                    }),
                    stance: Vector2::new(0.0, 2.0 * HALF),
                    zmp_error: self.error.into(),
                    load_n: self.load_n,
                    can_lift: self.can_lift,
                },
            )
        }
    }

    #[test]
    fn of_equal_ways_the_less_loaded_foot_goes_then_the_right_one() {
        for error in [[0.03, 0.0], [-0.03, 0.0]] {
            let mut case = Case::new(error);
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Right);
            case.load_n = PerFoot {
                left: 30.0,
                right: 48.0,
            };
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Left);
            case.load_n = PerFoot {
                left: 48.0,
                right: 30.0,
            };
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Right);
            // A difference within the noise does not count.
            case.load_n = PerFoot {
                left: 38.9,
                right: 39.1,
            };
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Right);
        }
        // The load does not matter if one foot can go farther, but a foot that carries the robot stays.
        let mut case = Case {
            load_n: PerFoot {
                left: 70.0,
                right: 8.0,
            },
            ..Case::new([0.03, 0.02])
        };
        for (left, right, foot) in [
            (true, true, Some(Foot::Left)),
            (false, true, Some(Foot::Right)),
            (false, false, None),
        ] {
            case.can_lift = PerFoot { left, right };
            assert_eq!(case.choose(&RULES).map(|footstep| footstep.foot), foot);
        }
        assert_eq!(
            Case::new([0.0, 0.0]).choose(&RULES),
            None,
            "without an error"
        );
        assert_eq!(
            Case::new([0.03, 0.0]).choose(&Stepping {
                alpha: 0.0,
                ..RULES
            }),
            None,
            "without a stride"
        );
    }

    #[test]
    fn the_stride_is_alpha_times_the_error_as_far_as_the_range_goes() {
        let stride = |alpha: f64, error: [f64; 2]| {
            let footstep = Case::new(error)
                .choose(&Stepping { alpha, ..RULES })
                .unwrap();
            (footstep.to - Point2::new(0.0, HALF * footstep.foot.side())).norm()
        };
        assert!((stride(1.0, [-0.03, -0.04]) - 0.05).abs() < 1e-15);
        assert!((stride(2.0, [0.03, 0.0]) - 0.06).abs() < 1e-15);
        // Outward the semi-ellipse ends 0.18 m from the other foot.
        assert!((stride(10.0, [0.0, 0.04]) - (0.18 - 2.0 * HALF)).abs() < 1e-12);
        let reach = RULES
            .range
            .reach(Vector2::new(0.0, 2.0 * HALF), Vector2::new(1.0, 0.0));
        assert!((stride(10.0, [0.03, 0.0]) - reach).abs() < 1e-12);
    }

    /// After a footstep the stride is measured from beside the stance foot, so that the feet come together again.
    #[test]
    fn the_next_footstep_is_measured_from_the_foot_that_stands() {
        let frame = Isometry2::identity();
        let state = StanceState {
            frame: &frame,
            soles: PerFoot {
                left: Point2::new(0.0, HALF),
                right: Point2::new(0.12, -HALF),
            },
            stance: Vector2::new(0.0, 2.0 * HALF),
            zmp_error: Vector2::new(0.03, 0.01),
            load_n: EVEN,
            can_lift: PerFoot {
                left: true,
                right: true,
            },
        };
        let footstep = choose(&RULES, &state).unwrap();
        assert_eq!(footstep.foot, Foot::Left);
        assert!(
            (footstep.to - Point2::new(0.12 + 0.03, HALF + 0.01)).norm() < 1e-12,
            "{footstep:?}"
        );
    }

    const OMEGA: f64 = 5.63;
    /// Half the length and half the width of the stance sole (m).
    const HALF_SOLE_M: [f64; 2] = [0.048, 0.0345];

    fn flat(x: f64, y: f64, yaw: f64) -> Pose {
        Pose::from_parts(
            Vector3::new(x, y, 0.0).into(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw),
        )
    }

    /// The plan for a footstep of the right foot, from a COM position (m) and velocity (m/s).
    fn plan(to: [f64; 2], com: [f64; 2], com_vel: [f64; 2], footholds: PerFoot<Pose>) -> StepPlan {
        let Stepping {
            swing_time_s,
            lift_m,
            late_s,
            ..
        } = RULES;
        let footstep = PlannedFootstep {
            foot: Foot::Right,
            to: to.into(),
            zmp_error: Vector2::x(),
        };
        let timing = SwingTiming {
            swing_time_s,
            lift_m,
            lead: 0.0,
            late_s,
            late_speed_m_s: 0.1,
        };
        let swing = Swing::new(timing, Way::STRAIGHT, footstep, &footholds);
        StepPlan::new(
            OMEGA,
            &RULES,
            HALF_SOLE_M,
            0.003,
            &swing,
            com.into(),
            com_vel.into(),
        )
    }

    /// Checks eq. 1 in the world frame, for a stance sole away from the origin and turned.
    #[test]
    fn the_pendulum_starts_at_the_estimate_and_its_zmp_stays_in_the_stance_sole() {
        let footholds = PerFoot {
            left: flat(0.01, 0.048, 0.1),
            right: flat(-0.01, -0.05, -0.05),
        };
        let plan = plan([-0.1, -0.13], [-0.01, 0.0], [-0.3, -0.2], footholds);
        let start = plan.at(0.0);
        assert!((start.com - Point2::new(-0.01, 0.0)).norm() < 1e-15);
        assert!((start.com_vel - Vector2::new(-0.3, -0.2)).norm() < 1e-14);
        let stance = Isometry2::new(Vector2::new(0.01, 0.048), 0.1);
        let [x, y] = HALF_SOLE_M.map(|half| half - 0.003 + 1e-12);
        for k in 1..100 {
            let (h, time) = (1e-4, f64::from(k) * 0.002);
            let [before, now, after] = [time - h, time, time + h].map(|t| plan.at(t));
            let velocity = (after.com - before.com) / (2.0 * h);
            assert!((velocity - now.com_vel).norm() < 1e-6, "{time} s");
            let acceleration = (after.com_vel - before.com_vel) / (2.0 * h);
            assert!(
                (acceleration - (now.com - now.zmp) * OMEGA * OMEGA).norm() < 1e-4,
                "{time} s"
            );
            let zmp = stance.inverse_transform_point(&now.zmp);
            assert!(zmp.x.abs() <= x && zmp.y.abs() <= y, "{time} s: {zmp}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(5), failure_persistence: None, ..Default::default() })]

        /// The footsteps mirror each other to the bit, except for a tie, which always goes to the same side.
        #[test]
        fn the_mirrored_error_moves_the_other_foot(
            x in -0.1..0.1f64, y in 0.005..0.1f64, alpha in 0.5..8.0f64, left in 0.0..70.0f64
        ) {
            let rules = Stepping { alpha, ..RULES };
            let load_n = PerFoot { left, right: 78.0 - left };
            let one = Case { load_n, ..Case::new([x, y]) }.choose(&rules).unwrap();
            let load_n = PerFoot { left: load_n.right, right: load_n.left };
            let other = Case { load_n, ..Case::new([x, -y]) }.choose(&rules).unwrap();
            prop_assert_eq!(one.foot, other.foot.other());
            prop_assert_eq!(one.to, Point2::new(other.to.x, -other.to.y));
        }

        /// The footstep depends on the control frame, and not on the world's origin.
        #[test]
        fn the_footstep_turns_and_moves_with_the_robot(
            x in -0.1..0.1f64, y in -0.1..0.1f64, at in [-3.0..3.0f64, -3.0..3.0f64], yaw in -3.0..3.0f64
        ) {
            let frame = Isometry2::new(at.into(), yaw);
            let (home, there) = (Case::new([x, y]).choose(&RULES), Case { frame, ..Case::new([x, y]) }.choose(&RULES));
            let (home, there) = (home.unwrap(), there.unwrap());
            prop_assert_eq!(home.foot, there.foot);
            prop_assert!((frame * home.to - there.to).norm() < 1e-12);
        }

        /// Every footstep ends in the semi-ellipse beside the other foot.
        #[test]
        fn no_footstep_leaves_the_range(x in -0.1..0.1f64, y in -0.1..0.1f64, alpha in 0.5..20.0f64) {
            let PlannedFootstep { foot, to, .. } = Case::new([x, y]).choose(&Stepping { alpha, ..RULES }).unwrap();
            let (ahead, aside) = (to.x, to.y * foot.side() + HALF);
            prop_assert!(aside >= 0.075 - 1e-12, "{} {}", ahead, aside);
            let round = (ahead / 0.15).powi(2) + ((aside - 0.075) / 0.105).powi(2);
            prop_assert!(round <= 1.0 + 1e-9, "{} {}", ahead, aside);
        }
    }
}
