//! The face on which a foot stands: the rectangle around the lowest points of its colliding geometry.

use crate::infer::figures::to_decimals;
use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector2,
    Vector3,
};
use standfast_core::robot::model::Ankle;
use standfast_core::robot::{Kinematics, Pose, Posture, Robot, Shape, Sole, Solid};

/// Height above the lowest point up to which points belong to the sole, as a share of the foot's size. If these points
/// span no face, the second share counts.
const SLICES: [f64; 2] = [0.01, 0.05];
/// Largest angle between down or forward and an axis of the foot's frame, or of a box, that is taken instead (rad).
const SNAP_RAD: f64 = 0.35;
/// Least length and width of a sole, as shares of the foot's size.
const LEAST: f64 = 0.05;
/// Pitch up to which the sole of a foot is sought that has no flat face below (rad), and the step of this search.
const MOST_PITCH_RAD: f64 = 1.3;
const PITCH_STEP_RAD: f64 = 0.01;
/// How much larger a pitched face is than the points below, so that it is taken instead.
const LARGER: f64 = 1.5;

/// The sole of a robot before its soles are known.
pub fn none() -> Sole {
    Sole {
        frame: 0,
        link: 0,
        center: Isometry3::identity(),
        half_m: [0.0; 2],
        thickness_m: 0.0,
        ankle: Ankle::RIGID,
    }
}

/// A sole, and how the settings state it.
pub struct FoundSole {
    pub sole: Sole,
    /// Whether the sole is the lower face of the only collision of its URDF link, a box, so that the name of the link
    /// suffices.
    pub is_box: bool,
    /// Pose of the sole's centre in the frame of its URDF link, for settings that must state it.
    pub in_frame: Pose,
    /// A warning about the sole.
    pub warning: Option<String>,
}

impl FoundSole {
    /// A sole that is stated already. If `is_box`, the name of its link alone states it.
    pub fn stated(sole: Sole, robot: &Robot, is_box: bool) -> Self {
        let mut in_frame = robot.frames[sole.frame].pose.inverse() * sole.center;
        in_frame
            .translation
            .vector
            .apply(|length| *length = to_decimals(*length, 9));
        Self {
            sole,
            is_box,
            in_frame,
            warning: None,
        }
    }

    /// Moves the face up into the foot (m), or down.
    pub fn raise(&mut self, up_m: f64) {
        let up = Translation3::new(0.0, 0.0, up_m);
        let in_link = self.sole.center * self.in_frame.inverse();
        self.in_frame *= up;
        self.in_frame
            .translation
            .vector
            .apply(|length| *length = to_decimals(*length, 6));
        self.sole.center = in_link * self.in_frame;
        (self.sole.thickness_m, self.is_box) = (self.sole.thickness_m - up_m, false);
    }
}

