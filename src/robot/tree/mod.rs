//! The tree of links and joints that a URDF contains.

mod xml;

use super::model::{Frame, Joint, Link, Solid};
use super::shape::Shape;
use crate::assets::Source;
use crate::error::{Error, Result};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// The content of the URDF alone. Links, joints and frames are those of [`Robot`].
pub(super) struct Tree {
    pub name: String,
    pub links: Vec<Link>,
    pub joints: Vec<Joint>,
    pub frames: Vec<Frame>,
    /// What the URDF states about the motor of each joint.
    #[allow(dead_code)]
    pub motors: Vec<Motor>,
    /// What was changed or left out, in sentences.
    pub notes: Vec<String>,
}

/// The figures of a joint's `<limit>` as they are written, which need not be true; None if they are missing or not
/// positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motor {
    /// Largest torque (N m).
    pub effort_n_m: Option<f64>,
    /// Largest speed (rad/s).
    pub velocity_rad_s: Option<f64>,
}

impl Tree {
    /// Reads the tree of links from a URDF. Meshes are searched from the folder of the file on. Fails as
    /// [`Robot::load`] does, but for the settings.
    pub fn parse(source: &Source) -> Result<Tree> {
        let file = source.file.as_str();
        xml::check(source)?;
        let urdf = urdf_rs::read_from_string(&source.text)
            .map_err(|e| Error::Syntax { file: file.into(), message: format!("not a URDF: {e}") })?;
        unique(file, "link", urdf.links.iter().map(|l| l.name.as_str()))?;
        unique(file, "joint", urdf.joints.iter().map(|j| j.name.as_str()))?;
        let ends = urdf.joints.iter().map(|j| ends(file, j, &urdf.links)).collect::<Result<Vec<_>>>()?;
        let root = root(file, &urdf, &ends)?;

        // For each URDF link, the body that carries it and its pose in that body.
        let mut placed: Vec<Option<(usize, Isometry3<f64>)>> = vec![None; urdf.links.len()];
        let mut bodies: Vec<Parts> = vec![vec![(root, Isometry3::identity())]];
        let (mut joints, mut motors) = (Vec::new(), Vec::new());
        placed[root] = Some((0, Isometry3::identity()));
        let mut waiting: Vec<usize> = (0..urdf.joints.len()).collect();
        // The joints keep the order of the file, except that a parent always comes before its children.
        while let Some(at) = waiting.iter().position(|&j| placed[ends[j].0].is_some()) {
            let j = waiting.remove(at);
            let (parent, child) = ends[j];
            let Some((body, pose)) = placed[parent] else { break };
            let origin = pose * isometry(&urdf.joints[j].origin);
            placed[child] = Some(if urdf.joints[j].joint_type == urdf_rs::JointType::Fixed {
                bodies[body].push((child, origin));
                (body, origin)
            } else {
                joints.push(revolute(file, &urdf.joints[j], body, origin)?);
                let stated = |figure: f64| (figure > 0.0).then_some(figure);
                let limit = &urdf.joints[j].limit;
                motors.push(Motor { effort_n_m: stated(limit.effort), velocity_rad_s: stated(limit.velocity) });
                bodies.push(vec![(child, Isometry3::identity())]);
                (bodies.len() - 1, Isometry3::identity())
            });
        }
        if let Some(&j) = waiting.first() {
            let joint = &urdf.joints[j];
            let (field, value) =
                (format!("joint {}", joint.name), format!("{} -> {}", joint.parent.link, joint.child.link));
            let problem = format!("is not connected to the root link {} (a cycle)", urdf.links[root].name);
            return Err(Error::value(file, field, value, problem, "a tree of links"));
        }
        let links = bodies.iter().map(|parts| merged(file, &urdf, parts)).collect::<Result<_>>()?;
        let frames =
            urdf.links.iter().zip(&placed).filter_map(|(link, place)| {
                place.map(|(body, pose)| Frame { name: link.name.clone(), link: body, pose })
            });
        Ok(Tree { frames: frames.collect(), name: urdf.name, links, joints, motors, notes: Vec::new() })
    }
}

fn unique<'a>(file: &str, what: &str, names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut seen = Vec::new();
    for name in names {
        if seen.contains(&name) {
            return Err(Error::value(file, what, name, "is used twice", "unique names"));
        }
        seen.push(name);
    }
    Ok(())
}

