//! A live simulation, in which the user pushes and pulls the robot and chooses the gain set.

use super::pick::Grab;
use super::plots::{Plotted, Trail};
use super::world::World;
use crate::episode::snapshot::Arrow;
use crate::episode::{ClosedLoop, Controlled, Outcome, Record, Referee, Snapshot};
use crate::robot::Kinematics;
use crate::sim::Push;
use nalgebra::Point3;

/// Duration of a push by key (s), the same as the default of campaigns.
const PUSH_S: f64 = 0.05;
/// How long a push stays in the picture after its end (s), since it may be shorter than a frame.
const LINGERING_S: f64 = 0.25;

/// A push with less force than this is over (N).
const LEAST_N: f64 = 0.1;

/// A running simulation.
pub struct Live<'a> {
    pub world: &'a World,
    closed_loop: ClosedLoop<'a>,
    referee: Referee<'a>,
    /// Index into `world.designs`.
    pub acting: usize,
    pub now: Snapshot,
    /// Kinematics of the present posture.
    pub kinematics: Kinematics,
    pub trail: Trail,
    /// The pull of the mouse on a link, if it holds one.
    pub grab: Option<Grab>,
    /// The last push: the time until which it is shown (s), and its last force.
    lingering: Option<(f64, Arrow)>,
    pub counts: LiveCounts,
    /// Position of the COM at the start (m).
    start: Point3<f64>,
}

/// Counts of what happened since the window was opened.
#[derive(Debug, Clone, Copy, Default)]
pub struct LiveCounts {
    pub pushes: u32,
    pub drags: u32,
    /// Largest force of a drag (N).
    pub drag_n: f64,
    pub switches: u32,
    pub restarts: u32,
    pub ticks: u64,
    /// Number of ticks that were simulated one by one.
    pub single_ticks: u32,
    pub falls: u32,
    /// Largest horizontal distance of the COM from its start (m).
    pub com_m: f64,
}

impl<'a> Live<'a> {
    /// A simulation that starts at rest at home, with the first gain set.
    pub fn new(world: &'a World) -> Self {
        Self::start(world, 0, LiveCounts::default())
    }

    /// Starts again, with the gain set that acts now.
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

    /// Simulates one control period. False if the simulation cannot go on, since it has diverged.
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

    /// Pushes the robot, from now on.
    pub fn push(&mut self, impulse_n_s: f64, heading_deg: f64) {
        let start_s = self.now.time_s;
        self.closed_loop.pushes.push(Push { impulse_n_s, heading_deg, duration_s: PUSH_S, start_s, ..Push::default() });
        self.counts.pushes += 1;
        self.judge_anew();
    }

    /// Judges anew after a push, a pull or a change of gains, unless the robot has fallen. The referee waits for the
    /// last push to end.
    fn judge_anew(&mut self) {
        if matches!(self.referee.record.outcome, Outcome::TimedOut | Outcome::Recovered) {
            self.referee = Referee::new(&self.world.simulated, &self.world.config, &self.closed_loop.pushes);
        }
    }

    /// Begins to pull on a link.
    pub fn take(&mut self, grab: Grab) {
        self.grab = Some(grab);
        self.counts.drags += 1;
        self.judge_anew();
    }

    /// Ends the pull.
    pub fn let_go(&mut self) {
        if self.grab.take().is_some() {
            self.judge_anew();
        }
    }

    /// Goes on with the gain set of this index, if there is one.
    pub fn switch_to(&mut self, index: usize) {
        if let Some(design) = self.world.designs.get(index).filter(|_| index != self.acting) {
            self.acting = index;
            self.closed_loop.switch_to(design);
            self.counts.switches += 1;
            self.judge_anew();
        }
    }

    /// The force of a push that acts or has just ended (None while the mouse pulls), and the force of the mouse.
    pub fn forces(&self) -> (Option<Arrow>, Option<Arrow>) {
        let lingering = self.lingering.filter(|(until_s, _)| self.grab.is_none() && self.now.time_s <= *until_s);
        (lingering.map(|(_, push)| push), self.grab.map(|grab| grab.arrow(&self.kinematics)))
    }

    pub fn record(&self) -> &Record {
        &self.referee.record
    }
}
