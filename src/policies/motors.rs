//! The motors of a policy's training beside those of the robot.

use super::Motors;
use standfast_core::robot::{Robot, Servo};
use std::fmt::Write;

/// Least relative difference of two figures that is told.
const TOLD: f64 = 0.02;
/// Most joints that are named for one difference.
const MOST_NAMES: usize = 2;

/// How the robot's motors differ from those of the training, in words; None if they do not. `joints` are the indices in the
/// robot of the policy's joints.
pub(super) fn otherwise(training: &Motors, robot: &Robot, joints: &[usize]) -> Option<String> {
    let figures: [(_, &str, &str, fn(&Servo) -> f64); 2] = [
        (&training.torque_n_m, "torque limits", "N m", |servo| {
            servo.torque_n_m
        }),
        (
            &training.rotor_inertia_kg_m2,
            "rotor inertias",
            "kg m^2",
            |servo| servo.rotor_inertia_kg_m2,
        ),
    ];
    let mut told = Vec::new();
    for (list, what, unit, of_robot) in figures {
        let Some(list) = list else { continue };
        // Joints with the same two figures are told once.
        let mut groups: Vec<([String; 2], Vec<usize>)> = Vec::new();
        for (&joint, &trained) in joints.iter().zip(list) {
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
