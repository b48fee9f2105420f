//! The data of a page as one JSON value: the robot, and all that is drawn at each moment.
//!
//! The grid of a column spans all its values, so a single huge value would make the whole film coarse. The page
//! therefore ends before the robot or its numbers are too far away ([`Film::near`]), and the error of a column is at
//! most 0.08 mm.

use super::pack::{Polygons, column, columns, packed_mesh};
use crate::with_fields_of;
use nalgebra::{Point2, Point3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use standfast_core::robot::shape::Meshes;
use standfast_core::robot::{Foot, Pose, Robot, Shape, Solid};
use standfast_scene::mesh::DrawnMesh;
use standfast_scene::{GroundFace, PHASES, doing, events, faces, pendulum, without_gain};
use standfast_sim::Ground;
use standfast_sim::episode::film::Film;
use standfast_sim::episode::snapshot::{Arrow, Snapshot};

/// Largest number of moments of a page. A longer film is shown at every second or third tick, and so on, which keeps
/// the page small.
const MOST_MOMENTS: usize = 2500;

/// Number of bytes of a page that films and meshes share, and number of bytes that a few meshes take; and the number of
/// columns of a page with the number of joints for which [`MOST_MOMENTS`] is meant.
const SHARED_BYTES: f64 = 850_000.0;
const FEW_BYTES: usize = 20_000;
const COLUMNS: usize = 60;
const JOINTS: usize = 20;

/// Smallest margin that is shown, so that margins near 0 keep two digits.
const LEAST_MARGIN: f64 = -100.0;
/// Largest number of corners of CPI sets in a page. With noise, each moment has its own CPI sets. If they have more
/// corners than this, they are shown at every second or third moment, and so on.
const MOST_CORNERS: usize = 60_000;

/// The packed film, which `film.js` reads, with the motion of a ghost, and sentences on the parts that the page leaves
/// out.
pub fn packed(film: &Film, ghost: Option<&Film>) -> (Value, Vec<String>) {
    let (ticks, farthest_m) = (&film.snapshots[..film.near()], film.farthest_m());
    let meshes = Meshes::of(
        film.robot
            .links
            .iter()
            .flat_map(|link| link.drawn())
            .map(|solid| &solid.shape),
    );
    let bob = film.pushes.iter().find_map(|push| push.bob);
    let pendulum: Vec<Solid> = bob.iter().flat_map(pendulum::solids).collect();
    let shapes = shapes(&film.robot, &pendulum, &meshes);
    let room = room(film.robot.joints.len(), shapes.to_string().len());
    let at_most = |most: usize| (most as f64 * room) as usize;
    let stride = ticks.len().div_ceil(at_most(MOST_MOMENTS)).max(1);
    let moments: Vec<&Snapshot> = ticks.iter().step_by(stride).collect();
    let (slices, every) = slices(&moments, film.regions.len(), at_most(MOST_CORNERS));
    let period_s = film.control_period_s * stride as f64;
    let mut notes: Vec<String> = film
        .robot
        .notes
        .iter()
        .map(|note| format!("The robot: {note}."))
        .collect();
    if stride > 1 {
        let ms = 1000.0 * period_s;
        notes.push(format!(
            "This film is long: it is shown in moments of {ms:.0} ms, and each force is the mean over one moment."
        ));
    }
    if every > 1 {
        notes.push(format!(
            "CPI sets are shown every {:.0} ms.",
            1000.0 * period_s * every as f64
        ));
    }
    if let Some(beyond) = film.snapshots[ticks.len()..].first() {
        let time_s = beyond.time_s;
        notes.push(format!(
            "The page ends at {time_s:.3} s: from then on the robot is more than {:.1} m from home, or its numbers run away.",
            farthest_m
        ));
    }
    let each = |value: &dyn Fn(&Snapshot) -> Option<f64>| each(&moments, value);
    let arrows = |value: &dyn Fn(&Snapshot) -> Option<Arrow>| {
        let mut means = Vec::new();
        for end in (0..ticks.len()).step_by(stride) {
            let since = &ticks[(end + 1).saturating_sub(stride)..=end];
            means.push(mean(since, value).map(six));
        }
        columns(&means)
    };
    // The phases in the order of their numbers in the page: the usual ones, then those of other controllers.
    let mut phases: Vec<&str> = PHASES.iter().map(|(name, ..)| *name).collect();
    for moment in &moments {
        if !phases.contains(&&*moment.phase) {
            phases.push(&moment.phase);
        }
    }
    let phase = each(&|s| {
        phases
            .iter()
            .position(|phase| *phase == s.phase)
            .map(|i| i as f64)
    });
    let gain = each(&|s| {
        film.regions
            .iter()
            .position(|name| Some(name) == s.gain.as_ref())
            .map(|i| i as f64)
    });
    let footsteps: Vec<Vec<Point2<f64>>> = moments
        .iter()
        .map(|s| {
            s.footstep
                .iter()
                .flatten()
                .map(|corner| corner.xy())
                .collect()
        })
        .collect();
    let packed = json!({
        "robot": robot(&film.robot, &meshes),
        "pendulum": visuals(&pendulum, &meshes),
        "shapes": shapes,
        "ground": ground(film),
        "gains": film.regions,
        "phases": phases.iter().map(|phase| json!({ "id": phase, "doing": doing(phase), "without_gain": without_gain(phase) })).collect::<Vec<_>>(),
        "events": events(film, ticks, ghost),
        "ghost": ghost.map(|ghost| {
            let moments: Vec<&Snapshot> = ghost.snapshots[..ghost.near()].iter().step_by(stride).collect();
            with_fields_of(json!({ "name": &ghost.controller }), &motion(&moments, period_s, farthest_m))
        }),
        "slope": turns(moments.iter().map(|s| s.slope)),
        "dcm": pairs(&moments, &|s| Some(s.dcm)),
        "zmp_ref": pairs(&moments, &|s| on_floor(s.zmp_ref, farthest_m)),
        "dcm_outside": each(&|s| Some(s.dcm_outside_m)),
        "margin": each(&|s| s.margin.map(|margin| margin.max(LEAST_MARGIN))),
        "gain": gain,
        "phase": phase,
        "push": arrows(&|s| s.push),
        "contacts": Foot::BOTH.map(|foot| arrows(&|s| s.contacts[foot])),
        "support": Polygons::of(moments.iter().map(|s| s.support.as_slice())).packed(),
        "slices": slices.iter().map(Polygons::packed).collect::<Vec<_>>(),
        "footstep": Polygons::of(footsteps.iter().map(Vec::as_slice)).packed(),
    });
    (
        with_fields_of(packed, &motion(&moments, period_s, farthest_m)),
        notes,
    )
}

/// The share of the usual number of moments for which a page has room, with `joints` joints and `mesh_bytes` bytes of
/// meshes.
fn room(joints: usize, mesh_bytes: usize) -> f64 {
    let columns = COLUMNS as f64 / (COLUMNS - JOINTS + joints.max(JOINTS)) as f64;
    columns * (1.0 - mesh_bytes.saturating_sub(FEW_BYTES) as f64 / SHARED_BYTES).max(0.1)
}

/// The motion of the robot: its base, joints, COM and ZMP at each moment, and the pose of the pendulum that strikes it, up
/// to the first moment without a bob. For a ghost only these are shown.
fn motion(moments: &[&Snapshot], period_s: f64, farthest_m: f64) -> Value {
    let joints = moments.first().map_or(0, |s| s.posture.q.len());
    let points = |at: &dyn Fn(&Snapshot) -> [f64; 3]| {
        columns(&moments.iter().map(|s| Some(at(s))).collect::<Vec<_>>())
    };
    let mut hanging: Vec<_> = moments
        .iter()
        .map(|s| s.rope.map(|rope| pose(&pendulum::pose(rope))))
        .collect();
    let last = hanging.iter().rposition(Option::is_some);
    let hanging = last.map(|last| {
        hanging.truncate(last + 2);
        columns(&hanging)
    });
    json!({
        "start_s": moments.first().map(|s| s.time_s),
        "period_s": period_s,
        "moments": moments.len(),
        "base": points(&|s| s.posture.base.translation.vector.into()),
        "turn": turns(moments.iter().map(|s| s.posture.base.rotation)),
        "q": (0..joints).map(|i| each(moments, &|s| Some(s.posture.q[i]))).collect::<Vec<_>>(),
        "com": points(&|s| s.com.into()),
        "zmp": pairs(moments, &|s| on_floor(s.zmp, farthest_m)),
        "hanging": hanging,
    })
}

/// The column of a value.
fn each(moments: &[&Snapshot], value: &dyn Fn(&Snapshot) -> Option<f64>) -> Value {
    column(&moments.iter().map(|s| value(s)).collect::<Vec<_>>())
}

fn pairs(moments: &[&Snapshot], value: &dyn Fn(&Snapshot) -> Option<Point2<f64>>) -> Vec<Value> {
    columns(
        &moments
            .iter()
            .map(|s| value(s).map(Into::into))
            .collect::<Vec<Option<[f64; 2]>>>(),
    )
}

/// A place on the ground, unless it is too far away (m) to be shown.
fn on_floor(at: Option<Point2<f64>>, farthest_m: f64) -> Option<Point2<f64>> {
    at.filter(|at| at.coords.norm() <= farthest_m)
}

/// The mean force over ticks, at the mean of the points where it acts. None if there is no force at any tick.
fn mean(ticks: &[Snapshot], value: &dyn Fn(&Snapshot) -> Option<Arrow>) -> Option<Arrow> {
    let arrows: Vec<Arrow> = ticks.iter().filter_map(value).collect();
    if let [arrow] = arrows[..]
        && ticks.len() == 1
    {
        return Some(arrow);
    }
    let sum: Vector3<f64> = arrows.iter().map(|arrow| arrow.force).sum();
    let weight: f64 = arrows.iter().map(|arrow| arrow.force.norm()).sum();
    let point: Vector3<f64> = arrows
        .iter()
        .map(|arrow| arrow.point.coords * arrow.force.norm())
        .sum();
    (weight > 0.0).then(|| Arrow {
        point: Point3::from(point / weight),
        force: sum / ticks.len() as f64,
    })
}

/// The slices of each gain, and the number of moments for which each slice is held.
fn slices(moments: &[&Snapshot], gains: usize, most_corners: usize) -> (Vec<Polygons>, usize) {
    let mut every = 1;
    loop {
        let all: Vec<Polygons> = (0..gains)
            .map(|gain| Polygons::of(held(moments, gain, every)))
            .collect();
        if all.iter().map(Polygons::corners).sum::<usize>() <= most_corners
            || every >= moments.len()
        {
            return (all, every);
        }
        every += 1;
    }
}

/// The slices of one gain, renewed after every `every` moments, and when a slice appears or vanishes.
fn held<'a>(
    moments: &[&'a Snapshot],
    gain: usize,
    every: usize,
) -> impl Iterator<Item = &'a [Point2<f64>]> {
    let mut last: &[Point2<f64>] = &[];
    moments.iter().enumerate().map(move |(k, snapshot)| {
        let now = slice(snapshot, gain);
        if k % every == 0 || now.is_empty() || last.is_empty() {
            last = now;
        }
        last
    })
}

