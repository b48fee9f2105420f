//! One row of the result: one trial with one controller.

use crate::ask::spec::Campaign;
#[cfg(doc)]
use crate::ask::standing_bound::StandingBound;
use crate::ask::trial;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_files::Hashing;
use standfast_files::columns::{ABOUT, Data, DataColumn, ParquetFile, about};
use standfast_sim::episode::{Counts, EpisodeConfig, FootstepLog, Outcome, Record};
use standfast_sim::{Push, Variation};
use std::io::Write;

/// A row of `trials.parquet`, whose columns are listed by `cells`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrialRow {
    /// Index of the trial, from 0. A trial has the same pushes, robot, ground and noise for every controller.
    pub trial: u64,
    /// Name of the controller.
    pub controller: String,
    /// Impulse of the first push divided by m omega d ([`StandingBound`]); None if the COM at home is not above the support.
    pub impulse_over_m_omega_d: Option<f64>,
    /// The first push.
    pub push: Push,
    pub second: SecondPush,
    /// The variation of robot and ground.
    pub variation: Variation,
    /// Whether a second run of the trial had the same record; None if there was no second run.
    pub repeats: Option<Repeats>,
    pub record: Record,
}

/// Whether a second run of a trial had the same record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Repeats {
    Yes,
    No,
}

/// The fields of a second push; all others are as in the first one. All are None if there is no second push.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SecondPush {
    pub second_impulse_n_s: Option<f64>,
    pub second_heading_deg: Option<f64>,
    pub second_start_s: Option<f64>,
}

impl TrialRow {
    /// `pushes` are the first and, if there is one, the second. `no_step_n_s` is m omega d for the first push
    /// ([`StandingBound`]).
    pub fn new(
        trial: u64,
        controller: &str,
        pushes: &[Push],
        no_step_n_s: Option<f64>,
        variation: Variation,
        record: Record,
    ) -> Self {
        let (push, second) = (pushes[0], pushes.get(1));
        let second = SecondPush {
            second_impulse_n_s: second.map(|push| push.impulse_n_s),
            second_heading_deg: second.map(|push| push.heading_deg),
            second_start_s: second.map(|push| push.start_s),
        };
        let impulse_over_m_omega_d = no_step_n_s.map(|bound_n_s| push.impulse_n_s / bound_n_s);
        Self {
            trial,
            controller: controller.into(),
            impulse_over_m_omega_d,
            push,
            second,
            variation,
            repeats: None,
            record,
        }
    }

    /// A row of this trial before it was run: with all drawn quantities, and without a controller.
    pub fn drawn(campaign: &Campaign, trial: u64) -> Self {
        let pushes = trial::pushes(campaign, trial);
        let variation = trial::variation(campaign, trial);
        Self::new(trial, "", &pushes, None, variation, Record::default())
    }

    /// The columns with drawn numbers.
    fn drawn_columns(&self) -> Vec<(&'static str, Option<f64>)> {
        let Push {
            impulse_n_s,
            heading_deg,
            height_m,
            duration_s,
            start_s,
            profile: _,
            bob: _,
        } = self.push;
        let SecondPush {
            second_impulse_n_s,
            second_heading_deg,
            second_start_s,
        } = self.second;
        let mut columns = vec![
            ("impulse_n_s", Some(impulse_n_s)),
            ("heading_deg", Some(heading_deg)),
            ("height_m", Some(height_m)),
            ("duration_s", Some(duration_s)),
            ("start_s", Some(start_s)),
            ("second_impulse_n_s", second_impulse_n_s),
            ("second_heading_deg", second_heading_deg),
            ("second_start_s", second_start_s),
        ];
        columns.extend(self.variation.list());
        columns
    }

    /// Fails, in words, if a column differs by a bit from what `seed` [draws](Self::drawn) for this trial.
    pub fn check_drawn(&self, drawn: &Self, seed: u64) -> Result<(), String> {
        let shown = |value: Option<f64>| value.map_or("(none)".into(), |value| value.to_string());
        let refuse = |name: &str, value: &str, accepted: &str| {
            let problem = format!("is not what seed {seed} draws for this trial");
            Err(self.refused(name, value, &problem, accepted))
        };
        for ((name, value), (_, drawn)) in
            self.drawn_columns().into_iter().zip(drawn.drawn_columns())
        {
            if value.map(f64::to_bits) != drawn.map(f64::to_bits) {
                return refuse(name, &shown(value), &shown(drawn));
            }
        }
        let [profile, drawn] = [self, drawn].map(|row| row.push.profile);
        if profile != drawn {
            return refuse("profile", profile.name(), drawn.name());
        }
        Ok(())
    }

