//! The kinds of controllers, and the one place where the file of a controller is read.

use super::posture::Posture;
use super::settings::Settings;
use crate::assets::{Source, parse_toml};
use crate::error::{Error, Result};
use crate::lipm::GainSet;
use serde::de::DeserializeOwned;
use toml::Table;

/// The kinds of controllers, the first of which is that of a file without a kind.
const KINDS: [KindOf; 2] = [kind::<GainSet>("cpi"), kind::<Posture>("posture")];

/// A kind of controllers.
pub(super) struct KindOf {
    /// The word in a file.
    name: &'static str,
    /// Reads a file. It checks no values.
    parse: fn(&Source) -> Result<Box<dyn Settings>>,
    /// Reads what a file states. It checks no values.
    pub of_tree: fn(Table) -> Result<Box<dyn Settings>, toml::de::Error>,
}

/// A kind whose files state an `S`.
const fn kind<S: Settings + DeserializeOwned + 'static>(name: &'static str) -> KindOf {
    KindOf {
        name,
        parse: |source| Ok(Box::new(parse_toml::<S>(source)?)),
        of_tree: |tree| Ok(Box::new(tree.try_into::<S>()?)),
    }
}

/// Reads the file of a controller of any kind.
pub fn read(source: &Source) -> Result<Box<dyn Settings>> {
    let settings = (kind_of(&parse_toml(source)?, &source.file)?.parse)(source)?;
    settings.check(&source.file)?;
    Ok(settings)
}

/// The kind that a file states.
pub(super) fn kind_of(tree: &Table, file: &str) -> Result<&'static KindOf> {
    let Some(stated) = tree.get("kind") else { return Ok(&KINDS[0]) };
    KINDS.iter().find(|kind| stated.as_str() == Some(kind.name)).ok_or_else(|| {
        let known: Vec<String> = KINDS.iter().map(|kind| format!("{:?}", kind.name)).collect();
        let accepted = format!("{}; without a kind, the file is a gain set", known.join(", "));
        Error::value(file, "kind", stated, "is no kind of controller", accepted)
    })
}
