//! Plans footsteps anew during the swing: where the foot lands, and where the ZMP is until then, so that the DCM ends
//! inside of the new support polygon. The paper plans a footstep only once.
//!
//! While the foot is in the air, for a time T, the DCM diverges from the ZMP p inside of the stance sole (eq. 1, 2):
//!
//! ```text
//! dcm(T) = e^(omega T) (dcm - p) + p
//! ```
//!
//! With the foot at f, the support polygon is the hull of both soles: the line from the stance sole's centre (here the
//! origin) to f, widened by a sole. So the DCM is inside if `dcm(T) - s f` lies in a sole for some share s: s = 1/2 is
//! midway between the feet, and s = 1 over the landing foot. For a given share, and for each axis alone, the problem
//!
//! ```text
//! min over p in the sole, f within reach of  (dcm(T) - s f)^2 + TIE (p^2 + (f - home)^2)
//! ```
//!
//! has two variables in a box and a closed-form solution. The small cost TIE only decides between equally good
//! footsteps. The problem is solved for several shares, and the solution with the least cost is taken, where a DCM
//! outside of the support polygon costs far more than the rest. It is solved anew at every tick, so landing place and
//! ZMP follow the DCM.

use super::relaxation::in_box;
use crate::arrays::exactly;
use crate::error::{Error, Result};
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

/// The table `[catching]` of a gain set's file, which holds for robots of every size.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CatchingTable {
    /// In COM heights.
    pub lift: f64,
    /// In 1/omega, as all fields below.
    pub late: f64,
    pub pause: f64,
    /// At most half of the robot's quickest swing.
    pub transfer: f64,
    /// At most the robot's quickest swing.
    pub settle: f64,
    /// How every footstep that catches departs from the rule.
    #[serde(default, skip_serializing_if = "Departure::is_none")]
    pub every: Departure,
    /// Departures of the first footsteps beyond `every`, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub departures: Vec<Departure>,
}

/// How a footstep departs from the one that the rule would take. With zeros it does not. A clairvoyant that knows the push
/// is a list of departures, which `standfast ceiling` searches; a departure of every footstep is a constant of the rule, to be
/// tuned.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Departure {
    /// Distance of the DCM from the support polygon at which the foot is lifted, in COM heights; inside if negative.
    #[serde(skip_serializing_if = "is_none")]
    pub lift: f64,
    /// Added miss of a footstep of the left foot, in COM heights. It is subtracted for the right foot.
    #[serde(skip_serializing_if = "is_none")]
    pub left: f64,
    /// Added miss of a footstep with crossed legs, in COM heights.
    #[serde(skip_serializing_if = "is_none")]
    pub crossed: f64,
    /// Shift of the landing place, also beyond reach, and of the ZMP within the sole, in COM heights: forward, and to
    /// the side of the foot in the air.
    #[serde(deserialize_with = "exactly", skip_serializing_if = "are_none")]
    pub place: [f64; 2],
    #[serde(deserialize_with = "exactly", skip_serializing_if = "are_none")]
    pub zmp: [f64; 2],
    /// The swing takes e^slower times its planned time.
    #[serde(skip_serializing_if = "is_none")]
    pub slower: f64,
    /// Turn of the trunk during the swing about its x and y axes (rad). It stays until the next footstep.
    #[serde(deserialize_with = "exactly", skip_serializing_if = "are_none")]
    pub tilt: [f64; 2],
    /// How much lower the COM is at the landing, in COM heights.
    #[serde(skip_serializing_if = "is_none")]
    pub lower: f64,
}

fn is_none(number: &f64) -> bool {
    *number == 0.0
}

fn are_none(numbers: &[f64; 2]) -> bool {
    numbers.iter().all(is_none)
}

impl Departure {
    /// Number of numbers in a departure.
    pub const NUMBERS: usize = 11;
    /// Largest magnitude of each number, in the order of [`numbers`](Self::numbers).
    pub const MOST: [f64; Self::NUMBERS] = [0.3, 1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 1.0, 1.0, 1.0, 0.5];

