//! The tree of links and joints that a URDF or an MJCF contains.
//!
//! Boxes, cylinders, capsules, spheres and meshes are read; revolute and continuous joints have servos; other joints
//! are locked. Elements that this program does not use (transmissions, safety controllers, textures, plugins of
//! simulators) are ignored. All problems of a file are reported at once. Changes and omissions are noted.

mod inertia;
mod joints;
mod mjcf;
mod problems;
mod solids;
#[cfg(test)]
mod tests;
mod xml;

use super::xacro;
use inertia::{LinkInertia, check_gyration, merged};
use joints::JointKind;
pub(super) use joints::Motor;
use nalgebra::Isometry3;
use problems::Problems;
use solids::Solids;
use standfast_core::error::Result;
use standfast_core::robot::model::{Frame, Joint, Link, Solid};
use standfast_files::assets::{self, InputKind, Source};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
pub(super) use xml::Posture;

/// The content of the robot's file alone. Links, joints and frames are those of [`Robot`](standfast_core::robot::Robot).
#[derive(Debug, Clone)]
pub(super) struct Tree {
    pub name: String,
    pub links: Vec<Link>,
    pub joints: Vec<Joint>,
    pub frames: Vec<Frame>,
    /// What the file states about the motor of each joint.
    pub motors: Vec<Motor>,
    /// Changes and omissions, in sentences.
    pub notes: Vec<String>,
    /// Collision meshes that could not be read, each with the index of its frame, and the reason in words.
    pub missing: Vec<(usize, String)>,
    /// Number of joints that are locked because their limits leave them no range.
    pub without_range: usize,
    /// The meshes as a text that can be kept beside the URDF instead of the mesh files. It is None if the URDF names no
    /// mesh.
    pub kept_meshes: Option<String>,
    /// The postures that the file names.
    pub postures: Vec<Posture>,
}

/// The URDF of a built-in robot by its name, or of a file, with its macros expanded, or an MJCF with all that it includes.
///
/// # Errors
/// A file cannot be read, is malformed, or needs the program `xacro`, which fails.
pub fn opened(name_or_path: &str) -> Result<Source> {
    let source = assets::open(InputKind::Robot, name_or_path)?;
    mjcf::with_included(xacro::expanded(source)?)
}

/// The name of the format of a robot's file.
pub(super) fn format_of(source: &Source) -> &'static str {
    if source.is_mjcf() { "MJCF" } else { "URDF" }
}

