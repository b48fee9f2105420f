//! Sorts the trials of a campaign into strata by one of the quantities that were drawn for them, to show where
//! controllers differ.
//!
//! A stratum depends only on the drawn quantities, which are the same for every controller, and never on outcomes.
//! Trials are sorted by one quantity at a time, so each trial is in one stratum of each quantity. A quantity makes no
//! strata if it does not vary, or if all trials would be in the same stratum. Edges lie at quantiles, and are rounded
//! to a digit that is at most a twentieth of the range.

use crate::verdict::trial_columns::TrialConditions;
use std::rc::Rc;

/// Trials that are alike in one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Stratum {
    /// The quantity: "heading", "impulse", "duration", "height", "second push", "slope along the push", or one of robot
    /// and ground by its name in a campaign ("friction").
    pub by: &'static str,
    /// The values in this stratum, with unit: "forward", "2.1 to 3.8 N s", "below 0.06 s".
    pub label: String,
    /// Index of the stratum of each trial, among the strata of the quantity; and the index of this stratum.
    places: Rc<[u8]>,
    own: u8,
}

impl Stratum {
    /// Numbers of the trials, ascending.
    pub fn trials(&self) -> impl Iterator<Item = usize> {
        self.places
            .iter()
            .enumerate()
            .filter(|(_, place)| **place == self.own)
            .map(|(trial, _)| trial)
    }
}

/// All strata of a campaign, made from the drawn quantities of its trials.
pub fn strata(drawn: &TrialConditions) -> Vec<Stratum> {
    let mut strata = Vec::new();
    let headings = drawn.heading_deg.iter();
    if range(headings.clone()).is_some() {
        strata.extend(sorted(
            "heading",
            headings,
            SECTORS.map(|(label, _)| label.to_string()),
            sector,
        ));
    }
    strata.extend(at_quantiles("impulse", drawn.impulse_n_s.iter(), 3, " N s"));
    strata.extend(at_quantiles("duration", drawn.duration_s.iter(), 2, " s"));
    strata.extend(by_height(drawn.height_m.iter()));
    strata.extend(at_quantiles(
        "second push",
        drawn.second_impulse_n_s.iter(),
        2,
        " N s",
    ));
    // The sign of a slope has a meaning only relative to the direction of the push.
    let slopes = drawn
        .varied("slope_deg")
        .zip(drawn.varied("slope_heading_deg"));
    let along = slopes.into_iter().flat_map(|(slopes, headings)| {
        slopes
            .iter()
            .zip(headings.iter())
            .zip(drawn.heading_deg.iter())
            .map(|((slope_deg, towards_deg), heading_deg)| {
                let between_deg = towards_deg? - heading_deg?;
                Some(slope_deg? * between_deg.to_radians().cos())
            })
    });
    let labels = ["downhill", "uphill"].map(String::from);
    strata.extend(sorted("slope along the push", along, labels, |rise| {
        usize::from(rise > 0.0)
    }));
    for (name, values) in drawn
        .variation
        .iter()
        .filter(|(name, _)| !name.starts_with("slope"))
    {
        let unit = match name {
            name if name.ends_with("_m") => " m",
            name if name.ends_with("_s") => " s",
            _ => "",
        };
        strata.extend(at_quantiles(name, values.iter(), 2, unit));
    }
    strata
}

/// Sectors of headings, left and right together, each with the angle from forward at which it ends (degrees).
const SECTORS: [(&str, f64); 5] = [
    ("forward", 22.5),
    ("diagonally forward", 67.5),
    ("sideways", 112.5),
    ("diagonally backward", 157.5),
    ("backward", 180.0),
];

/// Index of the sector of a heading (degrees, any turn).
fn sector(heading_deg: f64) -> usize {
    let turned = heading_deg.rem_euclid(360.0);
    let from_forward = turned.min(360.0 - turned);
    SECTORS
        .iter()
        .position(|&(_, end)| from_forward <= end)
        .unwrap_or(SECTORS.len() - 1)
}

/// Strata below the COM and above it. If all pushes are on one side, they are the lower and the upper half.
fn by_height(heights: impl Iterator<Item = Option<f64>> + Clone) -> Vec<Stratum> {
    let labels = ["below the COM", "above the COM"].map(String::from);
    let sides = sorted("height", heights.clone(), labels, |height| {
        usize::from(height >= 0.0)
    });
    if sides.is_empty() {
        at_quantiles("height", heights, 2, " m above the COM")
    } else {
        sides
    }
}

