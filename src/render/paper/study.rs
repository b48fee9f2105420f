//! What the page is made from: the runs of the paper's scenarios and the sets of its gain set, as plain data.

use crate::control::Design;
use crate::episode::imposed::ImposedRecord;
use crate::episode::{Film, Footstep, Judge, Record};
use crate::geometry::SupportPolygon;
use crate::lipm::cpi_set::{CpiSet, Inclusion};
use crate::lipm::pendulum::State;
use crate::lipm::stepping::Stepping;
use crate::render::figure::motion::MotionPlot;
use crate::robot::{Foot, PerFoot, Robot};
use crate::sim::Push;
use nalgebra::{Isometry2, Point2, Vector2};

/// Everything that the figures show.
pub struct Study {
    pub robot: Robot,
    pub design: Design,
    pub rules: Stepping,
    /// What "stands still" and "home" are in all runs.
    pub judge: Judge,
    /// From the right sole's centre to the left's at home, and the COM, over the ground (m).
    pub stance: Vector2<f64>,
    pub com: Point2<f64>,
    /// Support of both soles at home, control frame; what of it the ZMP may use, and the sets on that.
    pub home: SupportPolygon,
    pub allowed: SupportPolygon,
    pub sets: Vec<CpiSet>,
    pub inclusion: Inclusion,
    /// The same where the first push has led to.
    pub landed_allowed: SupportPolygon,
    pub landed_sets: Vec<CpiSet>,
    /// Sect. VI, Fig. 12 to 14: (a) from behind, (b) from diagonally forward left.
    pub pushes: [Pushed; 2],
    /// The push of Fig. 13 towards some headings, then pushes whose ZMP errors come close to those of Sect. V.C.
    pub tried: Vec<(Push, Record)>,
    /// Sect. V.C, Fig. 8 and 9: (a), (b).
    pub errors: [ImposedRun; 2],
    /// The same errors, made by a COM that moves.
    pub moving: [ImposedRecord; 2],
}

/// A push in physics that leads to a footstep.
pub struct Pushed {
    pub push: Push,
    pub film: Film,
    /// The first.
    pub footstep: Footstep,
    /// Its support is what carries load.
    pub motion: MotionPlot,
    pub lift: Stand,
    pub landing: Stand,
    pub seen: Seen,
    /// The same push, by a set of the same gains that takes no footstep, and by a robot that keeps its posture.
    pub without_footstep: Record,
    pub stiff: Record,
}

/// What is seen of a pushed run beyond its record and its film.
#[derive(Debug, Default)]
pub struct Seen {
    /// The last tick on both feet before the first lift, and the first one after its landing.
    pub lift: Option<Stand>,
    pub landing: Option<Stand>,
    /// Of every tick: which soles carry load.
    pub loaded: Vec<PerFoot<bool>>,
    /// In the first swing, of the sole that stands: its largest angle to the ground, and its largest turn about the vertical
    /// since the lift (degrees, to the left).
    pub stance_tip_deg: f64,
    pub stance_turn_deg: f64,
    /// For how long the torque of each joint was at its limit (s).
    pub at_limit_s: Vec<f64>,
}

/// What the controller knows while it stands on both feet.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    pub time_s: f64,
    /// Control frame to world.
    pub frame: Isometry2<f64>,
    /// Support, control frame.
    pub polygon: SupportPolygon,
    /// As estimated, with the ZMP wanted; control frame.
    pub state: State,
    /// Centres and headings of the soles, world.
    pub soles: PerFoot<Isometry2<f64>>,
    /// On each sole (N).
    pub load_n: PerFoot<f64>,
}

/// An imposed error, without physics.
pub struct ImposedRun {
    pub record: ImposedRecord,
    /// The first.
    pub footstep: Footstep,
    /// Of every tick.
    pub motion: MotionPlot,
}

impl Study {
    /// Middle of a sole at home (m).
    pub fn sole_at_home(&self, foot: Foot) -> Point2<f64> {
        Point2::from(0.5 * foot.side() * self.stance)
    }

    /// Corners of a sole about its centre (m).
    pub fn sole(&self) -> [Point2<f64>; 4] {
        self.robot.soles.left.corners().map(|corner| corner.xy())
    }

    /// The records of all pushes, those of the figures first.
    pub fn records(&self) -> impl Iterator<Item = (&Push, &Record)> {
        let tried = self.tried.iter().map(|(push, record)| (push, record));
        self.pushes.iter().map(|pushed| (&pushed.push, &pushed.film.record)).chain(tried)
    }
}

impl Pushed {
    /// When it stands still, or else its end (s).
    pub fn end_s(&self) -> f64 {
        self.film.record.settled_at_s.unwrap_or(self.film.record.end_s)
    }

    /// Moments that tell the story: index of a snapshot, and what happens.
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
        .map(|(at, what)| (snapshots.partition_point(|s| s.time_s < at - 1e-9).min(snapshots.len() - 1), what))
    }
}
