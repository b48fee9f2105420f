//! Switching control: decides which gain acts (paper, Sect. III.D) and computes the desired ZMP.
//!
//! The state of eq. 5 is the estimated COM and COM velocity, and the ZMP that the gain asked for at the last tick. The
//! gain acts on this state at every tick (eq. 11), so the loop is closed through the sensors. The desired ZMP is kept
//! inside the support polygon less a margin. When the state is in no gain's CPI set (eq. 26), the desired ZMP goes at
//! once to where the slowest gain would have it at rest, or the fastest one if the gain set says so, but not beyond the
//! edge of the whole support polygon. The slowest gain keeps the ZMP close to the DCM: on a robot that differs from the
//! pendulum the DCM may then stay where it is until the robot tips over, although the ZMP could still have moved to the
//! edge.

use super::Support;
use crate::geometry::SupportPolygon;
use crate::lipm::gains::{GainFamily, OutOfSets};
use crate::lipm::online::OnlineSets;
use crate::lipm::pendulum::State;
use nalgebra::{Isometry2, Point2, Vector2};

/// Margin that the state must have in the CPI set of a faster gain before that gain takes over. With a margin of 0,
/// noise at the border of a CPI set would switch gains to and fro.
const MARGIN_TO_SPEED_UP: f64 = 0.05;

#[derive(Debug, Clone)]
pub struct Supervisor {
    sets: OnlineSets,
    support: Option<Support>,
    /// Support polygon less the gain set's ZMP margin, control frame.
    allowed: Option<SupportPolygon>,
    /// Index of the acting gain in the family.
    pub gain: usize,
    /// The ZMP that the gain asks for (m, world frame), a part of the state of eq. 5.
    zmp_state: Point2<f64>,
    /// The state of the last tick, control frame.
    tested: State,
    /// Whether the state of the last tick was in the CPI set of some gain.
    held: bool,
    /// Whether the next gain starts from the present state even if it is the same gain.
    anew: bool,
    /// Offset added to the gain's ZMP (m, world frame), to measure how the ZMP follows; zero except in experiments.
    pub zmp_probe: Vector2<f64>,
    /// Margin of the state in the slowest gain's CPI set, the largest one. It is negative when no CPI set contains the
    /// state (eq. 26).
    pub margin: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandDecision {
    /// Desired ZMP (m, world frame): the ZMP of the gain plus the probe, inside the allowed support; or on the edge of
    /// the support when the state is in no CPI set. None in flight.
    pub zmp: Option<Point2<f64>>,
    /// Whether the state is in the CPI set of some gain. If not, the gain acts without a guarantee (eq. 26).
    pub held: bool,
    /// Whether a gain starts from the estimated state: because the gain has changed, because the state has returned to
    /// a CPI set, or after a landing.
    pub starts: bool,
}

impl Supervisor {
    /// Starts with the fastest gain, and with the ZMP at `zmp` (m, world frame).
    pub fn new(family: &GainFamily, zmp: Point2<f64>) -> Self {
        let gain = family.gains.len().saturating_sub(1);
        Self {
            sets: OnlineSets::new(family),
            support: None,
            allowed: None,
            gain,
            zmp_state: zmp,
            tested: State::default(),
            held: true,
            anew: false,
            zmp_probe: Vector2::zeros(),
            margin: 1.0,
        }
    }

    /// Runs one tick: chooses the gain and computes the desired ZMP. COM and COM velocity (m, m/s) are in the world
    /// frame.
    pub fn update(
        &mut self,
        family: &GainFamily,
        support: &Support,
        com: Point2<f64>,
        com_vel: Vector2<f64>,
    ) -> StandDecision {
        if self.support != Some(*support) {
            self.support = Some(*support);
            self.allowed = support.polygon.and_then(|p| p.inset(family.zmp_margin));
            match &self.allowed {
                Some(polygon) => self.sets.update(polygon),
                None => self.sets.clear(),
            }
        }
        let frame = &support.frame;
        let state = State::new(
            frame.inverse_transform_point(&com),
            frame.inverse_transform_vector(&com_vel),
            self.keep_inside(frame.inverse_transform_point(&self.zmp_state)),
        );
        self.tested = state;
        let mut decision = self.choose(family, &state);
        let Some(whole) = support.polygon else {
            return decision;
        };
        let gain = &family.gains[self.gain];
        let zmp = if decision.held {
            state.zmp() + gain.zmp_rate(&state) * family.pendulum.dt
        } else {
            // No ZMP is safe any more, so the ZMP may go to the very edge, and at once.
            whole.nearest(gain.resting_zmp(&state))
        };
        let inside = self.keep_inside(zmp);
        self.zmp_state = frame.transform_point(&inside);
        let probe = frame.inverse_transform_vector(&self.zmp_probe);
        let asked = if decision.held {
            self.keep_inside(inside + probe)
        } else {
            zmp
        };
        decision.zmp = Some(frame.transform_point(&asked));
        decision
    }

