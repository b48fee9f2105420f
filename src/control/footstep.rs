//! Which foot steps, and where to (paper, Sect. V.B).
//!
//! Each foot may land in a semi-ellipse beside the other (eq. 27, 28). It is moved along the direction of the ZMP error:
//! the foot that can go farther that way is chosen, and it goes as far as the error asks for, times alpha (eq. 29).
//!
//! The paper takes one footstep, from home. When the feet are apart after an earlier one, the way starts where the foot
//! would stand at home beside the other: from where it is, behind or ahead, it could leave its range at once.

use crate::lipm::stepping::Stepping;
use crate::robot::{Foot, PerFoot};
use nalgebra::{Isometry2, Point2, Vector2};

/// Ways that differ by less are equal (m).
const TIE_M: f64 = 1e-4;
/// Loads that differ by less are equal (N).
const TIE_N: f64 = 0.5;

/// What is known when a footstep becomes necessary.
#[derive(Debug, Clone, Copy)]
pub struct Necessity<'a> {
    /// Control frame to world.
    pub frame: &'a Isometry2<f64>,
    /// Centres of the soles on the ground, world.
    pub soles: PerFoot<Point2<f64>>,
    /// From the right sole's centre to the left's at home (m), control frame.
    pub stance: Vector2<f64>,
    /// The ZMP error Delta p_Z (m), control frame.
    pub zmp_error: Vector2<f64>,
    /// Vertical force on each sole (N).
    pub load_n: PerFoot<f64>,
    /// Feet that can be lifted: the other stands.
    pub can_lift: PerFoot<bool>,
}

/// A footstep that was chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footstep {
    /// The swing foot.
    pub foot: Foot,
    /// Where its sole's centre is to land, world.
    pub to: Point2<f64>,
    /// The ZMP error that asked for it (m), control frame.
    pub zmp_error: Vector2<f64>,
}

/// Chooses the footstep; None when neither foot can go that way.
pub fn choose(rules: &Stepping, necessity: &Necessity) -> Option<Footstep> {
    let direction = necessity.zmp_error.try_normalize(0.0)?;
    let reach = PerFoot::from_fn(|foot| {
        let side = |v: Vector2<f64>| Vector2::new(v.x, v.y * foot.side());
        if necessity.can_lift[foot] {
            rules.range.reach(side(necessity.stance * foot.side()), side(direction))
        } else {
            0.0
        }
    });
    let foot = swing_foot(&reach, &necessity.load_n);
    let stride = (rules.alpha * necessity.zmp_error.norm()).min(reach[foot]);
    let beside = necessity.stance * foot.side() + direction * stride;
    let to = necessity.soles[foot.other()] + necessity.frame.transform_vector(&beside);
    (stride > 0.0).then_some(Footstep { foot, to, zmp_error: necessity.zmp_error })
}

