//! Which gain acts (paper, Sect. III.D), and the ZMP that it wants.
//!
//! The state is that of eq. 5: COM and COM velocity as estimated, and the ZMP that the controller asked for last. The
//! gain acts on it at every tick (eq. 11), so the loop is closed through the sensors; the ZMP asked for is kept inside
//! the support, less a margin. When no set holds the state (eq. 26) the ZMP goes to the edge of the whole support.

use super::Support;
use crate::geometry::SupportPolygon;
use crate::lipm::gains::GainFamily;
use crate::lipm::online::OnlineSets;
use crate::lipm::pendulum::State;
use nalgebra::{Isometry2, Point2, Vector2};

/// A faster gain takes over only when its set holds the state with this margin: noise at the border of a set would
/// else switch to and fro.
const MARGIN_TO_SPEED_UP: f64 = 0.05;

/// The supervisor of one episode.
#[derive(Debug, Clone)]
pub struct Supervisor {
    sets: OnlineSets,
    support: Option<Support>,
    /// The support less the gain set's margin, control frame.
    allowed: Option<SupportPolygon>,
    /// Acting gain, index into the family.
    pub gain: usize,
    /// What the gain wants of the ZMP, world: part of the state of eq. 5.
    zmp_state: Point2<f64>,
    /// The state that the sets were last asked about, control frame.
    tested: State,
    /// Whether a set held that state.
    held: bool,
    /// Whatever gain is next starts from the state reached.
    anew: bool,
    /// Added to the gain's ZMP behind the gain's back, to measure how the ZMP follows; zero but in experiments (m).
    pub zmp_probe: Vector2<f64>,
    /// Margin of the slowest gain's set, the largest: negative when no set holds the state (eq. 26).
    pub margin: f64,
}

/// What the supervisor decided at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Wanted ZMP, world (m): the gain's plus the probe, inside the allowed support; at the edge when no set holds the state.
    /// None in flight.
    pub zmp: Option<Point2<f64>>,
    /// Some set holds the state. If not, the slowest gain acts, as well as it can (eq. 26).
    pub held: bool,
    /// A gain starts anew from the estimated state: another than before, or the first after none held it, or after a
    /// landing.
    pub starts: bool,
}

impl Supervisor {
    /// Starts with the fastest gain and the ZMP at `zmp`.
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

    /// One tick: chooses the gain and moves the ZMP by it. COM and its velocity: world (m, m/s).
    pub fn update(
        &mut self,
        family: &GainFamily,
        support: &Support,
        com: Point2<f64>,
        com_vel: Vector2<f64>,
    ) -> Decision {
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
        let mut decision = self.choose(&state);
        let Some(whole) = support.polygon else { return decision };
        let gain = &family.gains[self.gain];
        let zmp = if decision.held {
            state.zmp() + gain.zmp_rate(&state) * family.pendulum.dt
        } else {
            // Nothing is left to lose: at once to the very edge.
            whole.nearest(gain.resting_zmp(&state))
        };
        let inside = self.keep_inside(zmp);
        self.zmp_state = frame.transform_point(&inside);
        let probe = frame.inverse_transform_vector(&self.zmp_probe);
        let asked = if decision.held { self.keep_inside(inside + probe) } else { zmp };
        decision.zmp = Some(frame.transform_point(&asked));
        decision
    }

    /// The ZMP error that makes a footstep necessary, by the slowest gain, for the state of the last tick: control frame
    /// (m). Zero while a set holds the state, and where there are no sets.
    pub fn zmp_error(&self) -> Vector2<f64> {
        self.sets.zmp_error(0, &self.tested)
    }

    /// The ZMP is at `zmp` (world), after a landing, say, and whatever gain is next starts from the state reached.
    pub fn start_anew(&mut self, zmp: Point2<f64>) {
        self.zmp_state = zmp;
        self.held = false;
        self.anew = true;
    }

    /// Margin of the slowest gain's set for another state of the COM (world) on the support of the last tick, e.g. the
    /// true one.
    pub fn margin_at(&self, com: Point2<f64>, com_vel: Vector2<f64>) -> f64 {
        let Some(support) = &self.support else { return f64::NEG_INFINITY };
        let frame = &support.frame;
        let (com, com_vel) = (frame.inverse_transform_point(&com), frame.inverse_transform_vector(&com_vel));
        let state = State::new(com, com_vel, self.tested.zmp());
        self.sets.margin(0, &state)
    }

    /// For a picture: the slice of each gain's set over the COM, at the COM velocity and ZMP of the last tick, slow to fast:
    /// corners in the world (m), none where the set holds no such state.
    pub fn slices(&self) -> Vec<Vec<Point2<f64>>> {
        let frame = self.support.map_or_else(Isometry2::identity, |support| support.frame);
        let slice = |gain| self.sets.slice(gain, &self.tested).iter().map(|corner| frame * corner).collect();
        (0..self.sets.len()).map(slice).collect()
    }

    /// Whether some set held the state of the last tick.
    pub fn is_held(&self) -> bool {
        self.held
    }

    fn choose(&mut self, state: &State) -> Decision {
        self.margin = self.sets.margin(0, state);
        let before = self.gain;
        let holding = self.sets.fastest_holding(state);
        self.gain = match holding {
            Some(fastest) if fastest > before => (before..=fastest)
                .rev()
                .find(|&i| i == before || self.sets.margin(i, state) > MARGIN_TO_SPEED_UP)
                .unwrap_or(before),
            Some(fastest) => fastest,
            None => 0,
        };
        let held_before = std::mem::replace(&mut self.held, holding.is_some());
        let anew = std::mem::take(&mut self.anew);
        Decision { zmp: None, held: self.held, starts: anew || self.gain != before || (self.held && !held_before) }
    }

    /// The nearest point of the allowed support, control frame.
    fn keep_inside(&self, zmp: Point2<f64>) -> Point2<f64> {
        match &self.allowed {
            Some(polygon) => polygon.nearest(zmp),
            None => zmp,
        }
    }
}
