//! Trials that the page names: their places in its table of trials worth a look, and how other parts point to them.

use super::value::list;
use serde_json::{Value, json};
use std::collections::HashMap;

/// Where the page tells of trials, and what replays those of each set.
pub(super) struct Named {
    /// Id of the first row for a set and a trial.
    ids: HashMap<(usize, u64), String>,
    /// For each set, what stands before and after the number of a trial.
    commands: Vec<[String; 2]>,
}

impl Named {
    pub fn new(sets: &[Value], commands: Vec<[String; 2]>) -> Self {
        let mut ids = HashMap::new();
        for (i, set) in sets.iter().enumerate() {
            let slug = slug(set["name"].as_str().unwrap_or_default(), i);
            for trial in list(&set["telling"]).iter().filter_map(|row| row["trial"].as_u64()) {
                ids.insert((i, trial), format!("trial-{trial}-{slug}"));
            }
        }
        Self { ids, commands }
    }

    pub fn commands(&self) -> &[[String; 2]] {
        &self.commands
    }

    /// For each row of a set's telling trials its id; null for a trial that stands in an earlier row.
    pub fn row_ids(&self, set: usize, rows: &[Value]) -> Vec<Option<&String>> {
        let trial = |row: &Value| row["trial"].as_u64();
        let id = |(i, row): (usize, &Value)| {
            let is_first = !rows[..i].iter().any(|earlier| trial(earlier) == trial(row));
            self.ids.get(&(set, trial(row)?)).filter(|_| is_first)
        };
        rows.iter().enumerate().map(id).collect()
    }

    /// A trial: its number, a link to where the page tells of it with one of the sets, and what replays it with the
    /// first of them.
    pub fn point(&self, trial: &Value, sets: &[usize]) -> Option<Value> {
        let number = trial.as_u64()?;
        let link = sets.iter().find_map(|set| self.ids.get(&(*set, number))).map(|id| format!("#{id}"));
        let command = self.commands.get(*sets.first()?)?.join(&number.to_string());
        Some(json!({ "trial": number, "link": link, "command": command }))
    }

    /// The trials that only one of a pair of sets recovered from: first those of the first set, each to be replayed
    /// with the set that lost it; and an example of what a better set survived.
    pub fn of_pair(&self, pair: &Value, (a, b): (usize, usize)) -> Value {
        let points = |key: &str, sets: [usize; 2]| -> Vec<Value> {
            list(&pair[key]).iter().filter_map(|trial| self.point(trial, &sets)).collect()
        };
        let only = [points("first_only_a", [b, a]), points("first_only_b", [a, b])];
        let example = match pair["verdict"].as_str() {
            Some("a_better") => only[0].first(),
            Some("b_better") => only[1].first(),
            _ => None,
        };
        json!({ "example": example, "only": only })
    }
}

/// A name as a part of an id and of a link to it; of one with other letters, which set it is.
fn slug(name: &str, set: usize) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if !name.is_empty() && name.chars().all(is_plain) { name.into() } else { format!("~{set}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_is_linked_where_it_is_told_of_and_can_be_replayed_everywhere() {
        let telling = |trials: &[u64]| trials.iter().map(|trial| json!({ "trial": trial })).collect::<Vec<_>>();
        let sets = [
            json!({ "name": "hold", "telling": telling(&[5, 7, 5]) }),
            json!({ "name": "a b", "telling": telling(&[9]) }),
        ];
        let commands = ["hold", "'a b'"].map(|set| ["push ".to_string(), format!(" {set}")]);
        let named = Named::new(&sets, commands.to_vec());
        let ids = named.row_ids(0, list(&sets[0]["telling"]));
        assert_eq!(ids, [Some(&"trial-5-hold".to_string()), Some(&"trial-7-hold".into()), None]);
        let pair = json!({ "verdict": "b_better", "first_only_a": [9], "first_only_b": [5, 6] });
        let found = named.of_pair(&pair, (0, 1));
        assert_eq!(found["only"][0][0], json!({ "trial": 9, "link": "#trial-9-~1", "command": "push 9 'a b'" }));
        assert_eq!(found["only"][1][1], json!({ "trial": 6, "link": null, "command": "push 6 hold" }));
        assert_eq!(found["example"]["link"], "#trial-5-hold");
    }
}
