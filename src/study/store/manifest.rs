//! The manifest of a result folder, `parts/campaign.json`. It states to which campaign the parts belong, and with which
//! inputs and versions they were made.
//!
//! The manifest is checked whenever a folder is opened. Its values are checked as if a user had typed them, and the
//! configuration hash is computed again from campaign and inputs. A seal over the whole file shows accidents: a failing
//! disk, or an edit that leaves the seal as it was. The seal is no signature: whoever forges a result can compute every
//! hash anew. The drawn quantities of a row are therefore compared with what the campaign draws
//! ([`part`](super::part)), and only a simulation tells whether an outcome is true.

use crate::ask::bounds::shown;
use crate::ask::entrant::Entrant;
use crate::ask::gate::GateSpec;
use crate::ask::spec::Campaign;
use crate::store::robot_values::RobotValues;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use standfast_controllers::variant::ControllerName;
use standfast_core::error::{Error, Result};
use standfast_files::assets;
use standfast_files::{json_pretty, sha256_hex, write_atomic};
use standfast_stats::sequential::LOOK_TRIALS;
use std::collections::BTreeMap;
use std::num::NonZeroU64;
use std::path::Path;

/// Path of the manifest in a result folder.
pub const MANIFEST: &str = "parts/campaign.json";
/// Largest size of a manifest that is read (bytes). A manifest lists names and numbers, so it is small.
const MOST_BYTES: u64 = 20_000_000;

/// The campaign to which the parts in a result folder belong.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the program that wrote the manifest.
    pub standfast: String,
    /// SHA-256 of all that the trials depend on: versions of program and engine, campaign, inputs.
    pub config_hash: String,
    /// SHA-256 of URDF, settings and meshes. It tells results of different robots apart.
    pub robot_sha256: String,
    /// Name and version of the physics engine of each entrant, in the order of `controllers`.
    pub engines: Vec<String>,
    /// Number of trials in a block. A folder keeps the number with which it was begun. The result does not depend on
    /// this number.
    pub part_trials: NonZeroU64,
    /// Names of the entrants, in the order of the campaign.
    pub controllers: Vec<String>,
    /// Names of the totals that controllers report for a whole episode, each a column of `trials.parquet`.
    pub totals: Vec<String>,
    /// The files of robot and controllers, in the order in which they are hashed.
    pub inputs: Vec<Input>,
    /// Files and programs on which controllers depend and of which the folder has no copy, by the names of the
    /// controllers.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub not_kept: BTreeMap<String, Vec<String>>,
    /// The controllers that were trained on other motors than the robot has, each with the difference.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub trained_otherwise: BTreeMap<String, String>,
    /// The robot by its values, in a packed result alone, which has no file of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotValues>,
    /// The resolved campaign, which is also in `campaign.toml`.
    pub campaign: Campaign,
}

/// Each name once, in the order of their first appearance.
pub fn each_once(names: impl IntoIterator<Item = String>) -> Vec<String> {
    let mut once: Vec<String> = Vec::new();
    for name in names {
        if !once.contains(&name) {
            once.push(name);
        }
    }
    once
}

/// A file that a campaign reads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Name of the file in the result folder, or `builtin:NAME`.
    pub file: String,
    pub sha256: String,
}

impl Manifest {
    /// The engines of all entrants, each once.
    pub fn engine(&self) -> String {
        each_once(self.engines.iter().cloned()).join(", ")
    }

    /// A sentence for each controller that depends on something of which the folder has no copy, and for each that was
    /// trained on other motors.
    pub fn warnings(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        for (name, difference) in &self.trained_otherwise {
            sentences.push(format!(
                "{name} was trained on other motors: {difference}. All controllers have the motors of the robot, or those of \
                 --motors."
            ));
        }
        for (name, files) in &self.not_kept {
            let listed = files.join(", ");
            sentences.push(format!(
                "{name} depends on files that are not kept: {listed}. No hash shows whether they change, and a replay elsewhere \
                 lacks them."
            ));
        }
        sentences
    }

    /// The value that `config_hash` must have: the SHA-256 of the versions, the campaign without the settings on which
    /// no trial depends, and the hashes of the inputs. The length of each item is hashed before the item.
    pub fn hash(&self) -> Result<String> {
        let versions = format!("{} {}", self.standfast, self.engine());
        let campaign = what_trials_are(&self.campaign).to_toml()?;
        let inputs = self.inputs.iter().map(|input| input.sha256.as_str());
        let mut bytes = Vec::new();
        for text in [versions.as_str(), &campaign].into_iter().chain(inputs) {
            bytes.extend((text.len() as u64).to_le_bytes());
            bytes.extend(text.as_bytes());
        }
        Ok(sha256_hex(&bytes))
    }

