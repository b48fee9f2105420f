//! Variants of a controller: the same settings with one changed value, to measure the effect of that value (a sweep).
//!
//! A campaign lists its controllers by name or path, and a variant as `NAME:KEY=VALUE`, for example
//! `switching:zmp_margin=0.001` or `my.toml:gains.0.x=[0.2, 1, 5]`. The key is dotted, a number in it is an index
//! into an array (from 0), and the value is TOML (a bare word is a string). A variant can be named wherever a
//! controller can, so result folders, shards and replays treat it as any other controller.

use super::kinds::kind_of;
use super::spec::ControllerSpec;
use standfast_core::error::{Error, Result};
use standfast_files::assets::{self, InputKind, Missing};
use toml::Value;

/// A controller as it is listed: a name or path and, for a variant, the change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ControllerName<'a> {
    /// Name of a built-in controller, or a path.
    pub base: &'a str,
    /// Key and value as they are written.
    pub change: Option<(&'a str, &'a str)>,
}

impl<'a> ControllerName<'a> {
    /// Splits at the first `:` that is followed by `key=` and preceded by a controller: the name of a built-in
    /// controller, a `.toml` file, or any text if no path follows. So neither a drive (`C:\g.toml`) nor a folder like
    /// `a:b=1/g.toml` is a variant.
    pub fn split(text: &'a str) -> Self {
        for (at, _) in text.match_indices(':') {
            let base = &text[..at];
            let Some((key, value)) = text[at + 1..].split_once('=') else {
                break;
            };
            let (key, value) = (key.trim(), value.trim());
            let is_key = !key.is_empty()
                && key
                    .chars()
                    .all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c));
            let is_set = InputKind::Controller.names().contains(&base) || base.ends_with(".toml");
            if is_key && !base.is_empty() && (is_set || !value.contains(['/', '\\'])) {
                return Self {
                    base,
                    change: Some((key, value)),
                };
            }
        }
        Self {
            base: text,
            change: None,
        }
    }

    /// The same change with another path or name of the base, for a list in which the base has moved.
    pub fn with_base(&self, base: &str) -> String {
        match self.change {
            Some((key, value)) => format!("{base}:{key}={value}"),
            None => base.into(),
        }
    }

    /// Applies the change to `base`. The name of the result states the change, as in `switching zmp_margin=0.001`.
    /// Fails if the change does not fit.
    pub fn of(&self, base: Box<dyn ControllerSpec>) -> Result<Box<dyn ControllerSpec>> {
        let Some((key, value)) = self.change else {
            return Ok(base);
        };
        let file = format!("{} (of --vary or --controller)", self.with_base(self.base));
        let refuse =
            |problem: &str, accepted: String| Error::value(&file, key, value, problem, accepted);
        if value.is_empty() || value.contains(char::is_control) {
            return Err(refuse(
                "is not a value on one line",
                "a value in TOML".into(),
            ));
        }
        let mut tree = Value::Table(base.tree());
        let missing =
            |Missing { name, accepted }| refuse(&format!("the set has no `{name}`"), accepted);
        let (folder, last) = key.rsplit_once('.').unwrap_or(("", key));
        let before = match assets::place(&mut tree, folder).map_err(missing)? {
            // A missing name may be a key that has no value yet. Whether the key is known is checked when the
            // controller is read.
            Value::Table(table) => table.insert(last.into(), assets::toml_value(value)),
            _ => {
                let place = assets::place(&mut tree, key).map_err(missing)?;
                Some(std::mem::replace(place, assets::toml_value(value)))
            }
        };
        let accepted = match before {
            Some(now) => format!(
                "like the present value: {}",
                now.to_string().trim().replace('\n', "; ")
            ),
            None => "a key of the gain set".into(),
        };
        let shown = if count(&tree, last) == 1 { last } else { key };
        let name = format!(
            "{} {shown}={}",
            base.name(),
            value.trim_matches(['"', '\''])
        );
        let mut tree = tree.as_table().cloned().unwrap_or_default();
        tree.insert("name".into(), name.into());
        let set = (kind_of(&tree, &file)?.of_tree)(tree).map_err(|e| {
            let message = e.message().trim_end();
            // The error of an unknown key lists the known ones.
            match message
                .split_once(", expected ")
                .filter(|_| message.starts_with("unknown field"))
            {
                Some((problem, known)) => refuse(problem, known.into()),
                None => refuse(message, accepted),
            }
        })?;
        set.check(&file)?;
        Ok(set)
    }
}

