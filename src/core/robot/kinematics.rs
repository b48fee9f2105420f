//! Forward kinematics, centre of mass and Jacobians of a floating-base tree.
//!
//! The generalised velocity has 6 + n entries: velocity of the base's origin and angular velocity of the base (in world
//! axes), then the joint rates. The COM Jacobian is the paper's "COG Jacobian", which it inverts for the whole body.

use super::model::{Foot, PerFoot, PushPoint, Robot};
use nalgebra::{
    Isometry2, Isometry3, Matrix3xX, Matrix6xX, Point3, Translation3, UnitQuaternion, Vector3,
};

/// Pose of a body in the world.
pub type Pose = Isometry3<f64>;

/// A configuration: pose of the base in the world, and joint angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Posture {
    pub base: Pose,
    /// Joint angles (rad), one per joint.
    pub q: Vec<f64>,
}

/// Poses, COM and joint axes of a [`Posture`], in the world frame. It allocates only when it is made;
/// [`update`](Self::update) and the Jacobians do not.
#[derive(Debug, Clone)]
pub struct Kinematics {
    links: Vec<Pose>,
    link_coms: Vec<Point3<f64>>,
    /// Axis of each joint.
    axes: Vec<Vector3<f64>>,
    /// Mass of each link and all that it carries.
    subtree_mass: Vec<f64>,
    /// COM of each link and all that it carries.
    subtree_com: Vec<Point3<f64>>,
}

impl Kinematics {
    /// A workspace for `robot`, at zero joint angles with the base at the origin.
    pub fn new(robot: &Robot) -> Self {
        let n = robot.links.len();
        let mut subtree_mass: Vec<f64> = robot.links.iter().map(|l| l.mass_kg).collect();
        for (i, joint) in robot.joints.iter().enumerate().rev() {
            subtree_mass[joint.parent] += subtree_mass[i + 1];
        }
        let mut kinematics = Self {
            links: vec![Pose::identity(); n],
            link_coms: vec![Point3::origin(); n],
            axes: vec![Vector3::zeros(); robot.joints.len()],
            subtree_mass,
            subtree_com: vec![Point3::origin(); n],
        };
        kinematics.update(robot, &robot.zero_posture());
        kinematics
    }

    /// A workspace for `robot` in a posture.
    pub fn at(robot: &Robot, posture: &Posture) -> Self {
        let mut kinematics = Self::new(robot);
        kinematics.update(robot, posture);
        kinematics
    }

    /// A workspace for `robot` at home.
    pub fn at_home(robot: &Robot) -> Self {
        Self::at(robot, &robot.home_posture())
    }

    /// Computes all values for `posture`. `robot` must be the one for which this was made.
    pub fn update(&mut self, robot: &Robot, posture: &Posture) {
        self.links[0] = posture.base;
        for (i, (joint, &q)) in robot.joints.iter().zip(&posture.q).enumerate() {
            let rotation = UnitQuaternion::from_axis_angle(&joint.axis, q);
            let pose = self.links[joint.parent] * joint.origin * rotation;
            self.axes[i] = pose.rotation * joint.axis.into_inner();
            self.links[i + 1] = pose;
        }
        // The subtrees' sums of mass times position come first, and are then divided by their masses.
        for (i, link) in robot.links.iter().enumerate() {
            self.link_coms[i] = self.links[i] * link.com_m;
            self.subtree_com[i] = self.link_coms[i] * link.mass_kg;
        }
        for (i, joint) in robot.joints.iter().enumerate().rev() {
            let carried = self.subtree_com[i + 1].coords;
            self.subtree_com[joint.parent] += carried;
        }
        for (com, mass) in self.subtree_com.iter_mut().zip(&self.subtree_mass) {
            *com /= *mass;
        }
    }

    /// Pose of `robot.links[link]`.
    pub fn link_pose(&self, link: usize) -> &Pose {
        &self.links[link]
    }

    /// Centre of mass of `robot.links[link]`.
    pub fn link_com(&self, link: usize) -> Point3<f64> {
        self.link_coms[link]
    }

    /// Pose of `robot.frames[frame]`.
    pub fn frame_pose(&self, robot: &Robot, frame: usize) -> Pose {
        let frame = &robot.frames[frame];
        self.links[frame.link] * frame.pose
    }

    /// Pose of a sole at the centre of its contact face, with the axes of the sole's URDF frame.
    pub fn sole_pose(&self, robot: &Robot, foot: Foot) -> Pose {
        let sole = &robot.soles[foot];
        self.links[sole.link] * sole.center
    }

    /// Poses of both soles, as in [`sole_pose`](Self::sole_pose).
    pub fn sole_poses(&self, robot: &Robot) -> PerFoot<Pose> {
        PerFoot::from_fn(|foot| self.sole_pose(robot, foot))
    }

    /// Whether a joint pitches: its axis points sideways, or nearly so.
    pub fn pitches(&self, joint: usize) -> bool {
        /// Least cosine of the angle between the axis and y.
        const PITCH: f64 = 0.7;
        self.joint_axis(joint).y.abs() > PITCH
    }

    /// Axis of a joint, a unit vector.
    pub fn joint_axis(&self, joint: usize) -> Vector3<f64> {
        self.axes[joint]
    }

    /// A point on the axis of a joint: the origin of the link that the joint carries.
    pub fn joint_position(&self, joint: usize) -> Point3<f64> {
        self.links[joint + 1].translation.vector.into()
    }

    /// Centre of mass of the robot.
    pub fn com(&self) -> Point3<f64> {
        self.subtree_com[0]
    }