/// The sole of the foot `link` with all links that are fixed to it, in a posture with the angles `q` (rad) and for a
/// robot that looks along `forward`. A foot that does not collide has the sole of what is drawn. Errors are in words.
pub fn find(
    robot: &Robot,
    link: usize,
    q: &[f64],
    forward: &Vector3<f64>,
) -> Result<FoundSole, String> {
    let posture = Posture {
        q: q.to_vec(),
        ..robot.zero_posture()
    };
    let kinematics = Kinematics::at(robot, &posture);
    let name = &robot.links[link].name;
    let collides = !robot.links[link].collisions.is_empty();
    let solids = match collides {
        true => &robot.links[link].collisions,
        false => &robot.links[link].visuals,
    };
    let turn = kinematics.link_pose(link).rotation;
    let [down, ahead] = [-Vector3::z(), *forward].map(|v| turn.inverse_transform_vector(&v));
    let reach = |solid: &&Solid| solid.reach_m(&down);
    let Some(lowest) = solids.iter().max_by(|a, b| reach(a).total_cmp(&reach(b))) else {
        return Err(format!(
            "the foot {name} has no collision geometry and is not drawn, so that it has no sole"
        ));
    };
    let frame = lowest.frame;
    let in_link = robot.frames[frame].pose;
    let points: Vec<Point3<f64>> = solids
        .iter()
        .flat_map(|solid| match solid.shape {
            // A ball stands on one point.
            Shape::Sphere { radius } => {
                let center = Point3::from(solid.pose.translation.vector);
                vec![center + down * radius, center - down * radius]
            }
            _ => solid.points().collect(),
        })
        .map(|point| in_link.inverse_transform_point(&point))
        .collect();
    // The frame of the foot may be parallel to its sole, and so may a box.
    let to_frame = |v: Vector3<f64>| in_link.rotation.inverse_transform_vector(&v);
    let boxes = solids
        .iter()
        .filter(|solid| matches!(solid.shape, Shape::Box { .. }));
    let frames = boxes.map(|solid| in_link.rotation.inverse() * solid.pose.rotation);
    let along = |axes: UnitQuaternion<f64>| {
        LowestFace::along(axes, to_frame(-down), to_frame(ahead), &points)
    };
    let of_frame = along(UnitQuaternion::identity());
    // Of faces with equal areas, the face of the frame is taken.
    let face = frames.map(along).fold(of_frame, |best, face| {
        if face.area() > 1.01 * best.area() {
            face
        } else {
            best
        }
    });
    // A foot that is pitched in this posture has no flat face below. Its sole is the face below it at another pitch.
    let face = match face.is_slice {
        true => face,
        false => {
            let pitched = LowestFace::pitched(to_frame(-down), to_frame(ahead), &points);
            match pitched.area() > LARGER * face.around() {
                true => pitched,
                false => face,
            }
        }
    };
    let LowestFace {
        axes,
        x,
        y,
        z,
        size,
        is_slice,
    } = face;
    let mm = |length: f64| to_decimals(length, 6);
    let half_m = [x, y].map(|(least, most)| mm(0.5 * (most - least)));
    let shown = format!("{:.1} x {:.1} mm", 2e3 * half_m[0], 2e3 * half_m[1]);
    if half_m.iter().any(|half| 2.0 * half < LEAST * size) {
        return Err(format!(
            "the lowest face of the foot {name} is {shown}, too small to stand on"
        ));
    }
    let warning = if !collides {
        Some(format!(
            "the foot {name} has no collision geometry: its sole is the lowest face of what is drawn, {shown}"
        ))
    } else if !is_slice {
        Some(format!(
            "the foot {name} has no flat lowest face; its sole is the rectangle of {shown} around what lies within {:.1} mm of \
             its lowest point",
            1e3 * SLICES[1] * size
        ))
    } else {
        None
    };
    let center = axes * Point3::new(0.5 * (x.0 + x.1), 0.5 * (y.0 + y.1), z.0);
    let in_frame = Isometry3::from_parts(Translation3::from(center.coords.map(mm)), axes);
    // Whether the only solid of the frame is a box, and the face is that of the box.
    let is_box = collides
        && solids.iter().filter(|solid| solid.frame == frame).count() == 1
        && axes.angle() < 1e-9
        && {
            let turn = in_link
                .inv_mul(&lowest.pose)
                .rotation
                .to_rotation_matrix()
                .matrix()
                .abs();
            let is_parallel = turn.iter().all(|&c| !(1e-6..=1.0 - 1e-6).contains(&c));
            matches!(&lowest.shape, Shape::Box { half }
                if is_parallel && ((turn * half).xy() - Vector2::from(half_m)).amax() < 1e-5)
        };
    let sole = Sole {
        frame,
        link,
        center: in_link * in_frame,
        half_m,
        thickness_m: z.1 - z.0,
        ankle: Ankle::RIGID,
    };
    Ok(FoundSole {
        sole,
        is_box,
        in_frame,
        warning,
    })
}

/// The lowest face of some points along axes: its range in x and y, and the range of all points in z.
struct LowestFace {
    axes: UnitQuaternion<f64>,
    x: (f64, f64),
    y: (f64, f64),
    z: (f64, f64),
    /// Largest extent of all points (m).
    size: f64,
    /// Whether the lowest points alone span the face.
    is_slice: bool,
}

impl LowestFace {
    /// The face of `points` along the axes of `frame` that are close to up and ahead, or else along `up` and `ahead`.
    fn along(
        frame: UnitQuaternion<f64>,
        up: Vector3<f64>,
        ahead: Vector3<f64>,
        points: &[Point3<f64>],
    ) -> Self {
        let snapped = |v: Vector3<f64>| frame * snapped(frame.inverse_transform_vector(&v));
        let up = snapped(up);
        let mut ahead = snapped((ahead - up * ahead.dot(&up)).normalize());
        // One may be an axis of the frame, and the other none.
        if ahead.dot(&up).abs() > 1e-9 {
            ahead = (ahead - up * ahead.dot(&up)).normalize();
        }
        Self::with(up, ahead, points)
    }