/// The slice of a gain, empty if there is none.
fn slice(snapshot: &Snapshot, gain: usize) -> &[Point2<f64>] {
    snapshot
        .regions
        .get(gain)
        .map_or(&[], |region| &region.corners)
}

/// Point (m) and force (N) in one row.
fn six(arrow: Arrow) -> [f64; 6] {
    let ([x, y, z], [fx, fy, fz]): ([f64; 3], [f64; 3]) = (arrow.point.into(), arrow.force.into());
    [x, y, z, fx, fy, fz]
}

/// Columns of quaternions (x, y, z, w). Neighbours have signs that let the page interpolate between them.
fn turns(rotations: impl Iterator<Item = UnitQuaternion<f64>>) -> Vec<Value> {
    let mut last = [0.0; 4];
    let continuous = rotations.map(|rotation| {
        let now: [f64; 4] = rotation.coords.into();
        let along: f64 = now.iter().zip(last).map(|(a, b)| a * b).sum();
        last = if along < 0.0 { now.map(|x| -x) } else { now };
        Some(last)
    });
    columns(&continuous.collect::<Vec<_>>())
}

/// Links, joints and solids of the robot, with the meshes by their numbers.
fn robot(robot: &Robot, meshes: &Meshes) -> Value {
    let mut links = Vec::new();
    for (i, link) in robot.links.iter().enumerate() {
        let joint = i.checked_sub(1).map(|joint| &robot.joints[joint]);
        links.push(json!({
            "parent": joint.map(|joint| joint.parent),
            "origin": joint.map(|joint| pose(&joint.origin)),
            "axis": joint.map(|joint| [joint.axis.x, joint.axis.y, joint.axis.z]),
            "visuals": visuals(link.drawn(), meshes),
        }));
    }
    let scale = standfast_scene::scale(robot);
    json!({
        "com_height_m": robot.home_com_height(),
        "length": scale.length,
        "stiffness": scale.force_per_length(),
        "links": links,
    })
}

