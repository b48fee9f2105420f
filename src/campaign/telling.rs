//! The trials of a gain set that are worth a look: what it lost without need, what another set survived, and the hardest
//! that it survived.

use crate::campaign::Row;
use crate::campaign::paired::trials;
use crate::episode::Outcome;
use serde::Serialize;

/// How many of the easiest lost trials are named, and how many sets that survived what was lost.
const LOST: usize = 3;
const OTHERS: usize = 3;

/// A trial to replay, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Telling {
    pub trial: u64,
    pub impulse_n_s: f64,
    /// By which a push is hard or easy here: 1 is what standing could take.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub impulse_over_m_omega_d: Option<f64>,
    pub heading_deg: f64,
    pub survived: bool,
    pub why: String,
}

impl Telling {
    /// Of set number `set` of those that are named; `rows` are sorted by trial, then by set. First the lost trials that the
    /// pendulum calls the easiest (impulse over m omega d), easiest first; then, for the first of the other sets, the first
    /// trial that it survived and this set lost; last the hardest one that this set survived.
    pub fn of(rows: &[Row], names: &[String], set: usize) -> Vec<Self> {
        let recovered = |row: &Row| row.outcome == Outcome::Recovered;
        let harder = |a: &&Row, b: &&Row| a.hardness().total_cmp(&b.hardness());
        let own = || trials(rows, names.len()).map(|trial| &trial[set]);
        let mut lost: Vec<&Row> = own().filter(|row| !recovered(row)).collect();
        lost.sort_by(harder);
        let easiest = lost.into_iter().take(LOST).map(|row| (row, "lost, though among the easiest".to_string()));
        let others = (0..names.len()).filter_map(|other| {
            let differs = |trial: &&[Row]| recovered(&trial[other]) && !recovered(&trial[set]);
            let found = trials(rows, names.len()).find(differs)?;
            Some((&found[set], format!("lost; {} survives it", names[other])))
        });
        let hardest = own().filter(|row| recovered(row)).max_by(harder);
        let hardest = hardest.map(|row| (row, "the hardest that it survived".to_string()));
        let telling = |(row, why): (&Row, String)| {
            let Row { trial, impulse_n_s, impulse_over_m_omega_d, heading_deg, .. } = *row;
            Self { trial, impulse_n_s, impulse_over_m_omega_d, heading_deg, survived: recovered(row), why }
        };
        easiest.chain(others.take(OTHERS)).chain(hardest).map(telling).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::row::tests::row;

    #[test]
    fn the_easiest_that_were_lost_come_first_and_the_hardest_that_was_survived_last() {
        let outcome = |survived: bool| if survived { Outcome::Recovered } else { Outcome::Fell };
        let trials = [(2.0, false), (9.0, false), (1.0, true), (0.5, false), (7.0, true), (3.0, false)];
        let rows: Vec<Row> = (trials.into_iter().enumerate())
            .flat_map(|(i, (ratio, survived))| {
                let rows = [("a", survived), ("b", i == 1 || i == 5)];
                rows.map(|(set, survived)| Row {
                    impulse_over_m_omega_d: Some(ratio),
                    ..row(i as u64, set, 1.0, outcome(survived))
                })
            })
            .collect();
        let names = ["a", "b"].map(String::from);
        let telling = Telling::of(&rows, &names, 0);
        assert_eq!(telling.iter().map(|t| t.trial).collect::<Vec<_>>(), [3, 0, 5, 1, 4]);
        assert_eq!(telling[3].why, "lost; b survives it");
        assert!(telling[4].why.contains("hardest"));
        assert!(Telling::of(&[], &names, 0).is_empty());
    }
}
