//! One row of the result: one trial with one controller.

use crate::ask::spec::Campaign;
#[cfg(doc)]
use crate::ask::standing_bound::StandingBound;
use crate::ask::trial;
use crate::store::fields::{Field, columns, fields};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_files::Hashing;
use standfast_files::columns::ParquetFile;
use standfast_sim::episode::{Counts, EpisodeConfig, Membership, Outcome, Record};
use standfast_sim::{Push, Variation};
use std::io::Write;

/// A row of `trials.parquet`. Its columns are the fields of the structs in it, one after the other, by their names. A
/// field that is added to one of these structs becomes a column.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TrialRow {
    /// Index of the trial, from 0. A trial has the same pushes, robot, ground and noise for every controller.
    pub trial: u64,
    /// Name of the controller.
    pub set: String,
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
        set: &str,
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
            set: set.into(),
            impulse_over_m_omega_d,
            push,
            second,
            variation,
            repeats: None,
            record,
        }
    }

    /// The pushes, in order of time.
    pub fn pushes(&self) -> Vec<Push> {
        let SecondPush {
            second_impulse_n_s,
            second_heading_deg,
            second_start_s,
        } = self.second;
        let mut pushes = vec![self.push];
        if let (Some(impulse_n_s), Some(heading_deg), Some(start_s)) =
            (second_impulse_n_s, second_heading_deg, second_start_s)
        {
            pushes.push(Push {
                impulse_n_s,
                heading_deg,
                start_s,
                ..self.push
            });
        }
        pushes
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
            self.trial, self.set
        )
    }

    /// Checks that an episode with these settings can have this record, whose columns must not contradict each other.
    /// Fails in words.
    pub fn check(&self, episode: &EpisodeConfig) -> Result<(), String> {
        let (r, outcome, judge) = (&self.record, self.record.outcome, &episode.judge);
        let [fell, recovered] = [Outcome::Fell, Outcome::Recovered].map(|other| outcome == other);
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
            _ => true,
        };
        let columns = [
            (
                "outcome",
                outcome.name().into(),
                counts,
                "survived only where the judge counts it, and timed out elsewhere",
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
                "a time up to end_s if it fell, else none",
            ),
            (
                "fall_cause",
                r.fall_cause.clone().unwrap_or("(none)".into()),
                r.fall_cause.is_some() == (fell || broke),
                "a cause if it fell, diverged or failed, else none",
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

    /// Where the true state lay at the end of the last push; None without a promise.
    pub fn set_after_push(&self) -> Option<Membership> {
        self.record.promise_margin.map(Membership::of_margin)
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

/// The rows as CSV, with the names of the columns in the first line and floats with all their digits.
pub fn write_csv(rows: &[TrialRow]) -> csv::Result<Vec<u8>> {
    let mut csv = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    csv.write_record(fields::<TrialRow>().iter().map(|field| field.name))?;
    for row in rows {
        csv.serialize(row)?;
    }
    csv.into_inner().map_err(|e| e.into_error().into())
}

/// The rows of a CSV text. Fails if its columns are not the columns of a row.
pub fn read_csv(text: &[u8]) -> csv::Result<Vec<TrialRow>> {
    let mut csv = csv::Reader::from_reader(text);
    if !csv
        .headers()?
        .iter()
        .eq(fields::<TrialRow>().iter().map(|field| field.name))
    {
        return Err(
            std::io::Error::other("its columns are not those of this build of standfast").into(),
        );
    }
    csv.records()
        .map(|record| record?.deserialize(None))
        .collect()
}

/// Number of rows in a row group of `trials.parquet`; the last group may have fewer. The rows of a group wait in memory
/// (some 13 MB), and are converted to text when the group is written.
const GROUP_ROWS: usize = 16_384;

/// `trials.parquet` while it is written. Rows are written as they come, and hashed.
pub struct TrialsFile<W: Write + Send> {
    file: ParquetFile<Hashing<W>>,
    /// Rows of the next row group.
    waiting: Vec<TrialRow>,
    groups: usize,
    fields: Vec<Field>,
    totals: Vec<String>,
}

impl<W: Write + Send> TrialsFile<W> {
    /// Begins a file with a column for each of `totals`, which are totals of controllers. Fails if nothing can be
    /// written there.
    pub fn new(to: W, totals: &[String]) -> Result<Self> {
        let (fields, totals) = (fields::<TrialRow>(), totals.to_vec());
        let file = ParquetFile::new(Hashing::new(to), columns(&fields, &totals, &[]))
            .map_err(not_written)?;
        Ok(Self {
            file,
            waiting: Vec::new(),
            groups: 0,
            fields,
            totals,
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
        let text = write_csv(&self.waiting).map_err(not_written)?;
        let cells: Vec<_> = csv::Reader::from_reader(&text[..])
            .into_records()
            .collect::<Result<_, _>>()
            .map_err(not_written)?;
        self.file
            .group(columns(&self.fields, &self.totals, &cells))
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
    use standfast_files::columns::{Data, DataColumn};

    use parquet::errors::ParquetError;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;
    use standfast_core::error::TRY_AGAIN;
    use standfast_core::robot::Foot;

    /// The rows as columns, with these totals.
    fn as_columns(rows: &[TrialRow], totals: &[&str]) -> Vec<DataColumn> {
        let text = write_csv(rows).unwrap();
        let totals = totals
            .iter()
            .map(|name| name.to_string())
            .collect::<Vec<_>>();
        let cells: Vec<_> = csv::Reader::from_reader(&text[..])
            .into_records()
            .map(Result::unwrap)
            .collect();
        columns(&fields::<TrialRow>(), &totals, &cells).collect()
    }

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
        let rows = [row(0, "a, \"b\"", 2.0, Outcome::TimedOut), odd];
        let text = write_csv(&rows).unwrap();
        // Compared as text, since NaN is not equal to itself.
        assert_eq!(
            format!("{:?}", read_csv(&text).unwrap()),
            format!("{rows:?}")
        );
    }

    #[test]
    fn rows_with_other_columns_are_not_read() {
        let text =
            String::from_utf8(write_csv(&[row(0, "a", 1.0, Outcome::Fell)]).unwrap()).unwrap();
        let swapped = text.replacen("height_m,duration_s", "duration_s,height_m", 1);
        assert_ne!(text, swapped);
        assert!(
            read_csv(swapped.as_bytes())
                .unwrap_err()
                .to_string()
                .contains("not those of this build")
        );
    }

    #[test]
    fn words_and_totals_are_columns() {
        let found = as_columns(
            &[row(0, "hold", 2.0, Outcome::TimedOut)],
            &["gain_switches", "left_sets_at_s"],
        );
        let column = |name: &str| {
            found
                .iter()
                .find(|column| column.name == name)
                .map(|column| column.data.clone())
        };
        for (name, expected) in [
            ("set", "hold"),
            ("profile", "rectangular"),
            ("outcome", "TimedOut"),
        ] {
            assert_eq!(
                column(name),
                Some(Data::Text(vec![expected.into()])),
                "{name}"
            );
        }
        assert_eq!(
            column("promise_margin"),
            Some(Data::OptF64(vec![Some(-0.25)]))
        );
        assert_eq!(column("gain_switches"), Some(Data::OptF64(vec![Some(3.0)])));
        assert_eq!(column("left_sets_at_s"), Some(Data::OptF64(vec![None])));
        assert_eq!(
            column("unfinished_footstep"),
            Some(Data::OptText(vec![None]))
        );
        assert_eq!(column("totals"), None);
        // A part lists its columns in the order in which it writes their values.
        assert_eq!(column("peak_slip_m"), Some(Data::F64(vec![0.003])));
        assert_eq!(column("footsteps"), Some(Data::I64(vec![0])));
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
