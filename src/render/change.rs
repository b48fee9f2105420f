//! What a command line changes of a campaign: the same options wherever one is run.

use crate::campaign::Overrides;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::value::{Error, StringDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};

/// Reads a value by one of its names, which are those in files, too.
pub fn one_of<T>(names: [&'static str; 2]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| -> Result<T, Error> {
        let name: StringDeserializer<Error> = name.into_deserializer();
        T::deserialize(name)
    })
}

/// Options of `run` and `limit`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ChangeArgs {
    /// Gain set by name or file, instead of those of the campaign; may be given several times
    #[arg(long, value_name = "NAME|FILE")]
    pub gains: Vec<String>,
    /// Variants of a gain set, one for each value of one key (dotted, array elements from 0; values in TOML).
    ///
    /// They replace the campaign's gain sets; with --gains they come after those. May be given several times: each
    /// adds its own variants, they are not combined. A variant is a gain set SET:KEY=VALUE, which --gains and the
    /// `gains` of a campaign file take too.
    #[arg(long, value_name = "SET:KEY=V1,V2,...")]
    pub vary: Vec<String>,
    /// Robot by name or URDF file (settings in a .toml of the same name beside it)
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// Seed of all random numbers
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Change one value of the campaign, e.g. push.height_m=0.05 (value in TOML)
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl ChangeArgs {
    /// The same for [`Campaign::load`](crate::campaign::Campaign::load), with the count of trials if that changes too.
    pub fn overrides(&self, trials: Option<u64>) -> Overrides {
        Overrides {
            set: self.set.clone(),
            trials,
            seed: self.seed,
            gains: self.gains.clone(),
            vary: self.vary.clone(),
            robot: self.robot.clone(),
            ..Overrides::default()
        }
    }
}