    /// Why the trials of `here` are not the trials of this manifest: versions, keys of the campaign with both values,
    /// and inputs that differ.
    pub fn differences(&self, here: &Manifest) -> Vec<String> {
        let mut differing = Vec::new();
        let [there, now] = [self, here].map(|manifest| {
            let campaign = what_trials_are(&manifest.campaign);
            json!({ "standfast": manifest.standfast, "engine": manifest.engine(), "": campaign })
        });
        for key in ["standfast", "engine", ""] {
            differences(key, &now[key], &there[key], &mut differing);
        }
        let both = self.inputs.iter().zip(&here.inputs);
        let changed =
            both.filter(|(there, here)| there.file == here.file && there.sha256 != here.sha256);
        differing.extend(each_once(
            changed.map(|(_, here)| format!("{} has changed", here.file)),
        ));
        differing
    }

    /// Reads the manifest of a folder. It fails if the file cannot be read, has values that no campaign can have, or
    /// was changed. It also fails if an input in the folder was changed.
    pub fn read(folder: &Path) -> Result<Manifest> {
        let path = folder.join(MANIFEST);
        let problem = |problem: String| Error::Parts {
            path: path.clone(),
            problem,
        };
        let text = assets::read(&path, MOST_BYTES)?;
        const ADVICE: &str =
            "Restore it, or remove it: the command that began the campaign writes it again";
        let damaged = |e: serde_json::Error| problem(format!("it is damaged ({e}). {ADVICE}"));
        let mut value: serde_json::Value = serde_json::from_slice(&text).map_err(damaged)?;
        let seal = value
            .as_object_mut()
            .and_then(|fields| fields.shift_remove("seal"));
        let is_sealed = seal.is_some_and(|seal| seal == sha256_hex(value.to_string().as_bytes()));
        let manifest: Manifest = serde_json::from_value(value).map_err(|e| match is_sealed {
            true => problem(format!(
                "it was written by another version of standfast, whose results this one does not read ({e})"
            )),
            false => damaged(e),
        })?;
        manifest.check(&path.display().to_string())?;
        if !is_sealed || manifest.hash()? != manifest.config_hash {
            let changed = "it is not as standfast wrote it: its hash does not match what it says";
            return Err(problem(format!("{changed}. {ADVICE}")));
        }
        manifest.check_inputs(folder)?;
        Ok(manifest)
    }

    /// The configuration hash in the manifest of a folder, without any check. It is None if the manifest cannot be
    /// read.
    pub fn stated_hash(folder: &Path) -> Option<String> {
        let value: serde_json::Value =
            serde_json::from_slice(&assets::read(&folder.join(MANIFEST), MOST_BYTES).ok()?).ok()?;
        value["config_hash"].as_str().map(String::from)
    }

    /// Writes the manifest to a folder, with its seal.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let mut value = serde_json::to_value(self).map_err(|e| Error::Syntax {
            file: MANIFEST.into(),
            message: e.to_string(),
        })?;
        value["seal"] = sha256_hex(value.to_string().as_bytes()).into();
        write_atomic(&folder.join(MANIFEST), json_pretty(&value)?.as_bytes())
    }

    /// Checks the values of the manifest as if a user had typed them. Errors name `file`.
    pub fn check(&self, file: &str) -> Result<()> {
        self.campaign.check(file)?;
        let (controllers, asked) = (&self.controllers, &self.campaign.controllers);
        if [controllers.len(), self.engines.len()] != [asked.len(); 2]
            || (0..controllers.len()).any(|i| controllers[..i].contains(&controllers[i]))
        {
            return Err(Error::value(
                file,
                "controllers",
                controllers.join(", "),
                "not one for each controller",
                format!("{} different names", asked.len()),
            ));
        }
        let part_trials = self.part_trials.get();
        let is_between_looks =
            !self.campaign.stopping.until_resolved || LOOK_TRIALS.is_multiple_of(part_trials);
        if part_trials > self.campaign.trials.max(MOST_PART_TRIALS) || !is_between_looks {
            let accepted = "5 to 500; up to 25 in a campaign that ends when decided";
            return Err(Error::value(
                file,
                "part_trials",
                part_trials,
                "no size of a part",
                accepted,
            ));
        }
        Ok(())
    }

    /// Fails if an input that lies in the folder has changed. A missing one is noticed when it is needed.
    fn check_inputs(&self, folder: &Path) -> Result<()> {
        for input in self
            .inputs
            .iter()
            .filter(|input| !input.file.starts_with("builtin:"))
        {
            let path = folder.join(&input.file);
            if path.exists() && sha256_hex(&assets::read(&path, MOST_BYTES)?) != input.sha256 {
                let problem =
                    "it is not the file with which the trials were run; restore it".into();
                return Err(Error::Parts { path, problem });
            }
        }
        Ok(())
    }

    /// The controller of which all other controllers are variants, in the result of a sweep. It is None in any other
    /// result.
    pub fn reference(&self) -> Option<&str> {
        let listed: Vec<ControllerName> = self
            .campaign
            .controllers
            .iter()
            .map(|listed| Entrant::split(listed).controller_name())
            .collect();
        let mut unchanged = (0..listed.len()).filter(|&i| listed[i].change.is_none());
        let (Some(only), None) = (unchanged.next(), unchanged.next()) else {
            return None;
        };
        let is_sweep = listed.len() > 1 && listed.len() == self.controllers.len();
        let all_its = listed
            .iter()
            .all(|variant| variant.base == listed[only].base);
        (is_sweep && all_its).then(|| &self.controllers[only][..])
    }
}

