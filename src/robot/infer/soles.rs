//! The face on which a foot stands: the rectangle around the lowest points of whatever collides there.

use crate::robot::infer::figures::to_decimals;
use crate::robot::model::Ankle;
use crate::robot::{Kinematics, Pose, Robot, Shape, Sole};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Points that are this share of the foot's size above the lowest one are of the sole, too.
const SLICE: f64 = 0.01;
/// Where an axis of the foot's frame is closer to down or forward than this (rad), it is taken for that.
const SNAP_RAD: f64 = 0.35;
/// Least length and width of a sole, as shares of the foot's size.
const LEAST: f64 = 0.05;

/// The sole of a robot of which it is not known yet.
pub fn none() -> Sole {
    Sole { frame: 0, link: 0, center: Isometry3::identity(), half_m: [0.0; 2], thickness_m: 0.0, ankle: Ankle::RIGID }
}

/// A sole, and how to state it.
pub struct Found {
    pub sole: Sole,
    /// Whether it is the lower face of the only collision of its URDF link, a box, so that the name of the link says all.
    pub is_box: bool,
    /// Pose of its centre in its URDF link's frame, if that has to be stated.
    pub in_frame: Pose,
}

/// The sole of the foot `link`, as it stands with all joints at zero. Errors are in words.
pub fn find(robot: &Robot, link: usize) -> Result<Found, String> {
    let kinematics = Kinematics::new(robot);
    let name = &robot.links[link].name;
    let solids = &robot.links[link].collisions;
    let turn = kinematics.link_pose(link).rotation;
    let down = turn.inverse_transform_vector(&-Vector3::z());
    let reach = |solid: &&crate::robot::Solid| solid.reach_m(&down);
    let Some(lowest) = solids.iter().max_by(|a, b| reach(a).total_cmp(&reach(b))) else {
        return Err(format!("the foot {name} has no collision geometry, so that it has no sole"));
    };
    let frame = lowest.frame;
    let in_link = robot.frames[frame].pose;
    let own: Vec<_> = solids.iter().filter(|solid| solid.frame == frame).collect();

    // The axes of the sole in the frame of its URDF link.
    let to_frame = |v: Vector3<f64>| in_link.rotation.inverse_transform_vector(&turn.inverse_transform_vector(&v));
    let up = snapped(to_frame(Vector3::z()));
    let forward = to_frame(Vector3::x());
    let forward = snapped((forward - up * forward.dot(&up)).normalize());
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[forward, up.cross(&forward), up]));
    let axes = UnitQuaternion::from_rotation_matrix(&axes);

    // The points of the foot in the axes of the sole.
    let of_solid = |solid: &&crate::robot::Solid| -> Vec<Point3<f64>> {
        match solid.shape {
            // A ball stands on one point.
            Shape::Sphere { radius } => {
                let center = Point3::from(solid.pose.translation.vector);
                vec![center + down * radius, center - down * radius]
            }
            _ => solid.points().collect(),
        }
    };
    let into_sole = |p| axes.inverse_transform_point(&in_link.inverse_transform_point(&p));
    let points: Vec<Point3<f64>> = own.iter().flat_map(of_solid).map(into_sole).collect();
    let extent = |points: &mut dyn Iterator<Item = f64>| {
        points.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| (least.min(x), most.max(x)))
    };
    let ranges = |points: &[Point3<f64>]| [0, 1, 2].map(|axis| extent(&mut points.iter().map(|p| p[axis])));
    let whole = ranges(&points);
    let size = whole.iter().map(|(least, most)| most - least).fold(0.0, f64::max);
    let low = whole[2].0;
    let slice: Vec<_> = points.into_iter().filter(|p| p.z <= low + SLICE * size).collect();
    let [x, y, _] = ranges(&slice);
    let mm = |length: f64| to_decimals(length, 6);
    let half_m = [x, y].map(|(least, most)| mm(0.5 * (most - least)));
    if half_m.iter().any(|half| 2.0 * half < LEAST * size) {
        return Err(format!(
            "the lowest face of the foot {name} is {:.1} x {:.1} mm, too small to stand on",
            2e3 * half_m[0],
            2e3 * half_m[1]
        ));
    }
    let center = axes * Point3::new(0.5 * (x.0 + x.1), 0.5 * (y.0 + y.1), low);
    let in_frame = Isometry3::from_parts(Translation3::from(center.coords.map(mm)), axes);
    let is_box = own.len() == 1 && matches!(lowest.shape, Shape::Box { .. }) && axes.angle() < 1e-9 && {
        let turn = in_link.inv_mul(&lowest.pose).rotation.to_rotation_matrix().matrix().abs();
        turn.iter().all(|&c| !(1e-6..=1.0 - 1e-6).contains(&c))
    };
    let sole =
        Sole { frame, link, center: in_link * in_frame, half_m, thickness_m: whole[2].1 - low, ankle: Ankle::RIGID };
    Ok(Found { sole, is_box, in_frame })
}

/// The axis of the frame that is close to a direction, or else the direction.
fn snapped(direction: Vector3<f64>) -> Vector3<f64> {
    let axis = Vector3::ith(direction.iamax(), direction[direction.iamax()].signum());
    if axis.angle(&direction) < SNAP_RAD { axis } else { direction }
}
