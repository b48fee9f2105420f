//! The motors of a policy's training beside those of the robot.

use super::Motors;
use standfast_core::robot::{Robot, Servo};
use std::fmt::Write;

/// Least relative difference of two figures that is told.
const TOLD: f64 = 0.02;
/// Most joints that are named for one difference.
const MOST_NAMES: usize = 2;

/// A figure of motors: the numbers of the training by joint, name and unit, and the number of a servo of the robot.
struct Figure<'a> {
    trained: Option<&'a [f64]>,
    what: &'static str,
    unit: &'static str,
    of_robot: fn(&Servo) -> f64,
}

/// How the robot's motors differ from those of the training, in words; None if they do not. `joints` are the indices in the
/// robot of the policy's joints.
pub(super) fn otherwise(training: &Motors, robot: &Robot, joints: &[usize]) -> Option<String> {
    let figures = [
        Figure {
            trained: training.torque_n_m.as_deref(),
            what: "torque limits",
            unit: "N m",
            of_robot: |servo| servo.torque_n_m,
        },
        Figure {
            trained: training.rotor_inertia_kg_m2.as_deref(),
            what: "rotor inertias",
            unit: "kg m^2",
            of_robot: |servo| servo.rotor_inertia_kg_m2,
        },
    ];
    let mut told = Vec::new();
    for Figure {
        trained,
        what,
        unit,
        of_robot,
    } in figures
    {
        // Joints with the same two figures are told once.
        let mut groups: Vec<([String; 2], Vec<usize>)> = Vec::new();
        for (&joint, &trained) in joints.iter().zip(trained.unwrap_or_default()) {
            let own = of_robot(&robot.servos[joint]);
            if (own - trained).abs() <= TOLD * own.abs().max(trained.abs()) {
                continue;
            }
            let pair = [trained, own].map(short);
            match groups.iter_mut().find(|(known, _)| *known == pair) {
                Some((_, members)) => members.push(joint),
                None => groups.push((pair, vec![joint])),
            }
        }
        let count: usize = groups.iter().map(|(_, members)| members.len()).sum();
        // The largest group first: it says most.
        groups.sort_by_key(|(_, members)| std::cmp::Reverse(members.len()));
        let Some(([trained, own], members)) = groups.first() else {
            continue;
        };
        let names: Vec<&str> = members
            .iter()
            .take(MOST_NAMES)
            .map(|&joint| robot.joints[joint].name.as_str())
            .collect();
        let mut text = format!(
            "{what} of {count} joints ({trained} {unit}, the robot {own}: {}",
            names.join(", ")
        );
        if count > names.len() {
            let _ = write!(text, " and others");
        }
        told.push(text + ")");
    }
    (!told.is_empty()).then(|| told.join(", "))
}

/// A figure with three digits.
fn short(figure: f64) -> String {
    format!("{figure:.2e}")
        .parse::<f64>()
        .map_or_else(|_| figure.to_string(), |figure| figure.to_string())
}
