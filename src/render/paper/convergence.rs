//! How fast the COM comes home under one gain, and under switching control (Sect. III.D), on the ideal pendulum.

use super::study::Study;
use crate::lipm::OnlineSets;
use crate::lipm::pendulum::State;
use nalgebra::{Point2, Vector2};

/// Of the largest push from rest that a set holds: a little less, so that it does.
const SHARE: f64 = 0.98;
/// A COM that is not home by then does not come home (s).
const LONGEST_S: f64 = 30.0;

/// A robot at rest at home after an instantaneous push forward: what the set of gain `index` holds, but for a little.
fn pushed(study: &Study, index: usize) -> State {
    let com_vel = SHARE * study.sets[index].largest_com_vel_from_rest(Vector2::x());
    State::new(Point2::origin(), Vector2::new(com_vel, 0.0), Point2::origin())
}

/// From when on the COM stays within the judge's radius of home (s), if at every tick the gain that `choose` names acts.
fn home_s(study: &Study, start: State, choose: impl Fn(&State) -> usize) -> Option<f64> {
    let family = &study.design.family;
    let (mut state, mut since) = (start, None);
    for k in 0..(LONGEST_S / family.pendulum.dt) as u64 {
        let away = state.com().coords.norm() > study.judge.home_radius_m;
        since = if away { None } else { since.or(Some(k)) };
        state = family.gains[choose(&state)].successor(&state);
    }
    since.map(|k| k as f64 * family.pendulum.dt)
}

/// Of each gain, slow to fast, after the push that the fastest gain's set holds, and so every set (s).
pub fn of_gains(study: &Study) -> Vec<Option<f64>> {
    let start = pushed(study, study.sets.len() - 1);
    (0..study.sets.len()).map(|gain| home_s(study, start, |_| gain)).collect()
}

/// After the push that the slowest gain's set holds: with that gain alone, and with the fastest gain at every tick whose
/// set holds the state (s).
pub fn of_switching(study: &Study) -> [Option<f64>; 2] {
    let start = pushed(study, 0);
    let mut sets = OnlineSets::new(&study.design.family);
    sets.update(&study.allowed);
    [home_s(study, start, |_| 0), home_s(study, start, |state| sets.fastest_holding(state).unwrap_or(0))]
}