    /// Mass (kg) and centre of mass of a link together with all that it carries.
    pub fn subtree(&self, link: usize) -> (f64, Point3<f64>) {
        (self.subtree_mass[link], self.subtree_com[link])
    }

    /// Velocity (m/s) of the point of `robot.links[link]` that is now at `point`, if the base rests and the joints have
    /// the speeds `dq` (rad/s).
    pub fn velocity_by_joints(
        &self,
        robot: &Robot,
        link: usize,
        point: &Point3<f64>,
        dq: &[f64],
    ) -> Vector3<f64> {
        robot
            .chain(link)
            .map(|j| self.axes[j].cross(&(point - self.joint_position(j))) * dq[j])
            .sum()
    }

    fn base_origin(&self) -> Point3<f64> {
        self.links[0].translation.vector.into()
    }

    /// Jacobian of the centre of mass, 3 x (6 + n): `com_vel = J v`. `out` must have 6 + n columns.
    pub fn com_jacobian(&self, robot: &Robot, out: &mut Matrix3xX<f64>) {
        let lever = self.com() - self.base_origin();
        for (k, e) in basis().iter().enumerate() {
            out.set_column(k, e);
            out.set_column(3 + k, &e.cross(&lever));
        }
        for j in 0..robot.joints.len() {
            let (mass, com) = self.subtree(j + 1);
            let share = mass / self.subtree_mass[0];
            out.set_column(
                6 + j,
                &(self.axes[j].cross(&(com - self.joint_position(j))) * share),
            );
        }
    }

    /// Jacobian of the point of `robot.links[link]` that is now at `point` (world frame), 6 x (6 + n): velocity of the
    /// point, then angular velocity of the link. `out` must have 6 + n columns.
    pub fn point_jacobian(
        &self,
        robot: &Robot,
        link: usize,
        point: &Point3<f64>,
        out: &mut Matrix6xX<f64>,
    ) {
        out.fill(0.0);
        let lever = point - self.base_origin();
        for (k, e) in basis().iter().enumerate() {
            out[(k, k)] = 1.0;
            out[(3 + k, 3 + k)] = 1.0;
            out.fixed_view_mut::<3, 1>(0, 3 + k)
                .copy_from(&e.cross(&lever));
        }
        for j in robot.chain(link) {
            let linear = self.axes[j].cross(&(point - self.joint_position(j)));
            out.fixed_view_mut::<3, 1>(0, 6 + j).copy_from(&linear);
            out.fixed_view_mut::<3, 1>(3, 6 + j)
                .copy_from(&self.axes[j]);
        }
    }
}

fn basis() -> [Vector3<f64>; 3] {
    [Vector3::x(), Vector3::y(), Vector3::z()]
}

/// A pose (of a foothold or a base) seen from above: horizontal position and heading.
pub fn on_ground(pose: &Pose) -> Isometry2<f64> {
    Isometry2::new(pose.translation.vector.xy(), heading(pose))
}

/// Heading of a pose's x axis, seen from above (rad).
pub fn heading(pose: &Pose) -> f64 {
    let x = pose.rotation * Vector3::x();
    x.y.atan2(x.x)
}

impl Robot {
    /// The joints from `link` up to the base, nearest first.
    pub fn chain(&self, link: usize) -> impl Iterator<Item = usize> + '_ {
        let joint_of = |link: usize| link.checked_sub(1);
        std::iter::successors(joint_of(link), move |&j| joint_of(self.joints[j].parent))
    }

    /// The joints of a leg, from the sole up to the link that carries both legs.
    pub fn leg(&self, foot: Foot) -> impl Iterator<Item = usize> + '_ {
        let other = self.soles[foot.other()].link;
        self.chain(self.soles[foot].link)
            .filter(move |joint| self.chain(other).all(|shared| shared != *joint))
    }

    /// The link that carries both legs: the nearest to the soles of those above both.
    pub fn pelvis(&self) -> usize {
        let above = |link: usize| self.chain(link).map(|j| self.joints[j].parent);
        let of_right: Vec<usize> = above(self.soles.right.link).collect();
        above(self.soles.left.link)
            .find(|link| of_right.contains(link))
            .unwrap_or(0)
    }

    /// Where pushes act, in words, if that is not the trunk level with the COM.
    pub fn unusual_push_point(&self) -> Option<String> {
        let PushPoint { link, point_m } = self.pushed;
        let name = &self.links[link].name;
        match point_m {
            Some(at) => Some(format!(
                "on {name} at {:.3}, {:.3}, {:.3} m",
                at.x, at.y, at.z
            )),
            None if link != self.trunk => Some(format!("on {name}")),
            None => None,
        }
    }

    /// Total mass (kg).
    pub fn mass(&self) -> f64 {
        self.links.iter().map(|l| l.mass_kg).sum()
    }

    /// Posture with all joint angles 0, and with the base at the origin in the world's axes.
    pub fn zero_posture(&self) -> Posture {
        Posture {
            base: Pose::identity(),
            q: vec![0.0; self.joints.len()],
        }
    }

    /// Home posture. The base is not rotated, the soles are on the ground (z = 0), and the origin is midway between
    /// them.
    pub fn home_posture(&self) -> Posture {
        let mut posture = Posture {
            base: Pose::identity(),
            q: self.home_rad.clone(),
        };
        let kinematics = Kinematics::at(self, &posture);
        let soles = PerFoot::from_fn(|foot| kinematics.sole_pose(self, foot).translation.vector);
        posture.base.translation = Translation3::from(-(soles.left + soles.right) / 2.0);
        posture
    }
}