/// Indices of the parent and child links of a joint.
fn ends(file: &str, joint: &urdf_rs::Joint, links: &[urdf_rs::Link]) -> Result<(usize, usize)> {
    let find = |end: &str, name: &str| {
        links.iter().position(|l| l.name == name).ok_or_else(|| {
            let names: Vec<_> = links.iter().map(|l| l.name.as_str()).collect();
            Error::value(file, format!("joint {}: {end}", joint.name), name, "no such link", names.join(", "))
        })
    };
    Ok((find("parent", &joint.parent.link)?, find("child", &joint.child.link)?))
}

/// The only link that no joint carries.
fn root(file: &str, urdf: &urdf_rs::Robot, ends: &[(usize, usize)]) -> Result<usize> {
    for (link, l) in urdf.links.iter().enumerate() {
        let carriers: Vec<_> =
            urdf.joints.iter().zip(ends).filter(|(_, e)| e.1 == link).map(|(j, _)| j.name.as_str()).collect();
        if carriers.len() > 1 {
            let (field, value) = (format!("link {}", l.name), carriers.join(", "));
            return Err(Error::value(file, field, value, "is the child of several joints", "one joint per link"));
        }
    }
    let mut roots = (0..urdf.links.len()).filter(|link| ends.iter().all(|e| e.1 != *link));
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(root),
        (None, _) => {
            Err(Error::value(file, "link", "(none)", "there is no root link (no links, or a cycle)", "one root link"))
        }
        (Some(a), Some(b)) => {
            let value = format!("{}, {}", urdf.links[a].name, urdf.links[b].name);
            Err(Error::value(
                file,
                "link",
                value,
                "there are several root links",
                "exactly one link that is no joint's child",
            ))
        }
    }
}

fn revolute(file: &str, joint: &urdf_rs::Joint, parent: usize, origin: Isometry3<f64>) -> Result<Joint> {
    let field = |what: &str| format!("joint {}: {what}", joint.name);
    if let Some(mimic) = &joint.mimic {
        let accepted = "joints with a servo of their own";
        return Err(Error::value(file, field("mimic"), &mimic.joint, "is not supported", accepted));
    }
    let xyz = Vector3::from(*joint.axis.xyz);
    let Some(axis) = Unit::try_new(xyz, 1e-9) else {
        return Err(Error::value(file, field("axis"), text(&xyz), "has no direction", "a vector of non-zero length"));
    };
    let limit = &joint.limit;
    if limit.lower >= limit.upper {
        let value = format!("{} to {}", limit.lower, limit.upper);
        return Err(Error::value(file, field("limit"), value, "is not a range", "lower < upper [rad]"));
    }
    Ok(Joint { name: joint.name.clone(), parent, origin, axis, lower_rad: limit.lower, upper_rad: limit.upper })
}

/// The URDF links that are fixed to each other and move as one, each with its pose in the first one.
type Parts = Vec<(usize, Isometry3<f64>)>;

/// Merges these URDF links into one link.
fn merged(file: &str, urdf: &urdf_rs::Robot, from: &[(usize, Isometry3<f64>)]) -> Result<Link> {
    let name = urdf.links[from[0].0].name.clone();
    let mut parts = Vec::new();
    let (mut collisions, mut visuals) = (Vec::new(), Vec::new());
    for &(index, pose) in from {
        let link = &urdf.links[index];
        parts.extend(part(file, link, &pose)?);
        for collision in &link.collision {
            let field = format!("link {}: collision", link.name);
            let Some(shape) = shape(file, &field, &collision.geometry)? else {
                let value = kind(&collision.geometry);
                return Err(Error::value(file, field, value, "this shape is not supported", "box, cylinder, sphere"));
            };
            let pose = pose * isometry(&collision.origin);
            collisions.push(Solid { frame: index, pose, shape, color: GREY });
        }
        for visual in &link.visual {
            let field = format!("link {}: visual", link.name);
            let Some(shape) = shape(file, &field, &visual.geometry)? else {
                log::warn!(
                    "{file}: {field}: a {} is not drawn; accepted: box, cylinder, sphere",
                    kind(&visual.geometry)
                );
                continue;
            };
            let pose = pose * isometry(&visual.origin);
            visuals.push(Solid { frame: index, pose, shape, color: color(urdf, visual) });
        }
    }
    let mass_kg: f64 = parts.iter().map(|p| p.mass).sum();
    if parts.is_empty() {
        let field = format!("link {name}: mass");
        return Err(Error::value(file, field, 0, "a link that moves must have mass", "a number > 0"));
    }
    let com: Vector3<f64> = parts.iter().map(|p| p.com * p.mass).sum::<Vector3<f64>>() / mass_kg;
    let inertia_kg_m2 = parts.iter().fold(Matrix3::zeros(), |sum, part| {
        let d = part.com - com;
        sum + part.inertia + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * part.mass
    });
    check_inertia(file, &name, &inertia_kg_m2, true)?;
    Ok(Link { name, mass_kg, com_m: Point3::from(com), inertia_kg_m2, collisions, visuals })
}

