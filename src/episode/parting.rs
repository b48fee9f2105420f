//! Where two films of one trial part company, for example in two physics engines.

use super::film::Film;
use crate::robot::{Foot, Robot};
use serde::Serialize;

/// The first moment at which the COM or the centre of a sole is not where it is in another film of the same trial, by
/// more than half the smaller width of a sole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Parting {
    pub time_s: f64,
    /// The point that is farthest from its place in the other film.
    pub point: &'static str,
    /// Distance between its two places (m).
    pub apart_m: f64,
}

impl Parting {
    /// None if the films stay together for as long as both last.
    pub fn of(film: &Film, other: &Film) -> Option<Self> {
        let limit_m = Self::limit_m(&film.robot);
        film.snapshots.iter().zip(&other.snapshots).find_map(|(a, b)| {
            let points = [
                ("COM", a.com - b.com),
                ("left sole", a.soles.left - b.soles.left),
                ("right sole", a.soles.right - b.soles.right),
            ];
            let (point, apart) = points.into_iter().max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))?;
            let parting = Self { time_s: a.time_s, point, apart_m: apart.norm() };
            (parting.apart_m > limit_m).then_some(parting)
        })
    }

    /// Half the smaller width of a robot's soles (m).
    pub fn limit_m(robot: &Robot) -> f64 {
        Foot::BOTH.into_iter().flat_map(|foot| robot.soles[foot].half_m).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Design;
    use crate::episode::{Disturbance, EpisodeConfig, Until};
    use crate::lipm::GainSet;

    #[test]
    fn films_part_where_a_point_is_first_too_far_away() {
        let (robot, config) =
            (Robot::load("ut-mu2").unwrap(), EpisodeConfig { horizon_s: 0.2, ..EpisodeConfig::default() });
        let design = Design::new(&robot, &GainSet::load("hold").unwrap(), config.control_period_s).unwrap();
        let how_long = (Until::Horizon, 0.0);
        let film = Film::take(&robot, &design, &config, Disturbance::default(), how_long, &mut |_| {});
        assert_eq!(Parting::of(&film, &film), None);
        let limit_m = Parting::limit_m(&robot);
        let half_m = robot.soles.left.half_m;
        assert_eq!(limit_m, half_m[0].min(half_m[1]));
        let mut other = film.clone();
        for (k, snapshot) in other.snapshots.iter_mut().enumerate() {
            snapshot.com.z += if k >= 30 { 0.99 * limit_m } else { 0.0 };
            snapshot.soles.right.y += if k >= 50 { 1.01 * limit_m } else { 0.0 };
        }
        let parting = Parting::of(&film, &other).unwrap();
        assert_eq!((parting.time_s, parting.point), (film.snapshots[50].time_s, "right sole"));
        assert!((parting.apart_m - 1.01 * limit_m).abs() < 1e-12, "{parting:?}");
        other.snapshots.truncate(50);
        assert_eq!(Parting::of(&film, &other), None, "as far as both films last");
    }
}