    /// In words, why a column cannot have a value.
    fn refused(&self, column: &str, value: &str, problem: &str, accepted: &str) -> String {
        format!(
            "trial {} of {}: {column} = {value}: {problem}; accepted: {accepted}",
            self.trial, self.controller
        )
    }

    /// Checks that an episode with these settings can have this record, whose columns must not contradict each other.
    /// Fails in words.
    pub fn check(&self, episode: &EpisodeConfig) -> Result<(), String> {
        let (r, outcome, judge) = (&self.record, self.record.outcome, &episode.judge);
        let (fell, recovered) = (outcome.is_lost(), outcome == Outcome::Recovered);
        let broke = matches!(outcome, Outcome::Diverged | Outcome::Failed);
        // A fall may tilt the trunk by any angle.
        let (tilt_deg, least_height) = if fell || broke {
            (180.0, f64::MIN)
        } else {
            (judge.fallen_tilt_deg, judge.fallen_com_height_ratio)
        };
        let from_s = self.pushed_until_s() - 1e-9;
        let up_to_end = |from_s: f64, at_s: Option<f64>| {
            at_s.is_none_or(|at_s| (from_s..=r.end_s).contains(&at_s))
        };
        let none_or =
            |at_s: Option<f64>| at_s.map_or("(none)".to_string(), |at_s| at_s.to_string());
        let among = |value: f64, most: f64| (0.0..=most).contains(&value);
        let positive = |name, value: f64| {
            (
                name,
                value.to_string(),
                among(value, f64::INFINITY),
                "0 or more",
            )
        };
        let height = r.lowest_com_height_ratio;
        let counts = match outcome {
            Outcome::Survived => judge.counts == Counts::Survived,
            Outcome::TimedOut => judge.counts == Counts::Recovered,
            Outcome::Broke => judge.max_sole_force_weights.is_some(),
            _ => true,
        };
        let columns = [
            (
                "outcome",
                outcome.name().into(),
                counts,
                "survived only where the judge counts it, timed out elsewhere, and broke with a limit alone",
            ),
            (
                "end_s",
                r.end_s.to_string(),
                among(r.end_s, episode.horizon_s + episode.control_period_s),
                "up to the horizon",
            ),
            (
                "fell_at_s",
                none_or(r.fell_at_s),
                r.fell_at_s.is_some() == fell && up_to_end(0.0, r.fell_at_s),
                "a time up to end_s if it fell or broke, else none",
            ),
            (
                "fall_cause",
                r.fall_cause.clone().unwrap_or("(none)".into()),
                r.fall_cause.is_some() == (fell || broke),
                "a cause if it fell, broke, diverged or failed, else none",
            ),
            (
                "settled_at_s",
                none_or(r.settled_at_s),
                r.settled_at_s.is_some() == recovered && up_to_end(from_s, r.settled_at_s),
                "a time from the end of the push to end_s if it recovered, else none",
            ),
            (
                "home_at_s",
                none_or(r.home_at_s),
                !(r.home_at_s.is_some() && (fell || broke)) && up_to_end(from_s, r.home_at_s),
                "none, or a time from the end of the push to end_s if it did not fall",
            ),
            (
                "peak_tilt_deg",
                r.peak_tilt_deg.to_string(),
                among(r.peak_tilt_deg, tilt_deg),
                "that of the outcome",
            ),
            (
                "lowest_com_height_ratio",
                none_or(height),
                height.is_none_or(|height| height >= least_height),
                "that of the outcome",
            ),
            positive("peak_torque_n_m", r.peak_torque_n_m),
            positive("peak_torque_ratio", r.peak_torque_ratio),
            positive("torque_limited_s", r.torque_limited_s),
            positive("peak_joint_speed_rad_s", r.peak_joint_speed_rad_s),
            positive("peak_sole_force_n", r.peak_sole_force_n.unwrap_or(0.0)),
            positive(
                "peak_gear_torque_ratio",
                r.peak_gear_torque_ratio.unwrap_or(0.0),
            ),
            positive("peak_dcm_outside_m", r.peak_dcm_outside_m),
            positive("peak_slip_m", r.peak_slip_m),
        ];
        let Some((name, value, _, accepted)) =
            columns.into_iter().find(|(_, _, can_be, _)| !can_be)
        else {
            return Ok(());
        };
        Err(self.refused(
            name,
            &value,
            &format!("cannot be in an episode that {}", outcome.name()),
            accepted,
        ))
    }

