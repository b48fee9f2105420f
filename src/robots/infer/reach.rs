//! Where a foot can land and how soon: regions of landing places that the legs reach without touching, with times in
//! which their motors can swing a foot there.
//!
//! A far place takes longer to reach. While the foot swings for the time T, the DCM moves away from the feet by the
//! factor `e^(omega T)`, so a footstep of length x is worth `x e^(-omega T)`. Each region is extended as long as this
//! worth grows. A region has one time, that of its slowest corner; so one in which legs cross is narrowed where that is worth
//! more.

use super::clearance::Hulls;
use super::figures::to_decimals;
use super::limbs::Limbs;
use standfast_core::robot::swing_time::{SwingMotion, least_swing_time_s};
use standfast_core::robot::{Around, Foot, Kinematics, LandingRegion, Robot};

/// Gap that the legs keep during a swing, and gap between soles that stand beside or behind each other, in COM heights.
const GAP: f64 = 0.0065;
const SOLE_GAP: f64 = 0.02;
/// Number of the first joints of a leg that are those of its hip.
const HIP: usize = 3;
/// Grids of landing places: step and number of places forward or backward, and outward, in COM heights.
const FORWARD: (f64, usize) = (0.06, 8);
const OUTWARD: (f64, usize) = (0.045, 6);
/// How a foot goes around the stance leg: see [`Around`]; the arc is in COM heights.
const SIDEWAYS_FROM: f64 = 0.25;
const ARCS: [f64; 2] = [0.0, 0.065];
/// Regions that cross, in COM heights: how far their places lie beyond the middle of the stance sole, the depths of the
/// regions, and the grid of their near ends.
const ACROSS: [f64; 2] = [0.1, 0.05];
const DEPTHS: [f64; 2] = [0.08, 0.02];
const ENDS: (f64, usize) = (0.02, 8);
/// By how much narrower a region that crosses may be than what the legs reach without touching, in COM heights.
const NARROWER: [f64; 4] = [0.0, 0.025, 0.05, 0.075];
/// Slack of the times: the factor on a time, and the unit to which it is rounded up (s).
const SLACK: f64 = 1.015;
const TIME_UNIT_S: f64 = 0.005;
/// Number of postures of a swing at which the legs must not touch.
const POSTURES: usize = 20;

/// A length in whole millimetres that is not less (`sign` 1) or not more (-1).
fn outwards(length_m: f64, sign: f64) -> f64 {
    to_decimals(sign * (sign * 1e3 * length_m).ceil() / 1e3, 3)
}

/// The regions of a robot whose home posture and servos are known, the one at home first; and warnings.
pub fn find(robot: &Robot, limbs: &Limbs) -> (Vec<LandingRegion>, Vec<String>) {
    let search = ReachSearch::new(robot, limbs);
    let beside = match search.beside() {
        Ok(beside) => beside,
        Err(why) => {
            let warning = format!(
                "no landing places were found that the legs reach without touching ({why}), so that the robot takes no \
                 footsteps: state [[reach]] by hand"
            );
            return (Vec::new(), vec![warning]);
        }
    };
    let inward_m = beside.y_m[0];
    let crossing = [("in front", 1.0), ("behind", -1.0)]
        .map(|(name, sign)| search.across(name, sign, inward_m));
    (
        std::iter::once(beside)
            .chain(crossing.into_iter().flatten())
            .collect(),
        Vec::new(),
    )
}

struct ReachSearch<'a> {
    robot: &'a Robot,
    hulls: Hulls,
    /// Pairs of a link of one leg and a link of the other.
    pairs: Vec<[usize; 2]>,
    /// COM height (m), and rate at which the DCM moves away (1/s).
    height_m: f64,
    omega: f64,
    /// Distance of the soles at home in y, and their length and width (m).
    apart_m: f64,
    sole_m: [f64; 2],
}