    /// The slowest gain's ZMP error (m, control frame) for the state of the last tick, which makes a footstep
    /// necessary. It is zero if a CPI set contains the state, and if there are no CPI sets.
    pub fn zmp_error(&self) -> Vector2<f64> {
        self.sets.zmp_error(0, &self.tested)
    }

    /// Sets the ZMP to `zmp` (m, world), for example after a landing. The next gain starts from the present state.
    pub fn start_anew(&mut self, zmp: Point2<f64>) {
        self.zmp_state = zmp;
        self.held = false;
        self.anew = true;
    }

    /// Margin in the slowest gain's CPI set of another COM state (m and m/s, world frame), for example the true one, on
    /// the support of the last tick.
    pub fn margin_at(&self, com: Point2<f64>, com_vel: Vector2<f64>) -> f64 {
        let Some(support) = &self.support else {
            return f64::NEG_INFINITY;
        };
        let frame = &support.frame;
        let (com, com_vel) = (
            frame.inverse_transform_point(&com),
            frame.inverse_transform_vector(&com_vel),
        );
        let state = State::new(com, com_vel, self.tested.zmp());
        self.sets.margin(0, &state)
    }

    /// For pictures: the slice of each gain's CPI set over COM positions, at the COM velocity and ZMP of the last tick,
    /// from slow to fast. Each is a list of corners (m, world frame), empty where the CPI set contains no such state.
    pub fn slices(&self) -> Vec<Vec<Point2<f64>>> {
        let frame = self
            .support
            .map_or_else(Isometry2::identity, |support| support.frame);
        let slices = (0..self.sets.len()).map(|gain| {
            let slice = self.sets.slice(gain, &self.tested);
            slice.iter().map(|corner| frame * corner).collect()
        });
        slices.collect()
    }

    /// Whether the state of the last tick was in the CPI set of some gain.
    pub fn is_held(&self) -> bool {
        self.held
    }

    fn choose(&mut self, family: &GainFamily, state: &State) -> StandDecision {
        self.margin = self.sets.margin(0, state);
        let before = self.gain;
        let holding = self.sets.fastest_holding(state);
        self.gain = match holding {
            Some(fastest) if fastest > before => (before..=fastest)
                .rev()
                .find(|&i| i == before || self.sets.margin(i, state) > MARGIN_TO_SPEED_UP)
                .unwrap_or(before),
            Some(fastest) => fastest,
            None if family.out_of_sets == OutOfSets::Fastest => {
                family.gains.len().saturating_sub(1)
            }
            None => 0,
        };
        let held_before = std::mem::replace(&mut self.held, holding.is_some());
        let anew = std::mem::take(&mut self.anew);
        StandDecision {
            zmp: None,
            held: self.held,
            starts: anew || self.gain != before || (self.held && !held_before),
        }
    }

    /// The point of the allowed support nearest to `zmp`, control frame.
    fn keep_inside(&self, zmp: Point2<f64>) -> Point2<f64> {
        match &self.allowed {
            Some(polygon) => polygon.nearest(zmp),
            None => zmp,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lipm::Pendulum;
    use crate::lipm::testing::built_in;

    /// If the state is in no CPI set and the DCM is inside of the support, the slowest gain does not move the ZMP to
    /// the edge. The fastest one does.
    #[test]
    fn out_of_the_sets_the_zmp_goes_where_the_gain_set_says() {
        let pendulum = Pendulum {
            omega: 5.63,
            dt: 0.002,
        };
        let polygon = SupportPolygon::rectangle(-0.048, 0.048, -0.083, 0.083);
        let support = Support {
            frame: Isometry2::identity(),
            polygon,
        };
        let (com, com_vel) = (Point2::new(0.0, 0.06), Vector2::new(0.1, 0.09));
        let zmp_of = |gains: &str| {
            let mut set = built_in(gains.split(',').next().unwrap());
            if gains.contains("fastest") {
                set.out_of_sets = OutOfSets::Fastest;
            }
            let family = GainFamily::design(&set, pendulum, 0.048).unwrap();
            let mut supervisor = Supervisor::new(&family, Point2::origin());
            let decision = supervisor.update(&family, &support, com, com_vel);
            assert!(!decision.held, "{gains}");
            (decision.zmp.unwrap(), supervisor.gain)
        };
        let dcm = com + com_vel / pendulum.omega;
        let (zmp, gain) = zmp_of("switching");
        assert!(
            gain == 0 && (zmp.x - 1.12 * dcm.x).abs() < 1e-3,
            "{gain} {zmp} {dcm}"
        );
        for (set, fastest) in [("robust", 2), ("switching, else the fastest", 4)] {
            let (zmp, gain) = zmp_of(set);
            assert!(
                gain == fastest && zmp.x > 1.7 * dcm.x && zmp.y == 0.083,
                "{set}: {gain} {zmp} {dcm}"
            );
        }
    }
}