    /// The largest face below at a pitch within [`MOST_PITCH_RAD`] of `up` and `ahead`, along the plane through its points.
    fn pitched(up: Vector3<f64>, ahead: Vector3<f64>, points: &[Point3<f64>]) -> Self {
        let aside = UnitVector3::new_normalize(up.cross(&ahead));
        let at = |angle_rad: f64| {
            let turn = UnitQuaternion::from_axis_angle(&aside, angle_rad);
            Self::with(turn * up, turn * ahead, points)
        };
        let steps = (MOST_PITCH_RAD / PITCH_STEP_RAD) as i32;
        // Of equal faces, the one with the least pitch is taken.
        let pitches =
            (0..=2 * steps).map(|k| f64::from((k + 1) / 2 * (2 * (k % 2) - 1)) * PITCH_STEP_RAD);
        let widest = pitches.map(at).fold(at(0.0), |best, face| {
            if face.area() > 1.01 * best.area() {
                face
            } else {
                best
            }
        });
        let of_face: Vec<_> = points
            .iter()
            .filter(|point| {
                let height = widest.axes.inverse_transform_point(point).z - widest.z.0;
                height <= SLICES[0] * widest.size
            })
            .collect();
        let middle = of_face
            .iter()
            .map(|point| point.coords)
            .sum::<Vector3<f64>>()
            / of_face.len() as f64;
        let spread: Matrix3<f64> = of_face
            .iter()
            .map(|point| point.coords - middle)
            .map(|arm| arm * arm.transpose())
            .sum();
        let eigen = spread.symmetric_eigen();
        let normal = eigen
            .eigenvectors
            .column(eigen.eigenvalues.imin())
            .into_owned();
        let up = widest.axes * Vector3::z();
        let normal = normal * normal.dot(&up).signum();
        let ahead = widest.axes * Vector3::x();
        let along_plane = Self::with(
            normal,
            (ahead - normal * ahead.dot(&normal)).normalize(),
            points,
        );
        // Points in one line have no plane.
        if along_plane.area() >= 0.9 * widest.area() {
            along_plane
        } else {
            widest
        }
    }

    /// The face of `points` with these directions.
    fn with(up: Vector3<f64>, ahead: Vector3<f64>, points: &[Point3<f64>]) -> Self {
        let axes =
            Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[ahead, up.cross(&ahead), up]));
        let axes = UnitQuaternion::from_rotation_matrix(&axes);
        let points: Vec<_> = points
            .iter()
            .map(|point| axes.inverse_transform_point(point))
            .collect();
        let range = |below: f64, axis: usize| {
            let of_slice = points
                .iter()
                .filter(|point| point.z <= below)
                .map(|point| point[axis]);
            of_slice.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| {
                (least.min(x), most.max(x))
            })
        };
        let whole = [0, 1, 2].map(|axis| range(f64::INFINITY, axis));
        let size = whole
            .iter()
            .map(|(least, most)| most - least)
            .fold(0.0, f64::max);
        let slice = |share: f64| [0, 1].map(|axis| range(whole[2].0 + share * size, axis));
        let lowest = slice(SLICES[0]);
        let is_slice = lowest
            .iter()
            .all(|(least, most)| most - least >= LEAST * size);
        let [x, y] = if is_slice { lowest } else { slice(SLICES[1]) };
        Self {
            axes,
            x,
            y,
            z: whole[2],
            size,
            is_slice,
        }
    }

    /// Area of the rectangle (m^2).
    fn around(&self) -> f64 {
        (self.x.1 - self.x.0) * (self.y.1 - self.y.0)
    }

    /// Area of the face (m^2). It is 0 if the lowest points alone do not span the face.
    fn area(&self) -> f64 {
        if self.is_slice { self.around() } else { 0.0 }
    }
}

/// The axis of the frame that is close to a direction, or else the direction.
fn snapped(direction: Vector3<f64>) -> Vector3<f64> {
    let axis = Vector3::ith(direction.iamax(), direction[direction.iamax()].signum());
    if axis.angle(&direction) < SNAP_RAD {
        axis
    } else {
        direction
    }
}
