//! Reference postures from an SRDF, the file of MoveIt and Pinocchio beside a URDF.

use crate::xml_limits;
use standfast_core::error::{Error, Result};
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

/// A posture that an SRDF names.
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
    let document = xml_limits::document(&source.text).map_err(|problem| Error::Syntax {
        file: source.file.clone(),
        message: format!("the XML is malformed: {problem}"),
    })?;
    let states = document
        .root_element()
        .children()
        .filter(|node| node.has_tag_name("group_state"));
    let named = states.filter_map(|state| {
        let name = state.attribute("name")?;
        let rank = STANDING
            .iter()
            .position(|standing| name.eq_ignore_ascii_case(standing))?;
        Some((rank, state))
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
