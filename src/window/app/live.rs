//! A live simulation, in which the user pushes and pulls the robot and chooses the controller.

use super::camera::Lens;
use super::pick::{Grab, pick_near};
use super::simulation::Simulation;
use super::world::LiveSetup;
use kiss3d::egui::Pos2;
use nalgebra::Point3;
use standfast_core::robot::Units;
use standfast_scene::palette::{AFTERGLOW_S, Overlay};
use standfast_scene::{SceneMark, Stage, arrow_along};
use standfast_sim::Push;
use standfast_sim::episode::snapshot::Arrow;
use standfast_sim::episode::{Outcome, Snapshot};
use standfast_study::ask::entrant::Entrant;

/// Force below which a push is over (N).
const LEAST_N: f64 = 0.1;

/// A running simulation, with a ghost that gets the same pushes and pulls.
pub struct Live<'a> {
    pub world: &'a LiveSetup,
    pub shown: Simulation<'a>,
    pub ghost: Option<Simulation<'a>>,
    /// The pull of the mouse on a link, if it holds one.
    pub grab: Option<Grab>,
    /// The last push: the time until which it is shown (s), and its last force.
    lingering: Option<(f64, Arrow)>,
    pub counts: LiveCounts,
    /// Position of the COM at the start (m).
    start: Point3<f64>,
}

/// Counts of events since the window was opened.
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