    pub fn has_recovered(&self) -> bool {
        self.record.outcome.is_success()
    }

    /// Time from the end of the last push until the robot stands (s); None unless it recovered.
    pub fn settling_s(&self) -> Option<f64> {
        self.after_last_push_s(self.record.settled_at_s)
    }

    /// Time from the end of the last push until the COM is home to stay (s); None unless the robot recovered.
    pub fn homing_s(&self) -> Option<f64> {
        self.after_last_push_s(self.record.home_at_s)
    }

    fn after_last_push_s(&self, at_s: Option<f64>) -> Option<f64> {
        at_s.filter(|_| self.has_recovered())
            .map(|at_s| (at_s - self.pushed_until_s()).max(0.0))
    }

    fn pushed_until_s(&self) -> f64 {
        self.second.second_start_s.unwrap_or(self.push.start_s) + self.push.duration_s
    }
}

/// The value of a row in a column.
enum Cell<'a> {
    /// The number of a trial.
    Trial(&'a mut u64),
    Count(&'a mut u32),
    Number(&'a mut f64),
    OptNumber(&'a mut Option<f64>),
    /// A text, or a name out of several.
    Word(&'a mut dyn Word),
    OptWord(&'a mut dyn Word),
}

/// What is written as text, of which an option may be missing.
trait Word {
    fn get(&self) -> Option<String>;
    /// Returns whether the value has this text.
    fn set(&mut self, text: Option<&str>) -> bool;
}

impl<T: Serialize + DeserializeOwned> Word for T {
    fn get(&self) -> Option<String> {
        let value = serde_json::to_value(self).ok()?;
        value.as_str().map(String::from)
    }

    fn set(&mut self, text: Option<&str>) -> bool {
        serde_json::from_value(text.into()).is_ok_and(|value| {
            *self = value;
            true
        })
    }
}

impl TrialRow {
    /// The columns in order: a name and a value each. The totals of the controllers follow them.
    fn cells(&mut self) -> Vec<(&'static str, Cell<'_>)> {
        use Cell::*;
        // Without `..`, so that whoever adds a field is asked for its column.
        let Self {
            trial,
            controller,
            impulse_over_m_omega_d,
            push,
            second,
            variation,
            repeats,
            record,
        } = self;
        let Push {
            impulse_n_s,
            heading_deg,
            height_m,
            duration_s,
            start_s,
            profile,
            // The same in all trials; the campaign states it.
            bob: _,
        } = push;
        let mut cells = vec![
            ("trial", Trial(trial)),
            ("controller", Word(controller)),
            ("impulse_over_m_omega_d", OptNumber(impulse_over_m_omega_d)),
            ("impulse_n_s", Number(impulse_n_s)),
            ("heading_deg", Number(heading_deg)),
            ("height_m", Number(height_m)),
            ("duration_s", Number(duration_s)),
            ("start_s", Number(start_s)),
            ("profile", Word(profile)),
            (
                "second_impulse_n_s",
                OptNumber(&mut second.second_impulse_n_s),
            ),
            (
                "second_heading_deg",
                OptNumber(&mut second.second_heading_deg),
            ),
            ("second_start_s", OptNumber(&mut second.second_start_s)),
        ];
        for (name, value) in variation.each_mut().list() {
            cells.push((name, OptNumber(value)));
        }
        cells.push(("repeats", OptWord(repeats)));
        let Record {
            outcome,
            end_s,
            fell_at_s,
            fall_cause,
            settled_at_s,
            home_at_s,
            com_speed_at_push_m_s,
            peak_tilt_deg,
            lowest_com_height_ratio,
            peak_torque_n_m,
            peak_torque_ratio,
            torque_limited_s,
            peak_joint_speed_rad_s,
            peak_sole_force_n,
            peak_gear_torque_ratio,
            peak_dcm_outside_m,
            peak_slip_m,
            legs_met_at_s,
            legs_met,
            promise_margin,
            promise_margin_est,
            footsteps,
            totals: _,
        } = record;
        let FootstepLog {
            count,
            unfinished_footstep,
            taken: _,
            lifted: _,
        } = footsteps;
        cells.extend([
            ("outcome", Word(outcome)),
            ("end_s", Number(end_s)),
            ("fell_at_s", OptNumber(fell_at_s)),
            ("fall_cause", OptWord(fall_cause)),
            ("settled_at_s", OptNumber(settled_at_s)),
            ("home_at_s", OptNumber(home_at_s)),
            ("com_speed_at_push_m_s", OptNumber(com_speed_at_push_m_s)),
            ("peak_tilt_deg", Number(peak_tilt_deg)),
            (
                "lowest_com_height_ratio",
                OptNumber(lowest_com_height_ratio),
            ),
            ("peak_torque_n_m", Number(peak_torque_n_m)),
            ("peak_torque_ratio", Number(peak_torque_ratio)),
            ("torque_limited_s", Number(torque_limited_s)),
            ("peak_joint_speed_rad_s", Number(peak_joint_speed_rad_s)),
            ("peak_sole_force_n", OptNumber(peak_sole_force_n)),
            ("peak_gear_torque_ratio", OptNumber(peak_gear_torque_ratio)),
            ("peak_dcm_outside_m", Number(peak_dcm_outside_m)),
            ("peak_slip_m", Number(peak_slip_m)),
            ("legs_met_at_s", OptNumber(legs_met_at_s)),
            ("legs_met", OptWord(legs_met)),
            ("promise_margin", OptNumber(promise_margin)),
            ("promise_margin_est", OptNumber(promise_margin_est)),
            ("footsteps", Count(count)),
            ("unfinished_footstep", OptWord(unfinished_footstep)),
        ]);
        cells
    }
}

impl Cell<'_> {
    /// A column of this kind without values.
    fn column(&self, name: &str) -> DataColumn {
        let data = match self {
            Cell::Trial(_) | Cell::Count(_) => Data::Whole(Vec::new()),
            Cell::Number(_) | Cell::OptNumber(_) => Data::Number(Vec::new()),
            Cell::Word(_) | Cell::OptWord(_) => Data::Text(Vec::new()),
        };
        let may_miss = matches!(self, Cell::OptNumber(_) | Cell::OptWord(_));
        DataColumn::new(name, data, may_miss)
    }

    /// Adds the value to its column.
    fn push_to(self, data: &mut Data) {
        match (self, data) {
            (Cell::Trial(value), Data::Whole(values)) => values.push(Some(*value as i64)),
            (Cell::Count(value), Data::Whole(values)) => values.push(Some((*value).into())),
            (Cell::Number(value), Data::Number(values)) => values.push(Some(*value)),
            (Cell::OptNumber(value), Data::Number(values)) => values.push(*value),
            (Cell::Word(value) | Cell::OptWord(value), Data::Text(values)) => {
                values.push(value.get())
            }
            _ => unreachable!("the column was made for such cells"),
        }
    }

    /// Takes the value from row `i` of its column. Returns whether it can have that value.
    fn take(self, data: &Data, i: usize) -> bool {
        fn put<T>(to: &mut T, value: Option<T>) -> bool {
            value.map(|value| *to = value).is_some()
        }
        match (self, data) {
            (Cell::Trial(to), Data::Whole(of)) => put(to, of[i].and_then(|n| n.try_into().ok())),
            (Cell::Count(to), Data::Whole(of)) => put(to, of[i].and_then(|n| n.try_into().ok())),
            (Cell::Number(to), Data::Number(of)) => put(to, of[i]),
            (Cell::OptNumber(to), Data::Number(of)) => put(to, Some(of[i])),
            (Cell::Word(to) | Cell::OptWord(to), Data::Text(of)) => to.set(of[i].as_deref()),
            _ => false,
        }
    }
}

/// The rows as columns, with a column for each of `totals`, which are totals of controllers.
pub fn columns(rows: &[TrialRow], totals: &[String]) -> Vec<DataColumn> {
    let mut columns = Vec::new();
    for (name, cell) in TrialRow::default().cells() {
        columns.push(cell.column(name));
    }
    for row in rows {
        for (column, (_, cell)) in columns.iter_mut().zip(row.clone().cells()) {
            cell.push_to(&mut column.data);
        }
    }
    for name in totals {
        let values = rows.iter().map(|row| row.record.totals.get(name)).collect();
        columns.push(DataColumn::new(name, Data::Number(values), true));
    }
    columns
}

/// Columns that the results of earlier versions lack.
const ADDED: [&str; 2] = ["peak_sole_force_n", "peak_gear_torque_ratio"];

/// The rows of a table with this number of rows. Fails, in words, if its columns are not those of rows with these totals.
pub fn rows(
    (mut columns, count): (Vec<DataColumn>, usize),
    totals: &[String],
) -> Result<Vec<TrialRow>, String> {
    let names = self::columns(&[], totals);
    for (i, DataColumn { name, .. }) in names.iter().enumerate() {
        if ADDED.contains(&&**name) && columns.get(i).is_some_and(|found| found.name != *name) {
            let none = Data::Number(vec![None; count]);
            columns.insert(i, DataColumn::new(name, none, true));
        }
    }
    if !names
        .iter()
        .map(|column| &column.name)
        .eq(columns.iter().map(|column| &column.name))
    {
        return Err("its columns are not those of this build of standfast".into());
    }
    let mut rows = vec![TrialRow::default(); count];
    for (i, row) in rows.iter_mut().enumerate() {
        for (column, (name, cell)) in columns.iter().zip(row.cells()) {
            if !cell.take(&column.data, i) {
                return Err(format!("its column {name} has a value that no trial has"));
            }
        }
        for DataColumn { name, data, .. } in &columns[columns.len() - totals.len()..] {
            let Data::Number(values) = data else {
                return Err(format!("its column {name} does not hold numbers"));
            };
            if let Some(value) = values[i] {
                row.record.totals.0.insert(name.clone(), value);
            }
        }
    }
    Ok(rows)
}

/// Number of rows in a row group of `trials.parquet`; the last group may have fewer. The rows of a group wait in memory
/// (some 13 MB).
const GROUP_ROWS: usize = 16_384;

/// `trials.parquet` while it is written. Rows are written as they come, and hashed.
pub struct TrialsFile<W: Write + Send> {
    file: ParquetFile<Hashing<W>>,
    /// Rows of the next row group.
    waiting: Vec<TrialRow>,
    groups: usize,
    totals: Vec<String>,
}

impl<W: Write + Send> TrialsFile<W> {
    /// Begins a file with a column for each of `totals`, which are totals of controllers. Fails if nothing can be
    /// written there.
    pub fn new(to: W, totals: &[String]) -> Result<Self> {
        let columns = columns(&[], totals);
        let mut file = ParquetFile::new(Hashing::new(to), &columns).map_err(not_written)?;
        file.state(ABOUT, about(&columns));
        Ok(Self {
            file,
            waiting: Vec::new(),
            groups: 0,
            totals: totals.to_vec(),
        })
    }

    /// Adds the next rows.
    pub fn push(&mut self, rows: impl IntoIterator<Item = TrialRow>) -> Result<()> {
        for row in rows {
            self.waiting.push(row);
            if self.waiting.len() == GROUP_ROWS {
                self.write_group()?;
            }
        }
        Ok(())
    }

    /// Ends the file. Returns the writer and the SHA-256 of the file.
    pub fn finish(mut self) -> Result<(W, String)> {
        // A file without rows has a group without rows.
        if !self.waiting.is_empty() || self.groups == 0 {
            self.write_group()?;
        }
        Ok(self.file.finish().map_err(not_written)?.finish())
    }

    fn write_group(&mut self) -> Result<()> {
        self.file
            .group(&columns(&self.waiting, &self.totals))
            .map_err(not_written)?;
        self.waiting.clear();
        self.groups += 1;
        Ok(())
    }
}

fn not_written(source: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::Write {
        path: "trials.parquet".into(),
        source: std::io::Error::other(source),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fixtures::row;
    use parquet::errors::ParquetError;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;
    use standfast_core::error::TRY_AGAIN;
    use standfast_core::robot::Foot;

    #[test]
    fn a_row_reads_back_to_the_bit() {
        let mut odd = row(1, "hold", 1.0 / 3.0, Outcome::Fell);
        odd.variation.friction = Some(0.7);
        odd.second.second_start_s = Some(f64::MIN_POSITIVE);
        odd.record.promise_margin = Some(f64::NEG_INFINITY);
        odd.record.peak_torque_n_m = f64::NAN;
        (
            odd.record.footsteps.count,
            odd.record.footsteps.unfinished_footstep,
        ) = (3, Some(Foot::Left));
        odd.repeats = Some(Repeats::No);
        let written = [row(0, "a, \"b\"", 2.0, Outcome::TimedOut), odd];
        let totals = ["gain_switches".to_string()];
        let read = rows((columns(&written, &totals), 2), &totals).unwrap();
        // Compared as text, since NaN is not equal to itself.
        assert_eq!(format!("{read:?}"), format!("{written:?}"));
    }

    /// Results of earlier versions have no loads.
    #[test]
    fn columns_that_came_later_may_be_missing() {
        let written = [row(0, "a", 1.0, Outcome::Fell)];
        let mut columns = columns(&written, &[]);
        columns.retain(|column| !ADDED.contains(&&*column.name));
        let read = rows((columns, 1), &[]).unwrap();
        let record = &read[0].record;
        assert_eq!(
            (record.peak_sole_force_n, record.peak_slip_m),
            (None, 0.003)
        );
    }

    #[test]
    fn columns_that_are_not_those_of_rows_are_not_read() {
        let whole = columns(&[row(0, "a", 1.0, Outcome::Fell)], &[]);
        type Change = fn(&mut Vec<DataColumn>);
        let changes: [(Change, &str); 4] = [
            (|columns| columns.swap(5, 6), "not those of this build"),
            (
                |columns| columns[0].data = Data::Whole(vec![Some(-1)]),
                "its column trial has a value that no trial has",
            ),
            (
                |columns| columns[8].data = Data::Text(vec![Some("round".into())]),
                "its column profile has",
            ),
            (
                |columns| columns[3].data = Data::Number(vec![None]),
                "its column impulse_n_s has",
            ),
        ];
        for (change, problem) in changes {
            let mut changed = whole.clone();
            change(&mut changed);
            let told = rows((changed, 1), &[]).unwrap_err();
            assert!(told.contains(problem), "{told}");
        }
    }

    #[test]
    fn words_and_totals_are_columns() {
        let totals = ["gain_switches", "left_sets_at_s"].map(String::from);
        let found = columns(&[row(0, "hold", 2.0, Outcome::TimedOut)], &totals);
        let column = |name: &str| {
            found
                .iter()
                .find(|column| column.name == name)
                .map(|column| column.data.clone())
        };
        for (name, expected) in [
            ("controller", "hold"),
            ("profile", "rectangular"),
            ("outcome", "TimedOut"),
        ] {
            assert_eq!(
                column(name),
                Some(Data::Text(vec![Some(expected.into())])),
                "{name}"
            );
        }
        assert_eq!(
            column("promise_margin"),
            Some(Data::Number(vec![Some(-0.25)]))
        );
        assert_eq!(column("gain_switches"), Some(Data::Number(vec![Some(3.0)])));
        assert_eq!(column("left_sets_at_s"), Some(Data::Number(vec![None])));
        assert_eq!(column("unfinished_footstep"), Some(Data::Text(vec![None])));
        // A column has the values of its own field.
        assert_eq!(column("peak_slip_m"), Some(Data::Number(vec![Some(0.003)])));
        assert_eq!(column("footsteps"), Some(Data::Whole(vec![Some(0)])));
    }

    /// Rows may also come a few at a time.
    #[test]
    fn rows_beyond_the_first_row_group_read_back() {
        let rows = |trials: std::ops::Range<u64>| {
            trials.map(|i| row(i, "hold", i as f64 / 7.0, Outcome::Fell))
        };
        let trials = GROUP_ROWS as u64 + 3;
        let mut file = TrialsFile::new(Vec::new(), &[]).unwrap();
        file.push(rows(0..10)).unwrap();
        file.push(rows(10..trials)).unwrap();
        let (bytes, sha256) = file.finish().unwrap();
        assert_eq!(sha256, standfast_files::sha256_hex(&bytes));
        let mut at = tempfile::tempfile().unwrap();
        at.write_all(&bytes).unwrap();
        let reader = SerializedFileReader::new(at).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let mut found = 0;
        for (row, i) in reader
            .get_row_iter(None)
            .unwrap()
            .map(Result::unwrap)
            .zip(0..)
        {
            assert_eq!(
                (row.get_long(0).unwrap(), row.get_double(3).unwrap()),
                (i, i as f64 / 7.0)
            );
            found += 1;
        }
        assert_eq!(found, trials);
    }

    #[test]
    fn a_push_is_measured_by_what_standing_takes() {
        assert_eq!(
            row(0, "hold", 3.0, Outcome::Fell).impulse_over_m_omega_d,
            Some(1.5)
        );
    }

    /// A full disk may have room later, so it has an exit code of its own.
    #[test]
    fn a_full_disk_is_told_by_its_exit_code() {
        let full = |kind| not_written(ParquetError::from(std::io::Error::from(kind))).exit_code();
        assert_eq!(full(std::io::ErrorKind::StorageFull), TRY_AGAIN);
        assert_ne!(full(std::io::ErrorKind::PermissionDenied), TRY_AGAIN);
    }
}