/// The solids of a link, each with the name of its mesh in the page.
fn visuals(solids: &[Solid], meshes: &Meshes) -> Value {
    let mut visuals = Vec::new();
    for solid in solids {
        let (kind, half) = kind(&solid.shape, meshes);
        let shape = json!({ "kind": kind, "half": [half.x, half.y, half.z] });
        visuals.push(json!({ "pose": pose(&solid.pose), "shape": shape, "color": solid.color }));
    }
    visuals.into()
}

/// A pose as position (m) and quaternion (x, y, z, w).
fn pose(pose: &Pose) -> [f64; 7] {
    let ([x, y, z], [i, j, k, w]): ([f64; 3], [f64; 4]) =
        (pose.translation.vector.into(), pose.rotation.coords.into());
    [x, y, z, i, j, k, w]
}

/// Name of a mesh of the page, and the scale along the axes of the solid (m) by which it becomes this shape.
fn kind(shape: &Shape, meshes: &Meshes) -> (String, Vector3<f64>) {
    match shape {
        Shape::Box { half } => ("box".into(), *half),
        Shape::Cylinder { radius, length } => (
            "cylinder".into(),
            Vector3::new(*radius, *radius, length / 2.0),
        ),
        Shape::Sphere { radius } => ("sphere".into(), Vector3::repeat(*radius)),
        Shape::Capsule { radius, length } => (
            format!("capsule {}", length / radius),
            Vector3::repeat(radius + 0.5 * length),
        ),
        Shape::Mesh(mesh) => {
            let farthest_m = mesh
                .points
                .iter()
                .map(|point| point.coords.amax())
                .fold(1e-6, f64::max);
            (
                format!("mesh {}", meshes.number(mesh).unwrap_or_default()),
                Vector3::repeat(farthest_m),
            )
        }
    }
}

