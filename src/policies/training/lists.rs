//! What the formats of descriptions share: parsing, lists with one number or many, and motors that are numbered.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;

/// The content of a file. Errors name it.
pub fn parsed<T: DeserializeOwned>(file: &str, text: &str) -> Result<T> {
    serde_saphyr::from_str(text).map_err(|e| Error::Syntax {
        file: file.into(),
        message: e.to_string(),
    })
}

/// The names of the robot's joints, which a file numbers as its motors. Fails if the file has more motors than the
/// robot has joints.
pub fn motors(file: &str, field: &str, count: usize, robot: &Robot) -> Result<Vec<String>> {
    let names: Vec<String> = robot
        .joints
        .iter()
        .map(|joint| joint.name.clone())
        .collect();
    if count <= names.len() {
        return Ok(names);
    }
    let accepted = format!(
        "at most one for each of the {} joints of {}",
        names.len(),
        robot.name
    );
    Err(Error::value(
        file,
        field,
        format!("{count} numbers"),
        "is for more joints than the robot has",
        accepted,
    ))
}

/// One number, or one for each.
#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub enum OneOrMany {
    One(f64),
    Many(Vec<f64>),
}

impl OneOrMany {
    /// A number for each of `count`.
    pub fn each(self, count: usize) -> Vec<f64> {
        match self {
            Self::One(value) => vec![value; count],
            Self::Many(values) => values,
        }
    }
}
