//! The visible scene as plain data: the robot's solids as triangles, the ground as faces, and one list of marks. The
//! window of `view` and the page of a replay draw it, each on the graphics card, and so alike.
//!
//! To add a mark, add an [`Overlay`] with its look and its style, which says what it shows of a snapshot. The parts of
//! marks that lie flat over the picture (signs, outlines, arrows) come from `strokes`, in points of a screen, so that
//! they have the same size for robots of any size, and the robot never hides them.

#![forbid(unsafe_code)]

mod events;
mod ground;
mod marks;
pub mod mesh;
pub mod palette;
pub mod pendulum;
mod sign;
mod strokes;
mod words;

pub use events::{Event, EventKind, events};
pub use ground::{GroundFace, GroundPart, faces};
pub use marks::{Drawing, SceneMark, arrow_along, on_ground};
use mesh::DrawnMesh;
use nalgebra::{Isometry3, Point3};
use palette::Overlay;
pub use sign::{FlatShape, ScreenPoint};
use standfast_core::robot::{Kinematics, Posture, Robot, SizeRatio, Solid};
use standfast_sim::episode::Snapshot;
use standfast_sim::{Ground, Push};
pub use strokes::{Stroke, arrow, strokes};
pub use words::{PHASES, doing, without_gain};

/// UT-mu2 at home, for which the window and pages were made: height of its COM (m), and its mass (kg).
const UT_MU2: (f64, f64) = (0.31, 8.0);

/// The ratios of a robot to UT-mu2. Marks grow with its length, and the pull of the mouse with its weight.
pub fn scale(robot: &Robot) -> SizeRatio {
    SizeRatio {
        length: robot.home_com_height() / UT_MU2.0,
        mass: robot.mass() / UT_MU2.1,
    }
}

/// A robot that can be drawn in any posture, and the ground on which it stands.
pub struct Stage<'a> {
    pub robot: &'a Robot,
    pub scale: SizeRatio,
    /// The ground with its final slope; each snapshot has the slope of its time.
    ground: Ground,
    /// The solids, opaque ones first.
    solids: Vec<Surface>,
}

/// A solid of the robot, or of a pendulum that pushes it.
pub struct Surface {
    /// Index into `Robot::links`; None for the pendulum.
    pub link: Option<usize>,
    /// RGBA, 0 to 1.
    pub color: [f64; 4],
    /// The mesh in the frame of the link, or of the [pendulum] (m).
    pub mesh: DrawnMesh,
    /// A ball that contains the solid: its centre in that frame, and its radius (m).
    pub ball: (Point3<f64>, f64),
}

impl<'a> Stage<'a> {
    pub fn new(robot: &'a Robot, ground: Ground) -> Self {
        let links = robot.links.iter().enumerate();
        let drawn = links.flat_map(|(i, link)| link.drawn().iter().map(move |solid| (i, solid)));
        let mut solids: Vec<Surface> = drawn
            .map(|(link, solid)| Surface::of(Some(link), solid))
            .collect();
        solids.sort_by_key(Surface::is_translucent);
        Self {
            robot,
            scale: scale(robot),
            ground,
            solids,
        }
    }

    /// Adds the pendulum of one of these pushes, if there is one.
    pub fn with_pendulum(mut self, pushes: &[Push]) -> Self {
        let bob = pushes.iter().find_map(|push| push.bob);
        let solids = bob.iter().flat_map(pendulum::solids);
        self.solids
            .splice(0..0, solids.map(|solid| Surface::of(None, &solid)));
        self
    }

    /// The ground with the slope of a snapshot.
    pub fn ground(&self, now: &Snapshot) -> Ground {
        Ground {
            slope: now.slope,
            ..self.ground
        }
    }

    /// The kinematics of the robot in a posture.
    pub fn kinematics(&self, posture: &Posture) -> Kinematics {
        Kinematics::at(self.robot, posture)
    }

    /// The solids of the robot, each with the pose of its link, and those of the pendulum, if its rope is somewhere.
    pub fn solids(
        &self,
        kinematics: &Kinematics,
        rope: Option<[Point3<f64>; 2]>,
    ) -> impl Iterator<Item = (&Surface, Isometry3<f64>)> {
        let hanging = rope.map(pendulum::pose);
        self.solids.iter().filter_map(move |solid| {
            let pose = match solid.link {
                Some(link) => Some(*kinematics.link_pose(link)),
                None => hanging,
            };
            Some((solid, pose?))
        })
    }

    /// The marks of a moment, in the order in which they are drawn.
    pub fn marks(&self, now: &Snapshot, shown: &[Overlay]) -> Vec<SceneMark> {
        marks::of(now, &self.ground(now), self.scale, shown)
    }
}

impl Surface {
    fn of(link: Option<usize>, solid: &Solid) -> Self {
        let (center, radius_m) = solid.shape.ball();
        Self {
            link,
            color: solid.color,
            mesh: DrawnMesh::of(&solid.shape).at(&solid.pose),
            ball: (solid.pose * center, radius_m),
        }
    }

    pub fn is_translucent(&self) -> bool {
        self.color[3] < 1.0
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn all_factors_are_one_for_ut_mu2() {
        let scale = super::scale(&standfast_robots::load("ut-mu2").unwrap());
        for one in [scale.length, scale.mass, scale.force_per_length()] {
            assert!((one - 1.0).abs() < 0.01, "{scale:?}");
        }
    }
}