    /// The numbers of the departure, in the order of the fields.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let Self {
            lift,
            left,
            crossed,
            place: [x, y],
            zmp: [zmp_x, zmp_y],
            slower,
            tilt: [roll, pitch],
            lower,
        } = *self;
        [
            lift, left, crossed, x, y, zmp_x, zmp_y, slower, roll, pitch, lower,
        ]
    }

    fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The sum of two departures, number by number.
    pub fn and(&self, other: &Self) -> Self {
        let mut numbers = self.numbers();
        for (number, more) in numbers.iter_mut().zip(other.numbers()) {
            *number += more;
        }
        Self::of_numbers(numbers)
    }

    /// The departure with these numbers, each clamped to its largest magnitude.
    pub fn of_numbers(mut numbers: [f64; Self::NUMBERS]) -> Self {
        for (number, most) in numbers.iter_mut().zip(Self::MOST) {
            *number = number.clamp(-most, most);
        }
        let [
            lift,
            left,
            crossed,
            x,
            y,
            zmp_x,
            zmp_y,
            slower,
            roll,
            pitch,
            lower,
        ] = numbers;
        Self {
            lift,
            left,
            crossed,
            place: [x, y],
            zmp: [zmp_x, zmp_y],
            slower,
            tilt: [roll, pitch],
            lower,
        }
    }
}

impl CatchingTable {
    /// The keys that a file needs.
    pub const KEYS: [&str; 5] = ["lift", "late", "pause", "transfer", "settle"];

    /// Checks the values. Errors name the gain set `file`.
    pub fn validate(&self, file: &str) -> Result<()> {
        let ranges = [
            ("lift", self.lift, 0.0, 0.6),
            ("late", self.late, 0.0, 6.0),
            ("pause", self.pause, 0.0, 6.0),
            ("transfer", self.transfer, 0.0, 6.0),
            ("settle", self.settle, 0.05, 10.0),
        ];
        Error::check_ranges(file, "catching", &ranges)?;
        if self.departures.len() > DEPARTURES {
            let (count, accepted) = (
                self.departures.len(),
                format!("up to {DEPARTURES} footsteps"),
            );
            return Err(Error::value(
                file,
                "catching.departures",
                count,
                "too many",
                accepted,
            ));
        }
        let named = self
            .departures
            .iter()
            .enumerate()
            .map(|(i, departure)| (format!("departures[{i}]"), departure));
        for (name, departure) in named.chain([("every".into(), &self.every)]) {
            if *departure != Departure::of_numbers(departure.numbers()) {
                let (value, accepted) = (
                    format!("{:?}", departure.numbers()),
                    format!("numbers up to {:?}", Departure::MOST),
                );
                return Err(Error::value(
                    file,
                    format!("catching.{name}"),
                    value,
                    "out of range",
                    accepted,
                ));
            }
        }
        Ok(())
    }

    /// The rules of a robot with the COM height `length_m` (m), 1/omega `time_s` (s) and this quickest swing (s).
    pub fn rules(&self, length_m: f64, time_s: f64, quickest_s: f64) -> Catching {
        Catching {
            lift_m: self.lift * length_m,
            late_s: self.late * time_s,
            pause_s: self.pause * time_s,
            transfer_s: (self.transfer * time_s).min(0.5 * quickest_s),
            settle_s: (self.settle * time_s).min(quickest_s),
            every: self.every,
        }
    }
}

/// Rules of the footsteps of one robot that are planned anew during the swing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Catching {
    /// Largest height of the sole in a swing (m).
    pub lift_m: f64,
    /// Longest time for which a late foot goes on downward (s).
    pub late_s: f64,
    /// Shortest time from a landing to the next lift (s).
    pub pause_s: f64,
    /// Time until the ZMP is where it is wanted, if the foot to be lifted carries the whole weight (s). For a smaller
    /// load it is in proportion, so a foot with more load costs more time.
    pub transfer_s: f64,
    /// Time before the landing from which on the landing place is fixed (s). A foot whose landing place changed up to
    /// the end would land fast.
    pub settle_s: f64,
    /// How every footstep that catches departs from the rule.
    pub every: Departure,
}

/// Number of first footsteps that can depart from the rule.
pub const DEPARTURES: usize = 4;
/// Departures of the first footsteps.
pub type Departures = [Departure; DEPARTURES];

/// The first departures of a list. Footsteps beyond the end of the list have none.
pub fn first(list: &[Departure]) -> Departures {
    std::array::from_fn(|i| list.get(i).copied().unwrap_or_default())
}

