//! A robot by its values: masses, joints, motors, soles, sensors and reach, by the names of links and joints. Two robots
//! are the same if their values are, whatever their files look like.

use crate::ask::bounds::shown;
use nalgebra::{Isometry3, Vector3};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Foot, Robot};
use std::collections::BTreeSet;

/// Values that differ by less than this share of the largest one in their list are alike: files round them.
const ALIKE_SHARE: f64 = 1e-3;
/// Values that differ by less than this are alike (in SI units).
const ALIKE: f64 = 1e-6;

/// The values of a robot, as a tree of tables by name. Shapes other than the soles are left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotValues(Value);

/// Where the values of two robots differ.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotDifferences {
    /// Number of values that both have.
    pub values: usize,
    /// A sentence for each value that differs, or that one of them lacks.
    pub differing: Vec<String>,
    /// The joints that only one of them has.
    pub other_joints: Vec<String>,
}

impl RobotValues {
    pub fn of(robot: &Robot) -> Self {
        let mut links = Map::new();
        for link in &robot.links {
            let i = &link.inertia_kg_m2;
            let values = json!({
                "mass_kg": link.mass_kg,
                "com_m": link.com_m.coords.as_slice(),
                "inertia_kg_m2": [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]],
            });
            links.insert(link.name.clone(), values);
        }
        let mut joints = Map::new();
        for (number, joint) in robot.joints.iter().enumerate() {
            let values = json!({
                "parent": robot.links[joint.parent].name,
                "position_m": joint.origin.translation.vector.as_slice(),
                "rotation": rotation(&joint.origin),
                "axis": joint.axis.as_slice(),
                "limits_rad": [joint.lower_rad, joint.upper_rad],
                "home_rad": robot.home_rad[number],
                "servo": robot.servos[number],
            });
            joints.insert(joint.name.clone(), values);
        }
        let sole = |foot: Foot| {
            let sole = &robot.soles[foot];
            json!({
                "link": robot.links[sole.link].name,
                "center_m": sole.center.translation.vector.as_slice(),
                "rotation": rotation(&sole.center),
                "half_m": sole.half_m,
            })
        };
        let reach: Map<String, Value> = robot
            .reach
            .iter()
            .map(|region| (region.name.clone(), json!(region)))
            .collect();
        Self(json!({
            "links": links,
            "joints": joints,
            "soles": { "left": sole(Foot::Left), "right": sole(Foot::Right) },
            "trunk": robot.links[robot.trunk].name,
            "reach": reach,
            "friction": robot.friction,
            "delay_s": robot.delay_s,
            "noise": robot.noise,
        }))
    }

    /// Where these values differ from those of the robot `there`.
    pub fn differences(&self, there: &RobotValues) -> RobotDifferences {
        let joints = |robot: &RobotValues| -> BTreeSet<String> {
            let joints = robot.0["joints"].as_object();
            joints.into_iter().flat_map(Map::keys).cloned().collect()
        };
        let mut found = RobotDifferences {
            values: 0,
            differing: Vec::new(),
            other_joints: joints(self)
                .symmetric_difference(&joints(there))
                .cloned()
                .collect(),
        };
        found.add("", &self.0, &there.0);
        found
    }
}

/// The images of x and y under a rotation, which tell it without a choice of sign.
fn rotation(pose: &Isometry3<f64>) -> [f64; 6] {
    let [x, y] = [Vector3::x(), Vector3::y()].map(|axis| pose.rotation * axis);
    [x.x, x.y, x.z, y.x, y.y, y.z]
}

impl RobotDifferences {
    /// Says in which values the robot differs from that of the result `name`. None if they are alike. It fails if it has
    /// other joints.
    pub fn warning(&self, name: &str) -> Result<Option<String>> {
        if !self.other_joints.is_empty() {
            let problem = format!(
                "its robot has other joints: {}; give the same --robot",
                first_of(&self.other_joints)
            );
            return Err(Error::Parts {
                path: name.into(),
                problem,
            });
        }
        let count = self.differing.len();
        Ok((count > 0).then(|| {
            format!(
                "the robot is not that of {name}, so that a difference may be one of robots: {count} of its {} values differ: \
                 {}",
                self.values,
                first_of(&self.differing)
            )
        }))
    }

    fn add(&mut self, key: &str, here: &Value, there: &Value) {
        if let (Value::Object(ours), Value::Object(theirs)) = (here, there) {
            let more = theirs.keys().filter(|name| !ours.contains_key(*name));
            for name in ours.keys().chain(more) {
                let key = match key {
                    "" => name.clone(),
                    key => format!("{key}.{name}"),
                };
                match (ours.get(name), theirs.get(name)) {
                    (Some(here), Some(there)) => self.add(&key, here, there),
                    (Some(_), None) => self.differing.push(format!("{key} is not there")),
                    _ => self.differing.push(format!("{key} is not here")),
                }
            }
            return;
        }
        self.values += 1;
        if !are_alike(here, there) {
            let [there, here] = [there, here].map(in_words);
            self.differing
                .push(format!("{key} is {there} there and {here} here"));
        }
    }
}

/// The first sentences or names of a list, and how many more there are.
fn first_of(all: &[String]) -> String {
    const SHOWN: usize = 4;
    let first = all[..all.len().min(SHOWN)].join("; ");
    match all.len().saturating_sub(SHOWN) {
        0 => first,
        more => format!("{first}; and {more} more"),
    }
}

/// Whether two values, or two lists of numbers, are alike.
fn are_alike(here: &Value, there: &Value) -> bool {
    let (Some(here), Some(there)) = (numbers(here), numbers(there)) else {
        return here == there;
    };
    let largest = here
        .iter()
        .chain(&there)
        .fold(0.0, |most: f64, x| most.max(x.abs()));
    let most = ALIKE.max(ALIKE_SHARE * largest);
    here.len() == there.len() && here.iter().zip(&there).all(|(a, b)| (a - b).abs() <= most)
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(list) => list.iter().map(Value::as_f64).collect(),
        value => Some(vec![value.as_f64()?]),
    }
}

/// A value as a sentence shows it, numbers with four digits.
fn in_words(value: &Value) -> String {
    match numbers(value).as_deref() {
        Some([one]) => shown(*one),
        Some(list) => format!(
            "[{}]",
            list.iter()
                .map(|x| shown(*x))
                .collect::<Vec<_>>()
                .join(", ")
        ),
        None => value.to_string(),
    }
}
