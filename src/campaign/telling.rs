//! The trials of a gain set that are worth a look: what it lost without need, and the hardest that it survived.

use crate::campaign::Row;
use crate::episode::Outcome;
use serde::Serialize;

/// How many lost trials are named.
const LOST: usize = 3;

/// A trial to replay, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Telling {
    pub trial: u64,
    pub impulse_n_s: f64,
    pub heading_deg: f64,
    pub why: &'static str,
}

impl Telling {
    /// Of one set's rows: the lost trials that the pendulum calls the easiest (impulse over m omega d), easiest first; then
    /// the hardest one that it survived.
    pub fn of(rows: &[&Row]) -> Vec<Self> {
        let is_recovered = |row: &&&Row| row.outcome == Outcome::Recovered;
        let mut lost: Vec<&Row> = rows.iter().filter(|row| !is_recovered(row)).copied().collect();
        lost.sort_by(|a, b| a.hardness().total_cmp(&b.hardness()));
        let survived = rows.iter().filter(is_recovered).max_by(|a, b| a.hardness().total_cmp(&b.hardness()));
        let telling = |row: &Row, why| {
            let Row { trial, impulse_n_s, heading_deg, .. } = *row;
            Self { trial, impulse_n_s, heading_deg, why }
        };
        let lost = lost.into_iter().take(LOST).map(|row| telling(row, "lost, though among the easiest"));
        lost.chain(survived.map(|row| telling(row, "the hardest that it survived"))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::row::tests::row;

    #[test]
    fn the_easiest_that_were_lost_come_first_and_the_hardest_that_was_survived_last() {
        let rows: Vec<Row> = [(2.0, false), (9.0, false), (1.0, true), (0.5, false), (7.0, true), (3.0, false)]
            .into_iter()
            .enumerate()
            .map(|(i, (ratio, survived))| Row {
                impulse_over_m_omega_d: Some(ratio),
                ..row(i as u64, "a", 1.0, if survived { Outcome::Recovered } else { Outcome::Fell })
            })
            .collect();
        let telling = Telling::of(&rows.iter().collect::<Vec<_>>());
        assert_eq!(telling.iter().map(|t| t.trial).collect::<Vec<_>>(), [3, 0, 5, 4]);
        assert!(telling[3].why.contains("hardest"));
        assert!(Telling::of(&[]).is_empty());
    }
}
