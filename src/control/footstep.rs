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
    /// Feet that can be stood on.
    pub in_contact: PerFoot<bool>,
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
        let can_lift = necessity.in_contact[foot.other()];
        if can_lift { rules.range.reach(side(necessity.stance * foot.side()), side(direction)) } else { 0.0 }
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