impl Tree {
    /// Reads the tree of links from a URDF or an MJCF. Meshes are searched from the folder of the file on. Fails as
    /// [`load`](crate::load) does, except for the settings. Joints without a range get the range
    /// `range_rad` to both sides (rad) or, if it is None, are locked.
    pub fn parse(source: &Source, range_rad: Option<f64>) -> Result<Tree> {
        let mut problems = Problems::new(&source.file);
        let urdf = match source.is_mjcf() {
            true => mjcf::read(source, &mut problems)?,
            false => xml::read(source, &mut problems)?,
        };
        let (links, joints) = (&urdf.robot.links, &urdf.robot.joints);
        let link_names = by_name(
            "link",
            links
                .iter()
                .map(|l| l.name.as_str())
                .zip(urdf.link_lines.iter().copied()),
            &mut problems,
        );
        by_name(
            "joint",
            joints
                .iter()
                .map(|j| j.name.as_str())
                .zip(urdf.joint_lines.iter().copied()),
            &mut problems,
        );
        let ends: Vec<Option<[usize; 2]>> = joints
            .iter()
            .zip(&urdf.joint_lines)
            .map(|(joint, &line)| ends(joint, line, &link_names, links, &mut problems))
            .collect();
        let parts: Vec<Option<LinkInertia>> = links
            .iter()
            .zip(&urdf.link_lines)
            .map(|(link, &line)| LinkInertia::of(link, line, &mut problems))
            .collect();
        let order = match ends.iter().copied().collect::<Option<Vec<_>>>() {
            Some(ends) if urdf.is_whole => order(&urdf, &ends, &mut problems),
            _ => None,
        };
        // Whether each link or a link that it carries has mass. It counts as true while the tree is not known.
        let mut has_mass: Vec<bool> = parts
            .iter()
            .map(|part| part.is_some() || order.is_none())
            .collect();
        for &(_, [parent, child]) in order.iter().flat_map(|(_, joints)| joints).rev() {
            has_mass[parent] |= has_mass[child];
        }
        let mut kinds: Vec<JointKind> = Vec::with_capacity(joints.len());
        for ((joint, &line), ends) in joints.iter().zip(&urdf.joint_lines).zip(&ends) {
            let has_mass = ends.is_none_or(|[_, child]| has_mass[child]);
            let mut kind = JointKind::of(joint, line, has_mass, range_rad, &mut problems);
            if let JointKind::Moves(_, motor) = &mut kind {
                let rotor = urdf.rotor_inertias_kg_m2.get(kinds.len()).copied();
                motor.rotor_inertia_kg_m2 = rotor.filter(|&rotor| rotor > 0.0);
            }
            kinds.push(kind);
        }
        let solids = Solids::read(&urdf, &source.file, &mut problems);
        let Some((root, order)) = order.filter(|_| problems.is_empty()) else {
            problems.check()?;
            unreachable!("a tree without an order has problems");
        };

        // For each URDF link, the body that carries it and its pose in that body.
        let mut placed = vec![(0, Isometry3::identity()); links.len()];
        let mut bodies: Vec<Vec<usize>> = vec![vec![root]];
        let (mut moving, mut motors, mut locked) = (Vec::new(), Vec::new(), Vec::new());
        for (j, [parent, child]) in order {
            let (body, pose): (usize, Isometry3<f64>) = placed[parent];
            placed[child] =
                match std::mem::replace(&mut kinds[j], JointKind::Fixed(Isometry3::identity())) {
                    JointKind::Moves(joint, motor) => {
                        moving.push(Joint {
                            parent: body,
                            origin: pose * joint.origin,
                            ..joint
                        });
                        motors.push(motor);
                        bodies.push(Vec::new());
                        (bodies.len() - 1, Isometry3::identity())
                    }
                    JointKind::Fixed(at) => (body, pose * at),
                    JointKind::Locked(at, why) => {
                        locked.push((joints[j].name.as_str(), why));
                        (body, pose * at)
                    }
                };
            bodies[placed[child].0].push(child);
        }
        problems.notes.extend(joints::note(&locked));
        let without_range = locked
            .iter()
            .filter(|(_, why)| *why == joints::WITHOUT_RANGE)
            .count();

        let mut bodied = Vec::with_capacity(bodies.len());
        for members in &bodies {
            let (name, line) = (links[members[0]].name.clone(), urdf.link_lines[members[0]]);
            let masses: Vec<_> = members
                .iter()
                .filter_map(|&i| Some((parts[i].as_ref()?, placed[i].1)))
                .collect();
            if masses.is_empty() {
                let accepted = "a number > 0 (what is fixed to a link counts with it)";
                problems.add(
                    line,
                    format!("link {name}: mass"),
                    0,
                    "a link that moves must have mass",
                    accepted,
                );
                continue;
            }
            let solids = [&solids.collisions, &solids.visuals].map(|of_links| {
                let of_members = members.iter().flat_map(|&i| &of_links[i]);
                of_members
                    .map(|solid| Solid {
                        pose: placed[solid.frame].1 * solid.pose,
                        ..solid.clone()
                    })
                    .collect()
            });
            bodied.push(merged(name, &masses, solids, &mut problems));
        }
        problems.check()?;
        let lines: Vec<usize> = bodies
            .iter()
            .map(|members| urdf.link_lines[members[0]])
            .collect();
        check_gyration(&bodied, &moving, &lines, &mut problems);
        problems.check()?;
        if !problems.mended.is_empty() {
            let list = problems.mended.join("; ");
            problems.notes.push(format!(
                "Inertias that no rigid body has were mended by raising their small principal moments [kg m^2]: {list}."
            ));
        }
        let frames = links
            .iter()
            .zip(&placed)
            .map(|(link, &(body, pose))| Frame {
                name: link.name.clone(),
                link: body,
                pose,
            });
        Ok(Tree {
            frames: frames.collect(),
            name: urdf.robot.name,
            links: bodied,
            joints: moving,
            motors,
            notes: problems.notes,
            missing: solids.missing,
            without_range,
            kept_meshes: solids.kept_meshes,
            postures: urdf.postures,
        })
    }
}