/// The meshes by name, each within the cube from -1 to 1. All boxes, cylinders and spheres need one mesh each, which
/// the page scales; this keeps the page small.
fn shapes(robot: &Robot, pendulum: &[Solid], meshes: &Meshes) -> Value {
    let mut shapes = serde_json::Map::new();
    let of_robot = robot.links.iter().flat_map(|link| link.drawn());
    for solid in of_robot.chain(pendulum) {
        let (kind, scale) = kind(&solid.shape, meshes);
        let unit = match solid.shape {
            Shape::Box { .. } => Shape::Box {
                half: Vector3::repeat(1.0),
            },
            Shape::Cylinder { .. } => Shape::Cylinder {
                radius: 1.0,
                length: 2.0,
            },
            Shape::Sphere { .. } => Shape::Sphere { radius: 1.0 },
            Shape::Capsule { radius, length } => Shape::Capsule {
                radius: radius / scale.x,
                length: length / scale.x,
            },
            Shape::Mesh(ref mesh) => Shape::Mesh(mesh.clone()),
        };
        shapes.entry(kind).or_insert_with(|| {
            let mut mesh = DrawnMesh::of(&unit);
            if let Shape::Mesh(_) = unit {
                for (corner, _) in &mut mesh.corners {
                    *corner /= scale.x;
                }
            }
            packed_mesh(&mesh)
        });
    }
    shapes.into()
}

/// Step, patch and faces of the ground.
fn ground(film: &Film) -> Value {
    let Ground {
        step_m,
        patch: [least, most],
        ..
    } = film.ground;
    let reach_m = 4.0 * standfast_scene::scale(&film.robot).length;
    let faces: Vec<Value> = faces(&film.ground, reach_m, 2.0 * reach_m)
        .into_iter()
        .map(|GroundFace { part, corners }| json!([part, corners.map(|at| [at.x, at.y, at.z])]))
        .collect();
    json!({ "step_m": step_m, "patch": [least.x, least.y, most.x, most.y], "faces": faces })
}