/// The foot with the longer way. The paper leaves a tie (a push straight fore or aft) to the left foot in its text and
/// to the right one in its experiment: here the foot that carries less goes, which is soonest in the air, else the right.
fn swing_foot(reach: &PerFoot<f64>, load_n: &PerFoot<f64>) -> Foot {
    let farther = reach.left - reach.right;
    let heavier = load_n.left - load_n.right;
    if farther.abs() > TIE_M {
        if farther > 0.0 { Foot::Left } else { Foot::Right }
    } else if heavier < -TIE_N {
        Foot::Left
    } else {
        Foot::Right
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    /// Half the distance of the soles' centres at home (m).
    const HALF: f64 = 0.0485;
    const RULES: Stepping = Stepping { alpha: 1.0, ..Stepping::EXAMPLE };
    const EVEN: PerFoot<f64> = PerFoot { left: 39.0, right: 39.0 };

    struct Case {
        error: [f64; 2],
        load_n: PerFoot<f64>,
        can_lift: PerFoot<bool>,
        frame: Isometry2<f64>,
    }

    impl Case {
        fn new(error: [f64; 2]) -> Self {
            let can_lift = PerFoot { left: true, right: true };
            Self { error, load_n: EVEN, can_lift, frame: Isometry2::identity() }
        }

        /// From home.
        fn choose(&self, rules: &Stepping) -> Option<Footstep> {
            let sole = |foot: Foot| self.frame * Point2::new(0.0, HALF * foot.side());
            choose(
                rules,
                &Necessity {
                    frame: &self.frame,
                    soles: PerFoot::from_fn(sole),
                    stance: Vector2::new(0.0, 2.0 * HALF),
                    zmp_error: self.error.into(),
                    load_n: self.load_n,
                    can_lift: self.can_lift,
                },
            )
        }
    }

    fn chosen(error: [f64; 2]) -> Footstep {
        Case::new(error).choose(&RULES).unwrap()
    }

    #[test]
    fn the_foot_on_the_side_of_the_error_goes() {
        // Fig. 6: (A) points to the left, (B) to the right.
        assert_eq!(chosen([0.03, 0.02]).foot, Foot::Left);
        assert_eq!(chosen([0.03, -0.02]).foot, Foot::Right);
        // Sect. V.C and VI: driven diagonally backward right, the right foot steps diagonally backward right.
        let footstep = chosen([-0.03, -0.0685]);
        assert_eq!(footstep.foot, Foot::Right);
        assert!(footstep.to.x < 0.0 && footstep.to.y < -HALF, "{footstep:?}");
        assert_eq!(footstep.zmp_error, Vector2::new(-0.03, -0.0685));
        // Driven backward, a foot steps backward.
        let footstep = chosen([-0.03, 0.0]);
        assert!((footstep.to.x + 0.03).abs() < 1e-15 && footstep.to.y.abs() == HALF, "{footstep:?}");
    }

    #[test]
    fn of_equal_ways_the_less_loaded_foot_goes_then_the_right_one() {
        for error in [[0.03, 0.0], [-0.03, 0.0]] {
            let mut case = Case::new(error);
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Right);
            case.load_n = PerFoot { left: 30.0, right: 48.0 };
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Left);
            case.load_n = PerFoot { left: 48.0, right: 30.0 };
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Right);
            // Noise is no difference.
            case.load_n = PerFoot { left: 38.9, right: 39.1 };
            assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Right);
        }
        // The load does not matter where one way is longer.
        let case = Case { load_n: PerFoot { left: 70.0, right: 8.0 }, ..Case::new([0.03, 0.02]) };
        assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Left);
    }

    #[test]
    fn the_stride_is_alpha_times_the_error_as_far_as_the_range_goes() {
        let stride = |alpha: f64, error: [f64; 2]| {
            let footstep = Case::new(error).choose(&Stepping { alpha, ..RULES }).unwrap();
            (footstep.to - Point2::new(0.0, HALF * footstep.foot.side())).norm()
        };
        assert!((stride(1.0, [-0.03, -0.04]) - 0.05).abs() < 1e-15);
        assert!((stride(2.0, [0.03, 0.0]) - 0.06).abs() < 1e-15);
        // Outward the semi-ellipse ends 0.18 m from the other foot.
        assert!((stride(10.0, [0.0, 0.04]) - (0.18 - 2.0 * HALF)).abs() < 1e-12);
        let reach = RULES.range.reach(Vector2::new(0.0, 2.0 * HALF), Vector2::new(1.0, 0.0));
        assert!((stride(10.0, [0.03, 0.0]) - reach).abs() < 1e-12);
    }

    #[test]
    fn a_foot_is_lifted_only_beside_one_that_stands() {
        let case = Case { can_lift: PerFoot { left: false, right: true }, ..Case::new([0.03, 0.02]) };
        assert_eq!(case.choose(&RULES).unwrap().foot, Foot::Right, "the left foot carries the robot");
        let case = Case { can_lift: PerFoot { left: false, right: false }, ..Case::new([0.03, 0.02]) };
        assert_eq!(case.choose(&RULES), None);
    }

    #[test]
    fn without_an_error_or_a_stride_there_is_no_footstep() {
        assert_eq!(Case::new([0.0, 0.0]).choose(&RULES), None);
        assert_eq!(Case::new([0.03, 0.0]).choose(&Stepping { alpha: 0.0, ..RULES }), None);
    }

    /// After a footstep the way starts beside the foot that stands, so that the feet come together again.
    #[test]
    fn the_next_footstep_is_measured_from_the_foot_that_stands() {
        let frame = Isometry2::identity();
        let necessity = Necessity {
            frame: &frame,
            soles: PerFoot { left: Point2::new(0.0, HALF), right: Point2::new(0.12, -HALF) },
            stance: Vector2::new(0.0, 2.0 * HALF),
            zmp_error: Vector2::new(0.03, 0.01),
            load_n: EVEN,
            can_lift: PerFoot { left: true, right: true },
        };
        let footstep = choose(&RULES, &necessity).unwrap();
        assert_eq!(footstep.foot, Foot::Left);
        assert!((footstep.to - Point2::new(0.12 + 0.03, HALF + 0.01)).norm() < 1e-12, "{footstep:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(5), failure_persistence: None, ..Default::default() })]

        /// To the bit, but for a tie, which must go to one side.
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

        /// The control frame is where the robot is, not where the world's origin is.
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

        /// Wherever the foot goes, it lands in the semi-ellipse beside the other one.
        #[test]
        fn no_footstep_leaves_the_range(x in -0.1..0.1f64, y in -0.1..0.1f64, alpha in 0.5..20.0f64) {
            let Footstep { foot, to, .. } = Case::new([x, y]).choose(&Stepping { alpha, ..RULES }).unwrap();
            let (ahead, aside) = (to.x, to.y * foot.side() + HALF);
            prop_assert!(aside >= 0.075 - 1e-12, "{} {}", ahead, aside);
            let round = (ahead / 0.15).powi(2) + ((aside - 0.075) / 0.105).powi(2);
            prop_assert!(round <= 1.0 + 1e-9, "{} {}", ahead, aside);
        }
    }
}