/// Index of each name, given with their lines.
fn by_name<'a>(
    what: &str,
    names: impl Iterator<Item = (&'a str, usize)>,
    problems: &mut Problems,
) -> HashMap<&'a str, usize> {
    let mut indices = HashMap::new();
    for (index, (name, line)) in names.enumerate() {
        if *indices.entry(name).or_insert(index) != index {
            problems.add(line, what, name, "is used twice", "unique names");
        }
    }
    indices
}

/// Indices of the parent and child links of a joint.
fn ends(
    joint: &urdf_rs::Joint,
    line: usize,
    names: &HashMap<&str, usize>,
    links: &[urdf_rs::Link],
    problems: &mut Problems,
) -> Option<[usize; 2]> {
    let mut find = |end: &str, name: &str| {
        let index = names.get(name).copied();
        if index.is_none() {
            let names: Vec<_> = links.iter().map(|l| l.name.as_str()).collect();
            problems.add(
                line,
                format!("joint {}: {end}", joint.name),
                name,
                "no such link",
                names.join(", "),
            );
        }
        index
    };
    let (parent, child) = (
        find("parent", &joint.parent.link),
        find("child", &joint.child.link),
    );
    Some([parent?, child?])
}

/// The root, and each joint with the indices of its parent and child.
type Order = (usize, Vec<(usize, [usize; 2])>);

/// The only link that no joint carries, and the joints in the order of the file, except that a parent always comes
/// before its children. None if the links are not a tree.
fn order(urdf: &xml::Urdf, ends: &[[usize; 2]], problems: &mut Problems) -> Option<Order> {
    let (links, joints) = (&urdf.robot.links, &urdf.robot.joints);
    let (mut carriers, mut carried) =
        (vec![Vec::new(); links.len()], vec![Vec::new(); links.len()]);
    for (j, &[parent, child]) in ends.iter().enumerate() {
        carriers[child].push(joints[j].name.as_str());
        carried[parent].push(j);
    }
    let mut is_tree = true;
    for (link, carriers) in carriers
        .iter()
        .enumerate()
        .filter(|(_, carriers)| carriers.len() > 1)
    {
        let (field, value) = (format!("link {}", links[link].name), carriers.join(", "));
        problems.add(
            urdf.link_lines[link],
            field,
            value,
            "is the child of several joints",
            "one joint per link",
        );
        is_tree = false;
    }
    let roots: Vec<usize> = (0..links.len())
        .filter(|&link| carriers[link].is_empty())
        .collect();
    let &[root] = roots.as_slice() else {
        let names: Vec<&str> = roots
            .iter()
            .take(5)
            .map(|&link| links[link].name.as_str())
            .collect();
        match names.is_empty() {
            true => problems.add(
                0,
                "link",
                "(none)",
                "there is no root link (no links, or a cycle)",
                "one root link",
            ),
            false => {
                let accepted = "exactly one link that is no joint's child";
                problems.add(
                    0,
                    "link",
                    names.join(", "),
                    "there are several root links",
                    accepted,
                );
            }
        }
        return None;
    };
    let mut due: BinaryHeap<Reverse<usize>> = carried[root].iter().copied().map(Reverse).collect();
    let mut order = Vec::with_capacity(joints.len());
    while let Some(Reverse(j)) = due.pop().filter(|_| is_tree) {
        order.push((j, ends[j]));
        due.extend(carried[ends[j][1]].iter().copied().map(Reverse));
    }
    if is_tree && order.len() < joints.len() {
        let is_reached: std::collections::HashSet<usize> = order.iter().map(|(j, _)| *j).collect();
        let lost = (0..joints.len())
            .find(|j| !is_reached.contains(j))
            .unwrap_or(0);
        let joint = &joints[lost];
        let (field, value) = (
            format!("joint {}", joint.name),
            format!("{} -> {}", joint.parent.link, joint.child.link),
        );
        let problem = format!(
            "is not connected to the root link {} (a cycle)",
            links[root].name
        );
        problems.add(
            urdf.joint_lines[lost],
            field,
            value,
            problem,
            "a tree of links",
        );
        is_tree = false;
    }
    is_tree.then_some((root, order))
}