/// Adds the values that differ between `here` and `there`, each with its dotted key. A key that one of them lacks has the
/// value null there.
pub fn differences(key: &str, here: &Value, there: &Value, found: &mut Vec<String>) {
    match (here, there) {
        (Value::Object(a), Value::Object(b))
            if a.keys().all(|key| b.contains_key(key))
                || b.keys().all(|key| a.contains_key(key)) =>
        {
            let most = if a.len() < b.len() { b } else { a };
            for name in most.keys() {
                let key = if key.is_empty() {
                    name.clone()
                } else {
                    format!("{key}.{name}")
                };
                let [of_a, of_b] = [a, b].map(|of| of.get(name).unwrap_or(&Value::Null));
                differences(&key, of_a, of_b, found);
            }
        }
        _ if here == there => {}
        _ => {
            let rounded = [there, here].map(|value| {
                value
                    .as_f64()
                    .filter(|_| value.is_f64())
                    .map_or(value.to_string(), shown)
            });
            let [there, here] = if rounded[0] == rounded[1] {
                [there, here].map(Value::to_string)
            } else {
                rounded
            };
            found.push(format!("{key} is {there} there and {here} here"));
        }
    }
}

/// Most trials in a part.
pub(super) const MOST_PART_TRIALS: u64 = 500;

/// Number of trials in a block, which is stored as one part. The last block may have fewer. An interruption loses the
/// unfinished blocks, so small ones have 5 trials: with four controllers these are 20 episodes. In large campaigns
/// blocks are larger, so that there are about 2000 of them, because a shared folder often limits the number of files.
/// In a campaign that ends when decided, the number of trials between two looks is a multiple of the number of trials
/// in a block.
pub fn part_trials(campaign: &Campaign) -> NonZeroU64 {
    const LEAST: u64 = 5;
    const PARTS: u64 = 2000;
    let trials = campaign
        .trials
        .div_ceil(PARTS)
        .next_multiple_of(LEAST)
        .min(MOST_PART_TRIALS);
    let between_looks = if trials > LEAST { LOOK_TRIALS } else { LEAST };
    NonZeroU64::new(if campaign.stopping.until_resolved {
        between_looks
    } else {
        trials
    })
    .unwrap_or(NonZeroU64::MIN)
}

