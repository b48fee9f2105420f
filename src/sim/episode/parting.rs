//! Compares the films of one trial of two entrants tick by tick, to see when and how they part.

use super::film::Film;
use super::snapshot::Snapshot;
use nalgebra::Point2;
use serde::Serialize;
use standfast_core::robot::{Foot, PerFoot, Robot};

/// When and where two episodes of one trial part. Times are from the beginning of the episodes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parting {
    /// The first time at which the horizontal distance between the two COMs, or between the two positions of a sole's
    /// centre, exceeds the limit.
    pub at_s: f64,
    /// The part of the robot that exceeds the limit.
    pub of: PartingPoint,
    /// The distance (m).
    pub distance_m: f64,
    /// Phase of each controller at that time, and the time since which it has had this phase without a break.
    pub phases: [String; 2],
    pub phases_since_s: [f64; 2],
    /// Soles of each robot that bear a load at that time, and the time since which the same soles have borne a load.
    pub loaded: [SoleContact; 2],
    pub loaded_since_s: [f64; 2],
}

/// The part of two robots whose distance is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PartingPoint {
    Com,
    LeftSole,
    RightSole,
}

/// The soles that bear a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SoleContact {
    BothSoles,
    LeftSole,
    RightSole,
    NoSole,
}

impl From<PerFoot<bool>> for SoleContact {
    fn from(bears: PerFoot<bool>) -> Self {
        match (bears.left, bears.right) {
            (true, true) => SoleContact::BothSoles,
            (true, false) => SoleContact::LeftSole,
            (false, true) => SoleContact::RightSole,
            (false, false) => SoleContact::NoSole,
        }
    }
}

/// Half the width of the narrower sole of a robot, measured along its shorter side (m).
pub fn half_sole_width_m(robot: &Robot) -> f64 {
    Foot::BOTH
        .into_iter()
        .flat_map(|foot| robot.soles[foot].half_m)
        .fold(f64::INFINITY, f64::min)
}

impl Parting {
    /// The parting of two films of one trial, by half the width of a sole. It is None if they do not part while both
    /// last.
    pub fn of_films(a: &Film, b: &Film) -> Option<Self> {
        let mut watch = PartingDetector::new(half_sole_width_m(&a.robot));
        let [a, b] = [a, b].map(|film| film.snapshots.iter().map(Moment::from));
        a.zip(b).find_map(|(in_a, in_b)| watch.see(&in_a, &in_b))
    }
}

/// The part of a snapshot that is compared. Places are horizontal (m, world frame).
struct Moment {
    time_s: f64,
    com: Point2<f64>,
    soles: PerFoot<Point2<f64>>,
    phase: String,
    loaded: SoleContact,
}

impl From<&Snapshot> for Moment {
    fn from(snapshot: &Snapshot) -> Self {
        Self {
            time_s: snapshot.time_s,
            com: snapshot.com.xy(),
            soles: PerFoot::from_fn(|foot| snapshot.soles[foot].xy()),
            phase: snapshot.phase.clone(),
            loaded: PerFoot::from_fn(|foot| snapshot.contacts[foot].is_some()).into(),
        }
    }
}

/// Watches two episodes tick by tick.
struct PartingDetector {
    limit_m: f64,
    phases: [Option<(String, f64)>; 2],
    loaded: [Option<(SoleContact, f64)>; 2],
}

impl PartingDetector {
    fn new(limit_m: f64) -> Self {
        Self {
            limit_m,
            phases: [None, None],
            loaded: [None; 2],
        }
    }

    /// The parting, if the two are too far apart at this tick.
    fn see(&mut self, a: &Moment, b: &Moment) -> Option<Parting> {
        let phases_since_s = since(&mut self.phases, [&a.phase, &b.phase], a.time_s);
        let loaded_since_s = since(&mut self.loaded, [&a.loaded, &b.loaded], a.time_s);
        let (of, distance_m) = farthest(a, b);
        (distance_m > self.limit_m).then_some(Parting {
            at_s: a.time_s,
            of,
            distance_m,
            phases: [a.phase.clone(), b.phase.clone()],
            phases_since_s,
            loaded: [a.loaded, b.loaded],
            loaded_since_s,
        })
    }
}

/// The times since which each of two values has been as it is `now`, at `time_s`. `before` has the last value of each,
/// and the time since which it has been so.
fn since<T: Clone + PartialEq>(
    before: &mut [Option<(T, f64)>; 2],
    now: [&T; 2],
    time_s: f64,
) -> [f64; 2] {
    for (before, now) in before.iter_mut().zip(now) {
        if before.as_ref().is_none_or(|(before, _)| before != now) {
            *before = Some((now.clone(), time_s));
        }
    }
    before
        .each_ref()
        .map(|before| before.as_ref().map_or(time_s, |(_, since_s)| *since_s))
}

/// The part with the largest horizontal distance, and this distance (m).
fn farthest(a: &Moment, b: &Moment) -> (PartingPoint, f64) {
    let sole = |foot: Foot| (a.soles[foot] - b.soles[foot]).norm();
    let com = (a.com - b.com).norm();
    let all = [
        (PartingPoint::Com, com),
        (PartingPoint::LeftSole, sole(Foot::Left)),
        (PartingPoint::RightSole, sole(Foot::Right)),
    ];
    all.into_iter().fold(
        all[0],
        |most, other| if other.1 > most.1 { other } else { most },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::testing::stiff;
    use crate::episode::{Disturbance, EpisodeConfig, Until};

    #[test]
    fn films_part_where_a_point_is_first_too_far_away() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let config = EpisodeConfig {
            horizon_s: 0.2,
            ..EpisodeConfig::of(&standfast_core::robot::Units::of(&robot))
        };
        let design = stiff();
        let how_long = (Until::Horizon, 0.0);
        let film = Film::take(
            &robot,
            &design,
            &config,
            Disturbance::default(),
            how_long,
            &mut |_| {},
        )
        .unwrap();
        assert_eq!(Parting::of_films(&film, &film), None);
        let limit_m = half_sole_width_m(&robot);
        let mut other = film.clone();
        for (k, snapshot) in other.snapshots.iter_mut().enumerate() {
            snapshot.com.x += if k >= 30 { 0.99 * limit_m } else { 0.0 };
            snapshot.soles.right.y += if k >= 50 { 1.01 * limit_m } else { 0.0 };
            if k >= 40 {
                snapshot.contacts.left = None;
            }
            // The other film has a second phase after a first one, and both differ from the phase of this film.
            snapshot.phase = if k >= 45 { "swing-left" } else { "switching" }.into();
        }
        let parting = Parting::of_films(&film, &other).unwrap();
        assert_eq!(
            (parting.at_s, parting.of),
            (film.snapshots[50].time_s, PartingPoint::RightSole)
        );
        assert!(
            (parting.distance_m - 1.01 * limit_m).abs() < 1e-12,
            "{parting:?}"
        );
        assert_eq!(parting.phases, [String::from("stiff"), "swing-left".into()]);
        assert_eq!(
            parting.phases_since_s,
            [0.0, film.snapshots[45].time_s],
            "not since the phases differ"
        );
        assert_eq!(
            parting.loaded,
            [SoleContact::BothSoles, SoleContact::RightSole]
        );
        assert_eq!(parting.loaded_since_s, [0.0, film.snapshots[40].time_s]);
        other.snapshots.truncate(50);
        assert_eq!(
            Parting::of_films(&film, &other),
            None,
            "as far as both films last"
        );
    }
}