impl<'a> ReachSearch<'a> {
    fn new(robot: &'a Robot, limbs: &Limbs) -> Self {
        let kinematics = Kinematics::at_home(robot);
        let [left, right] = Foot::BOTH.map(|foot| kinematics.sole_pose(robot, foot).translation.y);
        let right_links: Vec<usize> = Limbs::links(&limbs.legs.right).collect();
        let (hulls, gap_m) = (Hulls::of(robot), GAP * robot.home_com_height());
        let hips: Vec<usize> = Foot::BOTH
            .into_iter()
            .flat_map(|foot| Limbs::links(&limbs.legs[foot][..HIP.min(limbs.legs[foot].len())]))
            .collect();
        // Hips that are as near as this at home are held apart by the pelvis.
        let are_hips = |pair: [usize; 2]| pair.iter().all(|link| hips.contains(link));
        let pairs = Limbs::links(&limbs.legs.left)
            .flat_map(|a| right_links.iter().map(move |&b| [a, b]))
            .filter(|&pair| !are_hips(pair) || hulls.gap_m(&kinematics, pair, gap_m) >= gap_m)
            .collect();
        let sole_m =
            [0, 1].map(|axis| robot.soles.left.half_m[axis] + robot.soles.right.half_m[axis]);
        Self {
            robot,
            hulls,
            pairs,
            height_m: robot.home_com_height(),
            omega: robot.omega(),
            apart_m: left - right,
            sole_m,
        }
    }

    /// The least time (s) to a place; None if it is out of reach.
    fn time_s(&self, to: [f64; 2], around: Around) -> Option<f64> {
        Some(SwingMotion::new(self.robot, Foot::Left, to, around)?.least_time_s())
    }

    /// Fails, in words, unless the legs keep apart during a swing to a place.
    fn check_clear(&self, foot: Foot, to: [f64; 2], around: Around) -> Result<(), String> {
        let gap_m = GAP * self.height_m;
        let mut kinematics = Kinematics::new(self.robot);
        let mut swing = SwingMotion::new(self.robot, foot, to, around);
        for i in 0..=POSTURES {
            let share = i as f64 / POSTURES as f64;
            let Some(posture) = swing.as_mut().and_then(|swing| swing.posture(share)) else {
                let [x, y] = to.map(|length| 1e3 * length);
                return Err(format!(
                    "the {} foot does not get {x:.0} mm forward and {y:.0} mm to its side",
                    foot.name()
                ));
            };
            kinematics.update(self.robot, posture);
            let near = |pair: &&[usize; 2]| self.hulls.gap_m(&kinematics, **pair, gap_m) < gap_m;
            if let Some(pair) = self.pairs.iter().find(near) {
                let [a, b] = pair.map(|link| &*self.robot.links[link].name);
                return Err(format!("{a} meets {b}"));
            }
        }
        Ok(())
    }

    /// The worth of a footstep of this length after this time (m).
    fn worth(&self, way_m: f64, time_s: f64) -> f64 {
        way_m * (-self.omega * time_s).exp()
    }

    /// The region at the side of the stance foot.
    fn beside(&self) -> Result<LandingRegion, String> {
        let straight = Around::default();
        // The places forward and backward whose footsteps are worth most.
        let ends = [-1.0, 1.0].map(|sign| {
            let places = (1..=FORWARD.1).map(|k| sign * FORWARD.0 * k as f64 * self.height_m);
            let timed = places.map_while(|x| Some((x, self.time_s([x, self.apart_m], straight)?)));
            timed.max_by(|a, b| {
                self.worth(a.0.abs(), a.1)
                    .total_cmp(&self.worth(b.0.abs(), b.1))
            })
        });
        let [Some((mut back, back_s)), Some((mut front, front_s))] = ends else {
            return Err("no foot gets forward or backward by a short footstep".into());
        };
        let mut time_s = back_s.max(front_s);
        let way_m = |back: f64, front: f64| 0.5 * (front - back);
        let mut best = (self.worth(way_m(back, front), time_s), self.apart_m);
        // The place outward that is worth most. The corners take longer than the ends.
        for k in 1..=OUTWARD.1 {
            let outward_m = OUTWARD.0 * k as f64 * self.height_m;
            let y = self.apart_m + outward_m;
            let corners = [back, front].map(|x| self.time_s([x, y], straight));
            let [Some(a), Some(b)] = corners else { break };
            time_s = time_s.max(a).max(b);
            let worth = self.worth(way_m(back, front) + outward_m, time_s);
            if worth > best.0 {
                best = (worth, y);
            }
        }
        let outer_m = to_decimals(best.1, 3);
        // The farthest place inward. The soles must fit beside each other, and the shins and knees must pass each
        // other.
        let least_m = self.sole_m[1] + SOLE_GAP * self.height_m;
        let step_m = 0.25 * (self.apart_m - least_m).max(0.0);
        (back, front) = (to_decimals(back, 3), to_decimals(front, 3));
        let mut inner = Err(String::new());
        for y in (0..=4).map(|k| to_decimals(least_m + step_m * f64::from(k), 3)) {
            let mut swings = [back, 0.0, front]
                .into_iter()
                .flat_map(|x| Foot::BOTH.map(|foot| (foot, [x, y])));
            inner = swings
                .try_for_each(|(foot, to)| self.check_clear(foot, to, straight))
                .map(|()| y);
            if inner.is_ok() {
                break;
            }
        }
        let inner_m = inner?;
        // The stance at home is within it, however coarse a millimetre is for the robot.
        let y_m = [
            inner_m.min(outwards(self.apart_m, -1.0)),
            outer_m.max(outwards(self.apart_m, 1.0)),
        ];
        self.timed(LandingRegion {
            name: "beside".into(),
            x_m: [back, front],
            y_m,
            swing_time_s: 0.0,
            sideways_from: 0.0,
            arc_m: 0.0,
        })
        .ok_or_else(|| "the legs do not reach all of the places beside each other".into())
    }