/// Makes `parts` strata with about equal numbers of trials. There are none if the values vary too little for `parts`
/// strata.
fn at_quantiles(
    by: &'static str,
    values: impl Iterator<Item = Option<f64>> + Clone,
    parts: usize,
    unit: &str,
) -> Vec<Stratum> {
    let Some([least, most]) = range(values.clone()) else {
        return Vec::new();
    };
    let mut ascending: Vec<f64> = values.clone().flatten().collect();
    ascending.sort_unstable_by(f64::total_cmp);
    // Number of digits after the point: 0 for whole numbers, 1 for tenths, ...
    let digits = (-((most - least) / 20.0).log10().floor()).max(0.0) as usize;
    let mut edges = Vec::new();
    for part in 1..parts {
        let value = ascending[part * ascending.len() / parts];
        let rounded: f64 = format!("{value:.digits$}").parse().unwrap_or(value);
        // Adding 0 turns -0 into 0.
        edges.push((rounded, format!("{:.digits$}", rounded + 0.0)));
    }
    let mut labels = Vec::new();
    for part in 0..parts {
        let from = part.checked_sub(1).map(|below| &edges[below].1);
        let to = edges.get(part).map(|(_, to)| to);
        labels.push(match (from, to) {
            (None, Some(to)) => format!("below {to}{unit}"),
            (Some(from), Some(to)) => format!("{from} to {to}{unit}"),
            (Some(from), None) => format!("from {from}{unit}"),
            (None, None) => "all".into(),
        });
    }
    sorted(by, values, labels, |value| {
        edges.iter().filter(|(edge, _)| value >= *edge).count()
    })
}

/// Sorts trials into the strata of `labels`, by the index that `of` gives for a value. Empty strata are left out, and
/// if fewer than two remain, there are none. A trial without a value is in no stratum.
fn sorted(
    by: &'static str,
    values: impl Iterator<Item = Option<f64>>,
    labels: impl IntoIterator<Item = String>,
    of: impl Fn(f64) -> usize,
) -> Vec<Stratum> {
    let places: Rc<[u8]> = values
        .map(|value| value.map_or(u8::MAX, |value| of(value) as u8))
        .collect();
    let mut strata = Vec::new();
    for (own, label) in (0..).zip(labels) {
        let stratum = Stratum {
            by,
            label,
            places: places.clone(),
            own,
        };
        if stratum.trials().next().is_some() {
            strata.push(stratum);
        }
    }
    if strata.len() < 2 { Vec::new() } else { strata }
}

