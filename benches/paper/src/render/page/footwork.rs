//! The foot and landing place that the paper's procedure chooses (Fig. 6, 12, 13), computed by the controller's own
//! rule.

use super::study::{Stand, Study};
use nalgebra::{Isometry2, Point2, Vector2};
use standfast::core::control::step::PlannedFootstep;
use standfast::core::control::step::paper::{StanceState, choose};
use standfast::core::lipm::pendulum::State;
use standfast::core::robot::{Foot, PerFoot};

/// Directions of the examples of Fig. 6 (degrees), read from the arrows in the paper's picture.
pub const EXAMPLES_DEG: [f64; 2] = [45.0, -45.0];
/// Difference of the feet's reaches below which they count as equal, as they do for the controller (m).
const TIE_M: f64 = 1e-4;
/// Time over which the ZMP is predicted (s).
const AHEAD_S: f64 = 3.0;

/// The choice of a foot at home, with equal loads, for a ZMP error so large that the footstep is as long as it can be.
pub struct Choice {
    /// Direction of the error, a unit vector.
    pub direction: Vector2<f64>,
    /// Length of Delta_max of each foot (m).
    pub reach: PerFoot<f64>,
    /// The foot and its landing place (m). None if neither foot can go that way.
    pub chosen: Option<(Foot, Point2<f64>)>,
}

impl Study {
    /// The foot that is chosen for a ZMP error (m) with equal loads on both feet, and its way (m; x forward, y left).
    /// None if neither foot can go that way.
    pub fn choose(&self, zmp_error: Vector2<f64>) -> Option<(Foot, Vector2<f64>)> {
        let load_n = 0.5 * self.robot.weight_n();
        let PlannedFootstep { foot, to, .. } = self.choose_under(
            PerFoot {
                left: load_n,
                right: load_n,
            },
            zmp_error,
        )?;
        Some((foot, to - self.sole_at_home(foot)))
    }

    /// The footstep for a ZMP error (m) and a load on each foot (N), which decides a tie.
    fn choose_under(
        &self,
        load_n: PerFoot<f64>,
        zmp_error: Vector2<f64>,
    ) -> Option<PlannedFootstep> {
        let stance = StanceState {
            frame: &Isometry2::identity(),
            soles: PerFoot::from_fn(|foot| self.sole_at_home(foot)),
            stance: self.stance,
            zmp_error,
            load_n,
            can_lift: PerFoot {
                left: true,
                right: true,
            },
        };
        choose(&self.rules, &stance)
    }

    /// Length of Delta_max of each foot along a unit vector (m).
    pub fn reach(&self, direction: Vector2<f64>) -> PerFoot<f64> {
        let side = |foot: Foot, v: Vector2<f64>| Vector2::new(v.x, v.y * foot.side());
        PerFoot::from_fn(|foot| {
            self.rules
                .range
                .reach(side(foot, self.stance * foot.side()), side(foot, direction))
        })
    }

    /// The choice for a direction (degrees; 0 is forward, 90 to the left).
    pub fn choice(&self, deg: f64) -> Choice {
        let direction = unit(deg);
        let chosen = self.choose(direction * self.rules.range.outward_m);
        let chosen = chosen.map(|(foot, way)| (foot, self.sole_at_home(foot) + way));
        Choice {
            direction,
            reach: self.reach(direction),
            chosen,
        }
    }

    /// Whether a footstep of this foot for this ZMP error (m) is as long as its range allows (eq. 29).
    pub fn is_at_most(&self, foot: Foot, zmp_error: Vector2<f64>) -> bool {
        self.rules.alpha * zmp_error.norm() >= self.reach(zmp_error.normalize())[foot]
    }

    /// The ZMP error (m, control frame) of a state if its size were the plain distance from the region, and the foot
    /// that would then be lifted. None if there is no region or no footstep.
    pub fn by_plain_distance(&self, stand: &Stand) -> Option<(Vector2<f64>, Foot)> {
        let family = &self.design.family;
        let allowed = stand.polygon.inset(family.zmp_margin)?;
        let State { x, y } = stand.state;
        let (com, com_vel) = (Point2::new(x[0], y[0]), Vector2::new(x[1], y[1]));
        let mut state = State::new(com, com_vel, allowed.nearest(stand.state.zmp()));
        let mut farthest = Vector2::<f64>::zeros();
        for _ in 0..(AHEAD_S / family.pendulum.dt) as usize {
            let outside = state.zmp() - allowed.nearest(state.zmp());
            if outside.norm() > farthest.norm() {
                farthest = outside;
            }
            state = family.gains[0].successor(&state);
        }
        Some((farthest, self.choose_under(stand.load_n, farthest)?.foot))
    }
}

/// Whether both reaches count as equal for the choice of the foot.
pub fn is_tie(reach: &PerFoot<f64>) -> bool {
    (reach.left - reach.right).abs() <= TIE_M
}

/// The unit vector of a direction (degrees).
fn unit(deg: f64) -> Vector2<f64> {
    let (sin, cos) = deg.to_radians().sin_cos();
    Vector2::new(cos, sin)
}