/// The campaign without the settings on which no trial depends. The number of trials is left out if the campaign ends
/// when decided: it may be continued with more trials, because its intervals hold at every look. A campaign with a
/// fixed number of trials may not be continued, because to add trials after having seen the result would be a second
/// look.
fn what_trials_are(campaign: &Campaign) -> Campaign {
    let mut trials = Campaign {
        gates: GateSpec::default(),
        ..campaign.clone()
    };
    trials.stopping.margin = 0.0;
    if campaign.stopping.until_resolved {
        trials.trials = 0;
    }
    trials
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::campaign;
    use crate::store::folder::tests::folder;
    use serde_json::Value;

    #[test]
    fn a_manifest_that_was_changed_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = folder(dir.path()).manifest;
        manifest.write(dir.path()).unwrap();
        assert_eq!(Manifest::read(dir.path()).unwrap(), manifest);
        let path = dir.path().join(MANIFEST);
        let written: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let foreign = "not as standfast wrote it";
        for (pointer, value, is_sealed_again, expected) in [
            ("/campaign/seed", 5.into(), false, foreign),
            ("/robot_sha256", "x".into(), false, foreign),
            // A seal can be made again, but the hash is also in every part.
            ("/campaign/seed", 5.into(), true, foreign),
            ("/campaign/trials", 1e18.into(), true, "1e+18"),
            ("/campaign/trials", 10_000_001u64.into(), true, "1 to 1e7"),
            (
                "/controllers",
                Value::Array(Vec::new()),
                true,
                "2 different names",
            ),
            ("/controllers/1", "hold".into(), true, "2 different names"),
            ("/part_trials", 501.into(), true, "5 to 500"),
            ("/part_trials", 0.into(), true, "nonzero"),
            (
                "/campaign/episode/physics_step_s",
                serde_json::json!({ "rapier": 0.002 }),
                true,
                "another version of standfast",
            ),
            ("/part_trials", Value::Null, false, "damaged"),
        ] {
            let mut changed = written.clone();
            *changed.pointer_mut(pointer).unwrap() = value;
            if is_sealed_again {
                changed.as_object_mut().unwrap().shift_remove("seal");
                changed["seal"] = sha256_hex(changed.to_string().as_bytes()).into();
            }
            std::fs::write(&path, changed.to_string()).unwrap();
            let message = Manifest::read(dir.path()).unwrap_err().to_string();
            assert!(
                message.contains(expected) && message.contains(MANIFEST),
                "{pointer}: {message}"
            );
        }
    }

    #[test]
    fn an_input_that_was_changed_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let (mut manifest, file) = (folder(dir.path()).manifest, "inputs/controllers/mine.toml");
        manifest.inputs = vec![Input {
            file: file.into(),
            sha256: sha256_hex(b"name = 'mine'"),
        }];
        manifest.config_hash = manifest.hash().unwrap();
        manifest.write(dir.path()).unwrap();
        assert!(Manifest::read(dir.path()).is_ok(), "it is not needed yet");
        write_atomic(&dir.path().join(file), b"name = 'mine'").unwrap();
        assert!(Manifest::read(dir.path()).is_ok());
        write_atomic(&dir.path().join(file), b"name = 'more'").unwrap();
        let message = Manifest::read(dir.path()).unwrap_err().to_string();
        assert!(
            message.contains(file) && message.contains("restore it"),
            "{message}"
        );
    }

    #[test]
    fn only_a_sweep_of_one_controller_has_a_reference() {
        let of = |listed: &[&str], controllers: usize| {
            let mut manifest = folder(Path::new("")).manifest;
            manifest.campaign.controllers = listed.iter().map(|name| name.to_string()).collect();
            manifest.controllers = (0..controllers).map(|i| format!("set {i}")).collect();
            manifest.reference().map(String::from)
        };
        assert_eq!(
            of(&["paper:zmp_margin=0", "paper", "paper:zmp_margin=1"], 3),
            Some("set 1".into())
        );
        for other in [
            &["paper"][..],
            &["paper", "hold"],
            &["paper:zmp_margin=0", "hold"],
            &["paper:zmp_margin=0"],
        ] {
            assert_eq!(of(other, other.len()), None, "{other:?}");
        }
        assert_eq!(
            of(&["paper", "paper:zmp_margin=0"], 4),
            None,
            "a comparison of two results"
        );
    }

    #[test]
    fn large_campaigns_have_large_parts() {
        for (trials, until_resolved, expected) in [
            (1, false, 5),
            (10_000, false, 5),
            (10_001, false, 10),
            (1_000_000, false, 500),
            (10_000_000, false, 500),
            (1000, true, 5),
            (100_000, true, 25),
        ] {
            let set = [
                format!("trials={trials}"),
                format!("stopping.until_resolved={until_resolved}"),
            ];
            assert_eq!(
                part_trials(&campaign("standard", &set.each_ref().map(|s| &s[..]))).get(),
                expected,
                "{trials}"
            );
        }
    }

    #[test]
    fn the_hash_tells_inputs_apart() {
        let with = |shas: &[&str]| {
            let mut manifest = folder(Path::new("")).manifest;
            manifest.inputs = shas
                .iter()
                .map(|sha| Input {
                    file: String::new(),
                    sha256: sha.to_string(),
                })
                .collect();
            manifest.hash().unwrap()
        };
        assert_ne!(with(&["ab", "c"]), with(&["a", "bc"]));
        assert_ne!(with(&["a", "b"]), with(&["b", "a"]));
    }
}