/// The least and the greatest value. It is None if they are the same, or if there are no values.
fn range(values: impl Iterator<Item = Option<f64>> + Clone) -> Option<[f64; 2]> {
    let least = values.clone().flatten().reduce(f64::min)?;
    let most = values.flatten().reduce(f64::max)?;
    (least < most).then_some([least, most])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::trial;
    use crate::fixtures::Changed as _;
    use crate::fixtures::campaign;
    use crate::fixtures::{record, row};
    use crate::store::row::TrialRow;

    use standfast_sim::episode::Outcome::{Fell, Recovered};

    fn of_rows(rows: impl Iterator<Item = TrialRow>) -> Vec<Stratum> {
        strata(&crate::fixtures::columns_of_rows(&rows.collect::<Vec<_>>(), &["a"]).drawn)
    }

    /// Strata of a campaign as it is drawn. Nothing is simulated.
    fn drawn(name: &str, trials: u64, set: &[&str]) -> Vec<Stratum> {
        let campaign = campaign(name, set);
        of_rows((0..trials).map(|trial| {
            let pushes = trial::pushes(&campaign, trial);
            let variation = trial::variation(&campaign, trial);
            TrialRow::new(trial, "a", &pushes, None, variation, record(Recovered))
        }))
    }

    fn quantities(strata: &[Stratum]) -> Vec<&str> {
        let mut names: Vec<&str> = strata.iter().map(|stratum| stratum.by).collect();
        names.dedup();
        names
    }

    fn labels<'a>(strata: &'a [Stratum], by: &str) -> Vec<&'a str> {
        strata
            .iter()
            .filter(|stratum| stratum.by == by)
            .map(|stratum| stratum.label.as_str())
            .collect()
    }

    fn trials(strata: &[Stratum], label: &str) -> Vec<usize> {
        strata
            .iter()
            .find(|stratum| stratum.label == label)
            .unwrap()
            .trials()
            .collect()
    }

    #[test]
    fn headings_are_sorted_by_their_angle_from_forward() {
        for (headings, label) in [
            (&[0.0, 22.0, -22.0, 350.0, -360.0][..], "forward"),
            (&[23.0, -67.0, 315.0], "diagonally forward"),
            (&[68.0, -90.0, 112.0, 270.0], "sideways"),
            (&[113.0, -135.0, 225.0], "diagonally backward"),
            (&[158.0, 180.0, -180.0, 190.0], "backward"),
        ] {
            for heading_deg in headings {
                assert_eq!(SECTORS[sector(*heading_deg)].0, label, "{heading_deg}");
            }
        }
    }

    #[test]
    fn what_varies_is_sorted_and_nothing_else() {
        assert_eq!(
            quantities(&drawn("nominal", 100, &[])),
            ["heading", "impulse"]
        );
        assert_eq!(
            drawn(
                "nominal",
                100,
                &["push.heading_deg=30", "push.impulse_n_s=2"]
            ),
            []
        );
        let standard = drawn("standard", 300, &[]);
        let of_push = [
            "heading",
            "impulse",
            "duration",
            "height",
            "slope along the push",
            "mass_scale",
        ];
        let of_robot = [
            "trunk_com_x_m",
            "trunk_com_y_m",
            "friction",
            "torque_scale",
            "delay_s",
        ];
        assert_eq!(quantities(&standard), [&of_push[..], &of_robot].concat());
        assert_eq!(
            labels(&standard, "heading"),
            SECTORS.map(|(label, _)| label)
        );
        assert_eq!(
            labels(&standard, "height"),
            ["below the COM", "above the COM"]
        );
        assert_eq!(of_rows(std::iter::empty()), []);
    }

    #[test]
    fn every_trial_is_in_one_stratum_of_each_quantity_and_halves_are_halves() {
        let strata = drawn("harsh", 300, &["push.height_m={uniform=[0.0, 0.2]}"]);
        assert!(
            ["second push", "ground_step_m"]
                .iter()
                .all(|by| quantities(&strata).contains(by))
        );
        for by in quantities(&strata) {
            let of: Vec<&Stratum> = strata.iter().filter(|stratum| stratum.by == by).collect();
            let mut trials: Vec<usize> = of.iter().flat_map(|stratum| stratum.trials()).collect();
            trials.sort_unstable();
            assert!(trials.into_iter().eq(0..300), "{by}");
            for stratum in &of {
                let share = stratum.trials().count() as f64 / 300.0 * of.len() as f64;
                assert!(by == "heading" || (share - 1.0).abs() < 0.2, "{of:?}");
            }
        }
    }

    #[test]
    fn labels_tell_the_edges_and_their_unit() {
        let strata = of_rows((0..30).map(|i| {
            let share = i as f64;
            row(i, "a", 1.0 + 0.1 * share, Fell).with(|row| {
                row.push.duration_s = 0.02 + 0.001 * share;
                row.push.height_m = 0.1 + 0.002 * share;
                row.variation.friction = Some(0.5 + 0.01 * share);
                row.variation.trunk_com_x_m = Some(-0.01501 + 0.001 * share);
            })
        }));
        for (by, expected) in [
            (
                "impulse",
                &["below 2.0 N s", "2.0 to 3.0 N s", "from 3.0 N s"][..],
            ),
            ("duration", &["below 0.035 s", "from 0.035 s"]),
            ("friction", &["below 0.65", "from 0.65"]),
            ("trunk_com_x_m", &["below 0.000 m", "from 0.000 m"]),
            (
                "height",
                &["below 0.130 m above the COM", "from 0.130 m above the COM"],
            ),
        ] {
            assert_eq!(labels(&strata, by), expected);
        }
        assert_eq!(
            trials(&strata, "2.0 to 3.0 N s"),
            (10..20).collect::<Vec<_>>()
        );
    }

    #[test]
    fn a_slope_counts_by_its_rise_along_the_push() {
        let slopes = [
            (1.0, 0.0, 10.0),
            (1.0, 180.0, 10.0),
            (-1.0, 180.0, 10.0),
            (-1.0, 0.0, 10.0),
            (1.0, -90.0, -100.0),
        ];
        let strata = of_rows((0..).zip(slopes).map(
            |(i, (slope_deg, towards_deg, heading_deg))| {
                row(i, "a", 1.0, Fell).with(|row| {
                    row.variation.slope_deg = Some(slope_deg);
                    row.variation.slope_heading_deg = Some(towards_deg);
                    row.push.heading_deg = heading_deg;
                })
            },
        ));
        assert_eq!(
            (trials(&strata, "uphill"), trials(&strata, "downhill")),
            (vec![0, 2, 4], vec![1, 3])
        );
    }
}
