//! The data of the page: the runs of the paper's scenarios, and the CPI sets of the paper's controller.

use crate::imposed::ImposedRecord;
use nalgebra::{Isometry2, Point2, Vector2, Vector3};
use standfast::core::control::Design;
use standfast::core::geometry::SupportPolygon;
use standfast::core::lipm::cpi_set::{CpiSet, Inclusion};
use standfast::core::lipm::pendulum::State;
use standfast::core::lipm::stepping::Stepping;
use standfast::core::robot::{Foot, PerFoot, Robot};
use standfast::report::figure::motion::MotionPlot;
use standfast::sim::Push;
use standfast::sim::episode::{Film, Footstep, Judge, Record};
use standfast::sim::pendulum::FoamForce;

/// All runs and CPI sets that the figures show.
pub struct Study {
    pub robot: Robot,
    pub design: Design,
    pub rules: Stepping,
    /// The thresholds of "stands still" and "home", the same in all runs.
    pub judge: Judge,
    /// Offset from the centre of the right sole to the centre of the left sole at home (m).
    pub stance: Vector2<f64>,
    /// The COM over the ground at home (m).
    pub com: Point2<f64>,
    /// Support of both soles at home (control frame).
    pub home: SupportPolygon,
    /// The part of `home` that the ZMP may use.
    pub allowed: SupportPolygon,
    /// The maximal CPI sets for the region `allowed`, slow to fast.
    pub sets: Vec<CpiSet>,
    pub inclusion: Inclusion,
    /// The part of the support after the footstep of the first push that the ZMP may use, and its maximal CPI sets.
    pub landed_allowed: SupportPolygon,
    pub landed_sets: Vec<CpiSet>,
    /// The pushes of Sect. VI and Fig. 12 to 14: (a) from behind, (b) from diagonally forward left.
    pub pushes: [Pushed; 2],
    /// The push of Fig. 13 with other headings, then pushes whose ZMP errors come close to the imposed errors of Sect.
    /// V.C.
    pub tried: Vec<(Push, Record)>,
    /// Strikes of the gauge on wires (Fig. 10), (a) from behind and (b) from diagonally forward left, each from soft to hard.
    pub struck: [Vec<Struck>; 2],
    /// The imposed errors (a) and (b) of Sect. V.C, Fig. 8 and 9.
    pub errors: [ImposedRun; 2],
    /// The same errors as the result of a moving COM.
    pub moving: [ImposedRecord; 2],
}

/// The run of a strike by the gauge.
pub struct Struck {
    pub push: Push,
    pub record: Record,
    /// The trace of the gauge.
    pub forces: Vec<FoamForce>,
    /// What the robot gets (N s, world frame), summed over the ticks.
    pub impulse: Vector3<f64>,
}

/// The run of a push that leads to a footstep, with physics.
pub struct Pushed {
    pub push: Push,
    pub film: Film,
    pub footstep: Footstep,
    /// The motion of every tick. Its support is the hull of the soles that carry load.
    pub motion: MotionPlot,
    pub lift: Stand,
    pub landing: Stand,
    pub seen: Seen,
    /// The same push with the same gains but no footstep, and with a robot that holds its posture.
    pub without_footstep: Record,
    pub stiff: Record,
}

/// What the page needs of a pushed run beyond its record and its film.
#[derive(Debug, Default)]
pub struct Seen {
    /// The last tick on both feet before the first lift, and the first tick on both feet after the landing.
    pub lift: Option<Stand>,
    pub landing: Option<Stand>,
    /// Which soles carry load, for every tick.
    pub loaded: Vec<PerFoot<bool>>,
    /// Largest angle between the stance sole and the ground in the first swing, and its largest turn about the vertical
    /// since the lift (degrees; positive to the left).
    pub stance_tip_deg: f64,
    pub stance_turn_deg: f64,
    /// Time for which the torque of each joint was at its limit (s).
    pub at_limit_s: Vec<f64>,
}

/// The controller's estimates at a tick on both feet.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    pub time_s: f64,
    /// Pose of the control frame in the world.
    pub frame: Isometry2<f64>,
    /// Support (control frame).
    pub polygon: SupportPolygon,
    /// Estimated COM and COM velocity, with the commanded ZMP (control frame).
    pub state: State,
    /// Centres and headings of the soles (world frame).
    pub soles: PerFoot<Isometry2<f64>>,
    /// Load on each sole (N).
    pub load_n: PerFoot<f64>,
}

/// The run of an imposed ZMP error, without physics.
pub struct ImposedRun {
    pub record: ImposedRecord,
    pub footstep: Footstep,
    /// The motion of every tick.
    pub motion: MotionPlot,
}

impl Study {
    /// Centre of a sole at home (m, control frame).
    pub fn sole_at_home(&self, foot: Foot) -> Point2<f64> {
        Point2::from(0.5 * foot.side() * self.stance)
    }

    /// Corners of a sole about its centre (m).
    pub fn sole(&self) -> [Point2<f64>; 4] {
        self.robot.soles.left.corners().map(|corner| corner.xy())
    }

    /// The records of all pushes, the pushes of the figures first.
    pub fn records(&self) -> impl Iterator<Item = (&Push, &Record)> {
        let tried = self.tried.iter().map(|(push, record)| (push, record));
        self.pushes
            .iter()
            .map(|pushed| (&pushed.push, &pushed.film.record))
            .chain(tried)
    }
}

impl Pushed {
    /// Time from which on the robot stands still, or else the end of the episode (s).
    pub fn end_s(&self) -> f64 {
        self.film
            .record
            .settled_at_s
            .unwrap_or(self.film.record.end_s)
    }

    /// The moments that the snapshots show: index into the snapshots of the film, and what happens.
    pub fn moments(&self) -> [(usize, &'static str); 6] {
        let (Footstep { lift_s, land_s, .. }, end_s) = (self.footstep, self.end_s());
        let snapshots = &self.film.snapshots;
        [
            (self.push.start_s + 0.5 * self.push.duration_s, "pushed"),
            (lift_s, "foot lifted"),
            (lift_s + 0.5 * (land_s - lift_s), "foot in the air"),
            (land_s, "landed"),
            (land_s + 0.2 * (end_s - land_s), "switching control"),
            (end_s, "stands still"),
        ]
        .map(|(at, what)| {
            (
                snapshots
                    .partition_point(|s| s.time_s < at - 1e-9)
                    .min(snapshots.len() - 1),
                what,
            )
        })
    }
}