    /// A region in front of (`sign` 1) or behind (-1) the stance foot, up to `inward_m` at the side of the swing foot.
    fn across(&self, name: &str, sign: f64, inward_m: f64) -> Option<LandingRegion> {
        let mm = |length: f64| to_decimals(length, 3);
        let near_m = self.sole_m[0] + SOLE_GAP * self.height_m;
        let ends = (0..ENDS.1).map(|k| near_m + ENDS.0 * k as f64 * self.height_m);
        for near in ends {
            for (depth, across) in DEPTHS
                .into_iter()
                .flat_map(|depth| ACROSS.map(|across| (depth, across)))
            {
                for arc in ARCS {
                    let far = near + depth * self.height_m;
                    let x_m = if sign > 0.0 {
                        [mm(near), mm(far)]
                    } else {
                        [-mm(far), -mm(near)]
                    };
                    let region = LandingRegion {
                        name: name.into(),
                        x_m,
                        y_m: [mm(-across * self.height_m), inward_m],
                        swing_time_s: 0.0,
                        sideways_from: SIDEWAYS_FROM,
                        arc_m: mm(arc * self.height_m),
                    };
                    // The legs meet first at the near corners.
                    let mut corners = region.corners();
                    corners.sort_by(|a, b| {
                        a[0].abs()
                            .total_cmp(&b[0].abs())
                            .then(a[1].total_cmp(&b[1]))
                    });
                    let is_clear = Foot::BOTH.into_iter().all(|foot| {
                        corners
                            .iter()
                            .all(|to| self.check_clear(foot, *to, region.around()).is_ok())
                    });
                    if is_clear {
                        return self.worthiest(region);
                    }
                }
            }
        }
        None
    }

    /// The part of a region that crosses whose farthest footstep to the side from home is worth most.
    fn worthiest(&self, region: LandingRegion) -> Option<LandingRegion> {
        let worth =
            |part: &LandingRegion| self.worth(self.apart_m - part.y_m[0], part.swing_time_s);
        let parts = NARROWER.iter().filter_map(|narrower| {
            let least = to_decimals(region.y_m[0] + narrower * self.height_m, 3);
            self.timed(LandingRegion {
                y_m: [least, region.y_m[1]],
                ..region.clone()
            })
        });
        parts.max_by(|a, b| worth(a).total_cmp(&worth(b)))
    }

    /// The region with its time; None if the legs do not reach all of it.
    fn timed(&self, region: LandingRegion) -> Option<LandingRegion> {
        let least_s = least_swing_time_s(self.robot, &region)?;
        let swing_time_s = to_decimals((SLACK * least_s / TIME_UNIT_S).ceil() * TIME_UNIT_S, 3);
        Some(LandingRegion {
            swing_time_s,
            ..region
        })
    }
}