/// Mass, COM, and inertia about the COM of a URDF link, in the frame of its body.
struct Part {
    mass: f64,
    com: Vector3<f64>,
    inertia: Matrix3<f64>,
}

/// Returns None for a link without mass.
fn part(file: &str, link: &urdf_rs::Link, pose: &Isometry3<f64>) -> Result<Option<Part>> {
    let mass = link.inertial.mass.value;
    if mass < 0.0 {
        let field = format!("link {}: mass", link.name);
        return Err(Error::value(file, field, mass, "must not be negative", "a number > 0, or no <inertial>"));
    }
    if mass == 0.0 {
        return Ok(None);
    }
    let i = &link.inertial.inertia;
    let inertia = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    check_inertia(file, &link.name, &inertia, false)?;
    let pose = pose * isometry(&link.inertial.origin);
    let turn = pose.rotation.to_rotation_matrix();
    Ok(Some(Part { mass, com: pose.translation.vector, inertia: turn * inertia * turn.transpose() }))
}

/// Checks that no principal moment is negative (if `strict`, that all are positive), and that none exceeds the sum of
/// the other two. The tolerance is for inertias rounded to a few digits.
fn check_inertia(file: &str, link: &str, inertia: &Matrix3<f64>, strict: bool) -> Result<()> {
    let value = || format!("{:?}", inertia.as_slice());
    let bad = |problem: &str, accepted: &str| {
        Err(Error::value(file, format!("link {link}: inertia"), value(), problem, accepted))
    };
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    let tolerance = 1e-3 * moments[2].abs();
    if moments[0] < -tolerance * 1e-3 || (strict && moments[0] <= 0.0) {
        return bad("is not positive definite", "positive principal moments");
    }
    if moments[0] + moments[1] < moments[2] - tolerance {
        return bad("breaks the triangle inequality", "each principal moment at most the sum of the two others");
    }
    Ok(())
}

fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let (xyz, rpy) = (Vector3::from(*pose.xyz), Vector3::from(*pose.rpy));
    let rotation = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z);
    Isometry3::from_parts(Translation3::from(xyz), rotation)
}

/// Returns None for a shape that is not a primitive.
fn shape(file: &str, field: &str, geometry: &urdf_rs::Geometry) -> Result<Option<Shape>> {
    let (shape, sizes) = match geometry {
        urdf_rs::Geometry::Box { size } => (Shape::Box { half: Vector3::from(**size) / 2.0 }, size.to_vec()),
        &urdf_rs::Geometry::Cylinder { radius, length } => (Shape::Cylinder { radius, length }, vec![radius, length]),
        &urdf_rs::Geometry::Capsule { radius, length } => (Shape::Capsule { radius, length }, vec![radius, length]),
        &urdf_rs::Geometry::Sphere { radius } => (Shape::Sphere { radius }, vec![radius]),
        urdf_rs::Geometry::Mesh { .. } => return Ok(None),
    };
    if sizes.iter().any(|s| *s <= 0.0) {
        let field = format!("{field}: {}", kind(geometry));
        return Err(Error::value(file, field, format!("{sizes:?}"), "must be positive", "numbers > 0"));
    }
    Ok(Some(shape))
}

fn kind(geometry: &urdf_rs::Geometry) -> &'static str {
    match geometry {
        urdf_rs::Geometry::Box { .. } => "box",
        urdf_rs::Geometry::Cylinder { .. } => "cylinder",
        urdf_rs::Geometry::Capsule { .. } => "capsule",
        urdf_rs::Geometry::Sphere { .. } => "sphere",
        urdf_rs::Geometry::Mesh { .. } => "mesh",
    }
}

const GREY: [f64; 4] = [0.7, 0.7, 0.7, 1.0];

/// Colour of a visual's material, taken from there or from any material of that name.
fn color(urdf: &urdf_rs::Robot, visual: &urdf_rs::Visual) -> [f64; 4] {
    let Some(material) = &visual.material else { return GREY };
    let elsewhere = urdf.links.iter().flat_map(|l| &l.visual).filter_map(|v| v.material.as_ref());
    std::iter::once(material)
        .chain(urdf.materials.iter().chain(elsewhere).filter(|m| m.name == material.name))
        .find_map(|m| m.color.as_ref())
        .map_or(GREY, |c| *c.rgba)
}

fn text(v: &Vector3<f64>) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}
