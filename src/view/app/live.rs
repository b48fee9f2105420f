//! The robot live in the closed loop: pushed, pulled, and with the gain set that a person chooses.

use super::pick::Grab;
use super::plots::{Plotted, Trail};
use super::world::World;
use crate::episode::snapshot::Arrow;
use crate::episode::{ClosedLoop, Controlled, Outcome, Record, Referee, Snapshot};
use crate::robot::Kinematics;
use crate::sim::Push;
use nalgebra::Point3;

/// Duration of a push by key (s), that of a campaign's.
const PUSH_S: f64 = 0.05;
/// For how long a push stays in the picture after its end (s): it is shorter than many a frame.
const LINGERING_S: f64 = 0.25;

/// A push that weakens to less is over (N).
const LEAST_N: f64 = 0.1;

/// A running simulation.
pub struct Live<'a> {
    pub world: &'a World,
    closed_loop: ClosedLoop<'a>,
    referee: Referee<'a>,
    /// Index into `world.designs`.
    pub acting: usize,
    pub now: Snapshot,
    /// Where the links are now.
    pub kinematics: Kinematics,
    pub trail: Trail,
    /// A hand that holds a link.
    pub grab: Option<Grab>,
    /// The last push that acted: to when (s), and as it was last seen.
    lingering: Option<(f64, Arrow)>,
    pub counts: LiveCounts,
    /// Of the COM.
    start: Point3<f64>,
}

/// What happened since the window was opened.
#[derive(Debug, Clone, Copy, Default)]
pub struct LiveCounts {
    pub pushes: u32,
    pub drags: u32,
    /// The largest force of a drag (N).
    pub drag_n: f64,
    pub switches: u32,
    pub restarts: u32,
    pub ticks: u64,
    /// Of the ticks, those that were asked for one by one.
    pub single_ticks: u32,
    pub falls: u32,
    /// How far the COM was from where it began, over the ground, at most (m).
    pub com_m: f64,
}

impl<'a> Live<'a> {
    /// At home, at rest, with the first gain set.
    pub fn new(world: &'a World) -> Self {
        Self::start(world, 0, LiveCounts::default())
    }

    /// From the start again, with the gain set that acts now.
    pub fn restart(&mut self) {
        let counts = LiveCounts { restarts: self.counts.restarts + 1, ..self.counts };
        *self = Self::start(self.world, self.acting, counts);
    }

    fn start(world: &'a World, acting: usize, counts: LiveCounts) -> Self {
        let (robot, simulated) = (&world.robot, &world.simulated);
        let mut closed_loop =
            ClosedLoop::new(robot, simulated, &world.designs[acting], &world.config, world.disturbance());
        let mut referee = Referee::new(simulated, &world.config, &closed_loop.pushes);
        let tick = closed_loop.tick();
        referee.watch(&tick);
        let now = Snapshot::of(simulated, &tick);
        let mut kinematics = Kinematics::new(simulated);
        kinematics.update(simulated, &now.posture);
        let (trail, start) = (std::iter::once(Plotted::of(&now)).collect(), now.com);
        Self { world, closed_loop, referee, acting, now, kinematics, trail, grab: None, lingering: None, counts, start }
    }

    /// One control period. False once the simulation has no numbers left to go on with.
    pub fn advance(&mut self) -> bool {
        if self.referee.record.outcome == Outcome::Diverged {
            return false;
        }
        let pull = self.grab.map(|grab| grab.pull(&self.kinematics));
        self.closed_loop.pull(pull);
        self.closed_loop.advance();
        let tick = self.closed_loop.tick();
        let fell_before = self.referee.record.fell_at_s.is_some();
        self.referee.watch(&tick);
        if !tick.truth.is_finite() {
            return false;
        }
        self.counts.ticks += 1;
        self.counts.falls += u32::from(!fell_before && self.referee.record.fell_at_s.is_some());
        self.counts.drag_n = pull.iter().map(|pull| pull.force.norm()).fold(self.counts.drag_n, f64::max);
        self.now = Snapshot::of(&self.world.simulated, &tick);
        self.kinematics.update(&self.world.simulated, &self.now.posture);
        self.trail.push(Plotted::of(&self.now));
        self.counts.com_m = self.counts.com_m.max((self.now.com - self.start).xy().norm());
        if let Some(push) = self.now.push.filter(|push| pull.is_none() && push.force.norm() > LEAST_N) {
            self.lingering = Some((self.now.time_s + LINGERING_S, push));
        }
        true
    }

    /// A push that starts now.
    pub fn push(&mut self, impulse_n_s: f64, heading_deg: f64) {
        let start_s = self.now.time_s;
        self.closed_loop.pushes.push(Push { impulse_n_s, heading_deg, duration_s: PUSH_S, start_s, ..Push::default() });
        self.counts.pushes += 1;
        self.judge_anew();
    }

    /// What was judged is no longer true after a push, a pull, or with other gains. The judge waits for the last push
    /// to end; it need not watch who has fallen.
    fn judge_anew(&mut self) {
        if matches!(self.referee.record.outcome, Outcome::TimedOut | Outcome::Recovered) {
            self.referee = Referee::new(&self.world.simulated, &self.world.config, &self.closed_loop.pushes);
        }
    }

    /// Takes hold of a link.
    pub fn take(&mut self, grab: Grab) {
        self.grab = Some(grab);
        self.counts.drags += 1;
        self.judge_anew();
    }

    /// Lets go.
    pub fn let_go(&mut self) {
        if self.grab.take().is_some() {
            self.judge_anew();
        }
    }

    /// Goes on with another gain set of the world, if it has so many.
    pub fn switch_to(&mut self, index: usize) {
        if let Some(design) = self.world.designs.get(index).filter(|_| index != self.acting) {
            self.acting = index;
            self.closed_loop.switch_to(design);
            self.counts.switches += 1;
            self.judge_anew();
        }
    }

    /// The force of a push that acts or acted a moment ago, unless a hand holds the robot; and that of the hand.
    pub fn forces(&self) -> (Option<Arrow>, Option<Arrow>) {
        let lingering = self.lingering.filter(|(until_s, _)| self.grab.is_none() && self.now.time_s <= *until_s);
        (lingering.map(|(_, push)| push), self.grab.map(|grab| grab.arrow(&self.kinematics)))
    }

    pub fn record(&self) -> &Record {
        &self.referee.record
    }
}