/// The data of the planning problem. Lengths (m) are in the stance sole's frame, with x forward and y to the swing
/// foot's side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CatchProblem {
    /// Natural frequency of the pendulum (rad/s).
    pub omega: f64,
    /// Smallest and largest x, and y, of the ZMP.
    pub zmp: [[f64; 2]; 2],
    /// Smallest and largest x, and y, of a DCM inside of the support polygon, relative to any point from the middle of
    /// the feet to the landing foot.
    pub support: [[f64; 2]; 2],
    /// Smallest and largest x, and y, of the landing place.
    pub reach: [[f64; 2]; 2],
    /// Place of the swing foot at home.
    pub home: Vector2<f64>,
}

impl CatchProblem {
    /// The problem with the landing place fixed.
    pub fn landing_at(self, place: Vector2<f64>) -> Self {
        Self {
            reach: [[place.x; 2], [place.y; 2]],
            ..self
        }
    }

    /// The share of a `miss` (m) in [`CatchPlan::cost`].
    pub fn cost_of_miss(&self, miss: f64) -> f64 {
        MISS * self.home.norm() * miss
    }
}

/// The best footstep, in the frame of [`CatchProblem`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CatchPlan {
    /// ZMP until the landing (m).
    pub zmp: Vector2<f64>,
    /// Landing place (m).
    pub place: Vector2<f64>,
    /// DCM at the landing (m).
    pub dcm: Vector2<f64>,
    /// Distance of `dcm` from the part of the support polygon between the feet's middle and the landing foot (m); 0
    /// inside.
    pub miss: f64,
    /// Cost (m^2). A `miss` costs `MISS` times the distance between the feet at home times `miss`.
    pub cost: f64,
}

