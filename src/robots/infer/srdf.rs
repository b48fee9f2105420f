//! Reference postures from an SRDF, the file of MoveIt and Pinocchio beside a URDF, or of the keyframes of an MJCF.

use crate::tree::Posture;
use crate::xml_limits;
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use standfast_files::assets::{self, Source};
use std::path::{Path, PathBuf};

/// Names of postures in which a robot stands, best first.
const STANDING: [&str; 6] = [
    "half_sitting",
    "standing",
    "stand",
    "home",
    "walking",
    "default",
];

/// How well a posture of this name suits for standing, 0 the best. None if the name does not say that the robot stands.
fn rank(name: &str) -> Option<usize> {
    STANDING
        .iter()
        .position(|standing| name.eq_ignore_ascii_case(standing))
}

/// The reference posture among those that the robot's own file names: the best by its name, or the only one.
pub fn among(postures: &[Posture], file: &str, robot: &Robot) -> Option<Reference> {
    let ranked = postures
        .iter()
        .filter_map(|posture| Some((rank(&posture.name)?, posture)));
    let best = ranked
        .min_by_key(|(rank, _)| *rank)
        .map(|(_, posture)| posture);
    let posture = best.or(postures.first().filter(|_| postures.len() == 1))?;
    let angle = |name: &str| {
        let mut angles = posture.by_joint.iter();
        angles
            .find(|(joint, _)| joint == name)
            .map_or(0.0, |(_, angle)| *angle)
    };
    let name = if posture.name.is_empty() {
        "keyframe"
    } else {
        &posture.name
    };
    Some(Reference {
        name: format!("{name} of {file}"),
        angles_rad: robot
            .joints
            .iter()
            .map(|joint| angle(&joint.name))
            .collect(),
    })
}

/// A posture that a file names.
pub struct Reference {
    /// The name of the posture, and its file.
    pub name: String,
    /// One angle per joint (rad). Joints that the posture does not name are at 0.
    pub angles_rad: Vec<f64>,
}

/// The reference posture for a URDF from an SRDF of the same name, beside it or in a folder `srdf` beside or above it.
/// It is None if no posture has a name of standing. Fails if the file cannot be read or is malformed.
pub fn beside(urdf: &Source, robot: &Robot) -> Result<Option<Reference>> {
    if urdf.is_builtin() {
        return Ok(None);
    }
    let Some(path) = places(Path::new(&urdf.file))
        .into_iter()
        .find(|path| path.is_file())
    else {
        return Ok(None);
    };
    read(&assets::text(&path)?, robot)
}

/// The paths at which an SRDF may be. `talos_full_v2.urdf` belongs to `talos.srdf` too.
fn places(urdf: &Path) -> Vec<PathBuf> {
    let stem = urdf
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    let stem = stem.split('.').next().unwrap_or_default();
    // The name, and the name without its last words.
    let mut names = vec![stem.to_string()];
    names.extend(
        stem.match_indices('_')
            .rev()
            .map(|(at, _)| stem[..at].to_string()),
    );
    let absolute = std::path::absolute(urdf).unwrap_or_else(|_| urdf.into());
    let above: Vec<PathBuf> = absolute
        .ancestors()
        .skip(1)
        .take(2)
        .map(Path::to_path_buf)
        .collect();
    let folders = above
        .first()
        .cloned()
        .into_iter()
        .chain(above.iter().map(|folder| folder.join("srdf")));
    folders
        .flat_map(|folder| {
            names
                .iter()
                .map(|name| folder.join(format!("{name}.srdf")))
                .collect::<Vec<_>>()
        })
        .collect()
}

fn read(source: &Source, robot: &Robot) -> Result<Option<Reference>> {
    let document = xml_limits::of_file(&source.file, &source.text)?;
    let states = document
        .root_element()
        .children()
        .filter(|node| node.has_tag_name("group_state"));
    let named = states.filter_map(|state| {
        let name = state.attribute("name")?;
        Some((rank(name)?, state))
    });
    let Some((_, state)) = named.min_by_key(|(rank, _)| *rank) else {
        return Ok(None);
    };
    let name = state.attribute("name").unwrap_or_default();
    let mut angles_rad = vec![0.0; robot.joints.len()];
    for node in state.children().filter(|node| node.has_tag_name("joint")) {
        let joint = robot
            .joints
            .iter()
            .position(|joint| Some(joint.name.as_str()) == node.attribute("name"));
        let angle = node
            .attribute("value")
            .and_then(|value| value.trim().parse::<f64>().ok())
            .filter(|a| a.is_finite());
        // The state names the floating base and locked joints as well, some with several values.
        if let (Some(joint), Some(angle)) = (joint, angle) {
            angles_rad[joint] = angle;
        }
    }
    Ok(Some(Reference {
        name: format!("{name} of {}", source.file),
        angles_rad,
    }))
}