/// A number of things with the noun in singular or plural.
pub fn several(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

impl<'a> Live<'a> {
    /// A simulation that starts at rest at home, with the first controller.
    pub fn new(world: &'a LiveSetup) -> Self {
        Self::start(world, 0, LiveCounts::default())
    }

    /// Starts again, with the present controller.
    pub fn restart(&mut self) {
        let counts = LiveCounts {
            restarts: self.counts.restarts + 1,
            ..self.counts
        };
        *self = Self::start(self.world, self.shown.acting, counts);
    }

    fn start(world: &'a LiveSetup, acting: usize, counts: LiveCounts) -> Self {
        let shown = Simulation::start(world, &world.configs[0], acting);
        let ghost = world.configs.get(1);
        let ghost = ghost.map(|config| Simulation::start(world, config, 1));
        let start = shown.now.com;
        Self {
            world,
            shown,
            ghost,
            grab: None,
            lingering: None,
            counts,
            start,
        }
    }

    /// Simulates one control period. Returns false if the simulation cannot continue, because it has diverged or its
    /// controller failed. The force of the mouse on the shown robot also acts on the same link of the ghost.
    pub fn advance(&mut self) -> bool {
        let pull = self.grab.map(|grab| grab.pull(&self.shown.kinematics));
        let fell_before = self.shown.record().fell_at_s.is_some();
        if !self.shown.advance(pull) {
            return false;
        }
        if let Some(ghost) = &mut self.ghost {
            ghost.advance(pull);
        }
        let now = &self.shown.now;
        self.counts.ticks += 1;
        self.counts.falls += u32::from(!fell_before && self.shown.record().fell_at_s.is_some());
        self.counts.drag_n = pull
            .iter()
            .map(|pull| pull.force.norm())
            .fold(self.counts.drag_n, f64::max);
        self.counts.com_m = self.counts.com_m.max((now.com - self.start).xy().norm());
        if let Some(push) = now
            .push
            .filter(|push| pull.is_none() && push.force.norm() > LEAST_N)
        {
            self.lingering = Some((now.time_s + AFTERGLOW_S, push));
        }
        true
    }

    /// Pushes the robot, from now on.
    pub fn push(&mut self, impulse_n_s: f64, heading_deg: f64) {
        let start_s = self.shown.now.time_s;
        let push = Push {
            impulse_n_s,
            heading_deg,
            start_s,
            ..Push::first(&Units::of(&self.world.robot))
        };
        for robot in self.both() {
            robot.push(push);
        }
        self.counts.pushes += 1;
    }

    /// The robot and its ghost.
    fn both(&mut self) -> impl Iterator<Item = &mut Simulation<'a>> {
        std::iter::once(&mut self.shown).chain(&mut self.ghost)
    }

    /// The robots by the words for them.
    pub fn robots(&self) -> impl Iterator<Item = (&'static str, &Simulation<'a>)> {
        ["solid", "ghost"]
            .into_iter()
            .zip(std::iter::once(&self.shown).chain(&self.ghost))
    }

    /// Controller and engine of a robot.
    pub fn entrant(&self, robot: &Simulation) -> String {
        let engine = robot.config.engine;
        format!("{} in {}", self.controller(robot.acting), engine.title())
    }

    /// The name of the controller of this index, without an engine.
    pub fn controller(&self, index: usize) -> &str {
        Entrant::split(&self.world.factories[index].name).controller
    }

    /// Begins to pull on a link.
    pub fn take(&mut self, grab: Grab) {
        self.grab = Some(grab);
        self.counts.drags += 1;
        for robot in self.both() {
            robot.judge_anew();
        }
    }

    /// Ends the pull.
    pub fn let_go(&mut self) {
        if self.grab.take().is_some() {
            for robot in self.both() {
                robot.judge_anew();
            }
        }
    }

    /// Continues with the controller of this index, if there is one. The ghost keeps its own.
    pub fn switch_to(&mut self, index: usize) {
        if index < self.world.factories.len() && index != self.shown.acting {
            self.shown.switch_to(index);
            self.counts.switches += 1;
        }
    }

    /// The marks, among them a push that acts or has just ended. The pull of the mouse replaces the push.
    pub fn marks(&self, stage: &Stage, shown: &[Overlay]) -> Vec<SceneMark> {
        let now = &self.shown.now;
        let lingering = self
            .lingering
            .filter(|(until_s, _)| self.grab.is_none() && now.time_s <= *until_s);
        let push = lingering.map(|(_, push)| push);
        let mut marks = stage.marks(
            &Snapshot {
                push,
                ..now.clone()
            },
            shown,
        );
        let hand = self
            .grab
            .filter(|_| shown.contains(&Overlay::Push))
            .map(|grab| grab.arrow(&self.shown.kinematics));
        // The arrow begins at the pulled point.
        let drawing = hand.and_then(|hand| arrow_along(Overlay::Push, &hand, false, stage.scale));
        marks.extend(drawing.map(|drawing| SceneMark {
            overlay: Overlay::Push,
            drawing,
        }));
        marks
    }

    /// Name of the link that a drag from this place would pull. None while a link is pulled.
    pub fn link_at(&self, stage: &Stage, lens: &Lens, mouse: Pos2) -> Option<&str> {
        let hit = pick_near(stage, &self.shown.kinematics, lens, mouse)
            .filter(|_| self.grab.is_none())?;
        Some(self.world.simulated.links[hit.link].name.as_str())
    }

    /// The state of the robot or its ghost in words, and whether this state is bad.
    pub fn verdict_on(&self, robot: &Simulation) -> (String, bool) {
        let record = robot.record();
        match (record.outcome, record.settled_at_s) {
            (Outcome::Fell | Outcome::Broke, _) => {
                let cause = record.fall_cause.as_deref().unwrap_or("out of bounds");
                (
                    format!(
                        "{} at {:.2} s: {cause}",
                        record.outcome.name(),
                        record.fell_at_s.unwrap_or(record.end_s)
                    ),
                    true,
                )
            }
            (Outcome::Diverged | Outcome::Failed, _) => (
                format!("{} at {:.2} s", record.outcome.name(), record.end_s),
                true,
            ),
            _ if self.grab.is_some() => ("held by hand".into(), false),
            (_, Some(since_s)) => (format!("has stood still since {since_s:.2} s"), false),
            (_, None) => ("in motion".into(), false),
        }
    }

    /// The events since the start, in two lines, and a line on each robot.
    pub fn account(&self) -> String {
        let counts = self.counts;
        let robots: String = self
            .robots()
            .map(|(which, robot)| {
                let (verdict, _) = self.verdict_on(robot);
                format!("\n{which}, {}: {verdict}", self.entrant(robot))
            })
            .collect();
        format!(
            "{}, {} (up to {:.1} N), {}, {}, {}; the COM was up to {:.1} mm from its start\n\
             {} ({} single), {:.3} s simulated{robots}",
            several(counts.pushes.into(), "push", "pushes"),
            several(counts.drags.into(), "drag", "drags"),
            counts.drag_n,
            several(
                counts.switches.into(),
                "change of controller",
                "changes of controller"
            ),
            several(counts.restarts.into(), "restart", "restarts"),
            several(counts.falls.into(), "fall", "falls"),
            1000.0 * counts.com_m,
            several(counts.ticks, "tick", "ticks"),
            counts.single_ticks,
            counts.ticks as f64 * self.world.configs[0].control_period_s
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::camera;
    use super::*;
    use kiss3d::egui::vec2;
    use standfast_sim::episode::EpisodeConfig;

    /// A ghost in the same engine moves to the last bit as the robot does, whatever the user does to the robot.
    #[test]
    fn what_happens_to_the_robot_happens_to_its_ghost() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let config = EpisodeConfig::of(&Units::of(&robot));
        let controllers = ["catch", "catch", "hold"].map(|name| {
            let controller = standfast_controllers::load(name).unwrap();
            controller.prepare(&robot, config.control_period_s).unwrap()
        });
        let world = LiveSetup::new(robot, controllers.into(), vec![config; 2], None, None);
        let mut live = Live::new(&world);
        let stage = world.stage();
        let lens = Lens::new(&camera(stage.scale), vec2(860.0, 720.0));
        let mut seen_n = Vec::new();
        for k in 0..700 {
            match k {
                10 => live.push(2.0, 90.0),
                300 => {
                    let mouse = lens.project(&live.shown.now.com).unwrap();
                    let kinematics = &live.shown.kinematics;
                    let hit = pick_near(&stage, kinematics, &lens, mouse).unwrap();
                    let mut grab = Grab::new(
                        hit,
                        &lens.sight(mouse),
                        kinematics,
                        lens.looking(),
                        stage.scale,
                    );
                    grab.follow(&lens.sight(mouse + vec2(60.0, 0.0)));
                    live.take(grab);
                }
                400 => live.let_go(),
                600 => live.restart(),
                _ => {}
            }
            assert!(live.advance());
            let ghost = live.ghost.as_ref().unwrap();
            assert_eq!(
                (ghost.now.time_s, ghost.now.com),
                (live.shown.now.time_s, live.shown.now.com),
                "tick {k}"
            );
            seen_n.extend(ghost.now.push.map(|push| push.force.norm()));
        }
        live.switch_to(2);
        assert!(live.advance());
        let gains = [&live.shown, live.ghost.as_ref().unwrap()].map(|robot| &robot.now.gain);
        assert!(
            gains[0].is_none() && gains[1].is_some(),
            "the ghost keeps its controller: {gains:?}"
        );
        assert!(
            seen_n.len() > 100 && live.counts.pushes + live.counts.drags == 2,
            "{} ticks",
            seen_n.len()
        );
        assert!(live.shown.now.time_s < 0.21, "it began anew");
    }
}