/// The shares s that are tried.
const SHARES: [f64; 6] = [0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
/// Cost of a DCM outside of the support, per metre, in distances between the feet at home. It exceeds all other costs.
const MISS: f64 = 1000.0;
/// Cost of a ZMP away from the middle of the stance sole, and of a landing place away from home, relative to the cost
/// of a DCM away from the middle of its support.
const TIE: f64 = 1e-6;

/// The best footstep with `time_s` (s) left until its landing, for a `dcm` now (m, in the frame of [`CatchProblem`]).
pub fn plan(problem: &CatchProblem, dcm: Vector2<f64>, time_s: f64) -> CatchPlan {
    let mut best = landing(problem, dcm, time_s, SHARES[0]);
    for share in &SHARES[1..] {
        let catch = landing(problem, dcm, time_s, *share);
        if catch.cost < best.cost {
            best = catch;
        }
    }
    best
}

/// The best footstep for one share s.
fn landing(problem: &CatchProblem, dcm: Vector2<f64>, time_s: f64, share: f64) -> CatchPlan {
    let growth = (problem.omega * time_s).exp();
    let mut catch = CatchPlan {
        zmp: Vector2::zeros(),
        place: Vector2::zeros(),
        dcm,
        miss: 0.0,
        cost: 0.0,
    };
    let mut outside = Vector2::zeros();
    for k in 0..2 {
        let row = Vector2::new(1.0 - growth, -share);
        let hessian = row * row.transpose() + Matrix2::identity() * TIE;
        let linear = Vector2::new(0.0, TIE * problem.home[k]) - row * (growth * dcm[k]);
        let [zmp, place]: [f64; 2] =
            in_box(&hessian, &linear, [problem.zmp[k], problem.reach[k]]).into();
        (catch.zmp[k], catch.place[k]) = (zmp, place);
        catch.dcm[k] = growth * (dcm[k] - zmp) + zmp;
        let off = catch.dcm[k] - share * place;
        outside[k] = off - off.clamp(problem.support[k][0], problem.support[k][1]);
        catch.cost += off * off + TIE * (zmp * zmp + (place - problem.home[k]).powi(2));
    }
    catch.miss = outside.norm();
    catch.cost += problem.cost_of_miss(catch.miss);
    catch
}

#[cfg(test)]
mod tests {
    use super::super::testing::cases;
    use super::*;
    use proptest::prelude::*;

    const PROBLEM: CatchProblem = CatchProblem {
        omega: 5.63,
        zmp: [[-0.045, 0.045], [-0.032, 0.032]],
        support: [[-0.048, 0.048], [-0.035, 0.035]],
        reach: [[-0.15, 0.15], [0.075, 0.18]],
        home: Vector2::new(0.0, 0.097),
    };
    const TIME_S: f64 = 0.15;

    /// A DCM beside the stance foot of a robot at home, shifted by (x, y) (m), with y to the side of the swing foot.
    fn pushed(x: f64, y: f64) -> Vector2<f64> {
        Vector2::new(x, 0.5 * PROBLEM.home.y + y)
    }

    #[test]
    fn a_push_to_the_side_is_best_taken_by_the_foot_on_the_far_side() {
        // For a DCM 65 mm to the side, the foot on that side would have to land beyond its reach.
        let near = plan(&PROBLEM, pushed(0.0, 0.065), TIME_S);
        let far = plan(&PROBLEM, pushed(0.0, -0.065), TIME_S);
        // By hand: with the ZMP 32 mm to that side, the DCM ends at e^(omega T) (113.5 - 32) + 32 = 221.6 mm.
        let dcm = 0.032 + (PROBLEM.omega * TIME_S).exp() * (0.1135 - 0.032);
        assert!(
            (near.miss - (dcm - 0.18 - 0.035)).abs() < 1e-12 && near.miss > 0.006,
            "{near:?}"
        );
        assert_eq!(near.place.y, 0.18);
        assert!(far.miss == 0.0 && far.cost < near.cost, "{far:?}");
        assert!(
            (far.zmp.y + 0.032).abs() < 1e-12,
            "the ZMP at the outer edge of the sole that stands: {far:?}"
        );
    }

    #[test]
    fn what_is_decided_stays() {
        let place = Vector2::new(0.05, 0.1);
        assert_eq!(
            plan(&PROBLEM.landing_at(place), pushed(0.06, 0.0), 0.05).place,
            place
        );
    }

    /// A robot with quick legs has less time before a landing than the gain set asks for.
    #[test]
    fn times_of_the_swing_are_at_most_the_swing() {
        let table = CatchingTable {
            lift: 0.03,
            late: 0.6,
            pause: 0.2,
            transfer: 0.3,
            settle: 0.5,
            ..CatchingTable::default()
        };
        let [slow, quick] = [0.5, 0.08].map(|quickest_s| table.rules(0.9, 0.3, quickest_s));
        assert_eq!([slow.transfer_s, slow.settle_s], [0.09, 0.15]);
        assert_eq!([quick.transfer_s, quick.settle_s], [0.04, 0.08]);
        assert_eq!(slow.lift_m, 0.027);
    }

    proptest! {
        #![proptest_config(cases(5, 300))]

        /// No other ZMP and place within reach cost less, and the planned DCM obeys the pendulum.
        #[test]
        fn no_other_zmp_and_place_cost_less(
            dcm in [-0.2..0.2f64, -0.1..0.25f64], time in 0.02..0.3f64, other in [-1.0..1.0f64, -1.0..1.0, 0.0..1.0, 0.0..1.0],
            share in 0..6_usize,
        ) {
            let catch = landing(&PROBLEM, dcm.into(), time, SHARES[share]);
            let zmp = [0.045 * other[0], 0.032 * other[1]];
            let place = |k: usize, u: f64| PROBLEM.reach[k][0] + (PROBLEM.reach[k][1] - PROBLEM.reach[k][0]) * u;
            let place = [place(0, other[2]), place(1, other[3])];
            let growth = (PROBLEM.omega * time).exp();
            let cost = |zmp: [f64; 2], place: [f64; 2]| -> f64 {
                (0..2).map(|k| {
                    let off = growth * (dcm[k] - zmp[k]) + zmp[k] - SHARES[share] * place[k];
                    off * off + TIE * (zmp[k] * zmp[k] + (place[k] - PROBLEM.home[k]).powi(2))
                }).sum()
            };
            let mine = cost(catch.zmp.into(), catch.place.into());
            prop_assert!(mine <= cost(zmp, place) + 1e-12);
            prop_assert!((mine + MISS * PROBLEM.home.norm() * catch.miss - catch.cost).abs() < 1e-12);
            let arrived = (Vector2::from(dcm) - catch.zmp) * growth + catch.zmp;
            prop_assert!((arrived - catch.dcm).norm() < 1e-12);
        }
    }
}