/// The variants of `SET:KEY=V1,V2,...` as they are listed in a campaign. It fails if `sweep` does not have this form.
pub fn expand(sweep: &str) -> Result<Vec<String>> {
    let accepted = "SET:KEY=V1,V2,..., e.g. switching:zmp_margin=0.02,0.06";
    let refuse = |problem: &str| Error::option("--vary", sweep, problem, accepted);
    let ControllerName {
        base,
        change: Some((key, values)),
    } = ControllerName::split(sweep)
    else {
        return Err(refuse("names no key and values of a gain set"));
    };
    let values = split_values(values).ok_or_else(|| refuse("brackets or quotes do not close"))?;
    if values.iter().any(|value| value.is_empty()) {
        return Err(refuse("a value is empty"));
    }
    Ok(values
        .iter()
        .map(|value| {
            ControllerName {
                base,
                change: Some((key, value)),
            }
            .with_base(base)
        })
        .collect())
}

/// Splits at commas outside of brackets and quotes. It is None if a bracket or a quote does not close.
fn split_values(text: &str) -> Option<Vec<&str>> {
    let (mut values, mut start) = (Vec::new(), 0);
    let (mut depth, mut quote) = (0_u32, None);
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), _) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.checked_sub(1)?,
            (None, ',') if depth == 0 => {
                values.push(text[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    values.push(text[start..].trim());
    (depth == 0 && quote.is_none()).then_some(values)
}

/// Number of keys in the tree that have this name. A table of ranges is left out, since its keys are names of other
/// numbers.
fn count(tree: &Value, name: &str) -> usize {
    match tree {
        Value::Table(table) => {
            let named = table.iter().filter(|(key, _)| *key != "tunable");
            named
                .map(|(key, value)| usize::from(key == name) + count(value, name))
                .sum()
        }
        Value::Array(values) => values.iter().map(|value| count(value, name)).sum(),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{gain_set, load};
    use standfast_core::lipm::GainSet;

    #[test]
    fn a_variant_has_a_set_before_the_colon_and_a_key_behind_it() {
        for (text, base, change) in [
            ("switching", "switching", None),
            (
                "switching:zmp_margin=0.001",
                "switching",
                Some(("zmp_margin", "0.001")),
            ),
            (
                "swiching: zmp_margin = 0.001",
                "swiching",
                Some(("zmp_margin", "0.001")),
            ),
            (
                "a/g.toml:gains.0.x=[0.2, 1, 5]",
                "a/g.toml",
                Some(("gains.0.x", "[0.2, 1, 5]")),
            ),
            (r"C:\g.toml", r"C:\g.toml", None),
            (
                r"C:\g.toml:zmp_margin=0",
                r"C:\g.toml",
                Some(("zmp_margin", "0")),
            ),
            (
                "C:g.toml:zmp_margin=0",
                "C:g.toml",
                Some(("zmp_margin", "0")),
            ),
            ("a:b=1/g.toml", "a:b=1/g.toml", None),
            (
                "a:b=1/g.toml:zmp_margin=0",
                "a:b=1/g.toml",
                Some(("zmp_margin", "0")),
            ),
            (
                "hold:description='a:b=c/d'",
                "hold",
                Some(("description", "'a:b=c/d'")),
            ),
            (":a=1", ":a=1", None),
        ] {
            let entry = ControllerName::split(text);
            assert_eq!(entry, ControllerName { base, change }, "{text}");
            assert_eq!(
                ControllerName::split(&entry.with_base("switching")).change,
                change,
                "{text}"
            );
        }
    }

    #[test]
    fn a_sweep_is_split_at_the_commas_of_its_top_level() {
        let of = |text: &str| expand(&format!("fixed:k={text}")).unwrap();
        assert_eq!(of("1, 2"), ["fixed:k=1", "fixed:k=2"]);
        assert_eq!(
            of("[0.2,1,5],[1,1,5]"),
            ["fixed:k=[0.2,1,5]", "fixed:k=[1,1,5]"]
        );
        assert_eq!(of("{a=[1,2],b=3}"), ["fixed:k={a=[1,2],b=3}"]);
        assert_eq!(of("'a,b',\"c]\""), ["fixed:k='a,b'", "fixed:k=\"c]\""]);
        for (bad, problem) in [
            ("fixed", "names no key"),
            ("fixed:k", "names no key"),
            ("fixed:k=", "a value is empty"),
            ("fixed:k=1,,2", "a value is empty"),
            ("fixed:k=[1,2", "do not close"),
            ("fixed:k=1],2", "do not close"),
            ("fixed:k='1,2", "do not close"),
        ] {
            let error = expand(bad).unwrap_err();
            assert!(
                error.to_string().contains("--vary") && error.to_string().contains(problem),
                "{bad}: {error}"
            );
            assert_eq!(error.exit_code(), 2);
        }
    }

    #[test]
    fn one_value_is_changed_and_the_name_says_which() {
        let base = gain_set("switching").unwrap();
        let variant = gain_set("switching:zmp_margin=0.001").unwrap();
        assert_eq!(variant.name, "switching zmp_margin=0.001");
        assert_eq!(
            GainSet {
                name: base.name.clone(),
                zmp_margin: 0.06,
                ..variant
            },
            base
        );

        let variant = gain_set("switching:gains.1.x=[0.4,1,6]").unwrap();
        assert_eq!(variant.name, "switching gains.1.x=[0.4,1,6]");
        assert_eq!(variant.gains[1].x, [0.4, 1.0, 6.0]);
        assert_eq!(
            (&variant.gains[0], variant.gains[1].y),
            (&base.gains[0], base.gains[1].y)
        );
        assert_eq!(
            gain_set("switching:gains.4.y.2=7").unwrap().gains[4].y,
            [1.2, 1.0, 7.0]
        );
        // With one gain there is only one `x`.
        assert_eq!(
            gain_set("fixed:gains.0.x=[1,1,5]").unwrap().name,
            "fixed x=[1,1,5]"
        );
        assert_eq!(
            gain_set("fixed:gains.0.name='quick'").unwrap().name,
            "fixed gains.0.name=quick"
        );
        assert_eq!(
            load("hold:description='stiff'").unwrap().name(),
            "hold description=stiff"
        );
    }

    #[test]
    fn errors_name_the_variant_the_key_the_value_and_what_is_accepted() {
        for (bad, expected) in [
            (
                "switching:zmp_margin=wide",
                &[
                    "zmp_margin = wide",
                    "expected f64",
                    "like the present value: 0.06",
                ][..],
            ),
            (
                "switching:zmp_margin=-1",
                &[
                    "zmp_margin = -1",
                    "out of range",
                    "0 to 10, in half sole lengths",
                ],
            ),
            (
                "switching:gains.slow=1",
                &[
                    "gains.slow",
                    "the set has no `gains.slow`",
                    "gains.0 to gains.4",
                ],
            ),
            (
                "hold:gains.0.x=[1,1,5]",
                &[
                    "gains.0.x",
                    "the set has no `gains`",
                    "description, kind, name",
                ],
            ),
            (
                "hold:kind=walk",
                &["kind = \"walk\"", "no kind of controller", "\"posture\""],
            ),
            (
                "switching:gian.alpha=1",
                &["gian.alpha = 1", "the set has no `gian`", "zmp_margin"],
            ),
            (
                "switching:zmp_margin.x=1",
                &["zmp_margin.x", "the set has no `zmp_margin.x`"],
            ),
            (
                "switching:gains.0.x=[-1,1,5]",
                &["gains[0].x[0] = -1", "unstable", "positive"],
            ),
            (
                "switching:gains.0.z=1",
                &["gains.0.z = 1", "unknown field `z`", "`x`"],
            ),
            (
                "switching:zmp_margin=",
                &["zmp_margin = ", "not a value", "TOML"],
            ),
        ] {
            let error = load(bad).unwrap_err();
            let message = error.to_string();
            for part in expected.iter().chain(&[bad, "--vary"]) {
                assert!(
                    message.contains(part) && error.exit_code() == 2,
                    "{bad}: {part:?} not in {message:?}"
                );
            }
        }
    }
}
